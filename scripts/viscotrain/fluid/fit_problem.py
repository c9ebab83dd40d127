"""The problem of a fit: parameters of a fluid with a given number of modes, by least squares.

The residuals are r = ln(model/measured) of all numbers together, G', G'', eta and N1 alike, so that
noise is relative and each point counts once. Their squares are minimised over ln eta_s, ln eta_k,
ln lambda_k and alpha_k within bounds, from several starts: every choice of relaxation times from a
logarithmic grid over the measured window, with viscosities by non-negative least squares.

Normal stresses often scatter more than the rest. Where they do, sigma_N1 > sigma of all others,
each group is divided by its own sigma = rms(r), found by repetition: maximum likelihood of two
unknown variances. They are never trusted more than the others.

Covariance = s^2 (J^T J)^-1 with s^2 = sum r^2/(n - p), J the derivatives of the weighted r
(Gauss-Newton). The standard error of a logarithm is a relative uncertainty. It is the sensitivity
of the data to a parameter, without what the other parameters could do as well: one on which nothing
that was measured depends has no end. A fit whose parameters are not determined is refused: a mode
is a property of the fluid, or it is not worth a simulation.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls

from viscotrain.errors import DataError
from viscotrain.fluid import rheology
from viscotrain.fluid.fit_parameters import Known, Layout
from viscotrain.fluid.measurements import QUANTITIES
from viscotrain.fluid.parameters import Fluid, Mode

NORMAL_STRESS = "first_normal_stress_difference"
ELASTIC = {"storage_modulus", NORMAL_STRESS}  # a fluid without modes has none of them
MOST_MODES = 4  # tried where the number of modes is not given
NARROWEST_RANGE = 1.0  # decades of rates: less than the relaxation of a single mode
LARGEST_UNCERTAINTY = 0.5  # relative, of a viscosity or a time
LARGEST_MOBILITY_UNCERTAINTY = 0.25  # absolute
NOISE_FLOOR = 1e-3  # rms of r that no rheometer undercuts; keeps exact data from claiming certainty
LARGEST_MOBILITY = 0.99
WINDOW = 10.0  # factor by which relaxation times may lie outside the measured window
SPARE_TIMES = 3  # relaxation times on the grid of starts beyond the number of modes
SMALLEST_SHARE, LARGEST_SHARE = 1e-5, 10.0  # of a viscosity in the largest measured one
SMALLEST_START = 1e-3  # such a share at the start
START_MOBILITY = 0.3
ROUGH, FINE = 1e-4, 1e-10  # tolerances of all starts, and of the best one
POLISHED = 3  # starts that are followed to the end
REWEIGHTED = 5  # times that normal stresses are weighed anew by their scatter
OUT_OF_SIGHT = 10.0  # uncertainty, relative or absolute, of what nothing measured depends on
SINGULAR = 1e-12  # ratio of singular values below which a direction is not determined


@dataclass(frozen=True)
class FluidFit:
    """The best fluid with one number of modes.

    Args:
        fluid: In physical units.
        names: Of what was fitted, as in the config: solvent_viscosity, modes[0].viscosity, ...
        values: In Pa s, s and 1.
        uncertainties: Standard errors: relative for viscosities and times, absolute for mobilities.
        correlation: Of the parameters (viscosities and times: of their logarithms), shape (p, p).
        information: Inverse of the covariance, shape (p, p); singular where nothing is known.
        limits: Smallest and largest values, shape (2, p).
        data: As from `measurements.read`, with the columns model and residual, ln(model/measured),
            and noise, the scatter that the fit takes for it.
        criterion: BIC.
        undetermined: Why parameters are not determined; empty if they are.
    """

    fluid: Fluid
    names: tuple[str, ...]
    values: NDArray
    uncertainties: NDArray
    correlation: NDArray
    information: NDArray
    limits: NDArray
    data: pd.DataFrame
    criterion: float
    undetermined: tuple[str, ...]

    @property
    def misfit(self) -> float:
        """Root mean square of the residuals."""
        return _rms(self.data["residual"])

    @property
    def largest_misfit(self) -> float:
        """The same of the normal stress differences or of all others, whichever is larger."""
        normal = self.data["quantity"] == NORMAL_STRESS
        return max(_rms(part) for _, part in self.data["residual"].groupby(normal))


def model(quantity: str, abscissa: NDArray, fluid: Fluid) -> NDArray:
    """What a rheometer would measure: one of `measurements.QUANTITIES` at rates in 1/s."""
    functions = {
        "storage_modulus": rheology.storage_modulus,
        "loss_modulus": rheology.loss_modulus,
        "viscosity": rheology.viscosity,
        NORMAL_STRESS: lambda rate, fluid: (
            rheology.steady_shear(rate, fluid).first_normal_stress_difference
        ),
    }
    return functions[quantity](abscissa, fluid)


class FitProblem:
    """Residuals of the measured numbers as a function of a vector of parameters (`Layout`)."""

    def __init__(self, data: pd.DataFrame, known: Known):
        self.data, self.known = data, known
        self.parts = [
            (name, data["abscissa"].to_numpy()[rows], data["measured"].to_numpy()[rows], rows)
            for name in QUANTITIES
            if (rows := np.flatnonzero(data["quantity"] == name)).size
        ]
        self.measured = {name for name, *_ in self.parts}
        self.normal = (data["quantity"] == NORMAL_STRESS).to_numpy()
        self.slowest, self.fastest = data["abscissa"].min(), data["abscissa"].max()
        apparent = [
            y if name == "viscosity" else y / x
            for name, x, y, _ in self.parts
            if name != NORMAL_STRESS
        ]
        self.largest_viscosity = max((part.max() for part in apparent), default=math.nan)

    def enough_for(self, count: int) -> bool:
        """Whether there are more numbers than parameters."""
        return len(self.data) > Layout(count, self.known).size

    def possible_numbers_of_modes(self) -> list[int]:
        """A fluid without modes has no elasticity, and no mode of which something is known."""
        first = max(int(bool(ELASTIC & self.measured)), self.known.fewest_modes)
        enough = [count for count in range(first, MOST_MODES + 1) if self.enough_for(count)]
        return list(range(first, max(enough, default=first) + 1))

    def check(self, counts: Sequence[int]):
        """Refuse what no fit could succeed with."""
        fewest, known = min(counts), self.known.fewest_modes
        if fewest < known:
            raise DataError(
                f"found known numbers of {known} mode{'' if known == 1 else 's'}; allowed: of at "
                f"most {fewest}, the number of modes"
            )
        size = Layout(fewest, self.known).size
        if not self.enough_for(fewest):
            raise DataError(
                f"found {len(self.data)} measured numbers; allowed: at least {size + 1}, more than "
                f"the {size} parameters of a fluid with {fewest} mode{'' if fewest == 1 else 's'}"
            )
        if math.isnan(self.largest_viscosity):
            raise DataError(
                "found normal stress differences only; allowed: with viscosities or moduli, "
                "because the solvent does not act in them"
            )
        for name in sorted(ELASTIC & self.measured) if fewest == 0 else ():
            raise DataError(
                f"found a {name.replace('_', ' ')}; allowed: at least one mode, fluid.fit.modes"
            )
        decades = math.log10(self.fastest / self.slowest)
        if decades < NARROWEST_RANGE:
            raise DataError(
                f"rates from {self.slowest:g} to {self.fastest:g} 1/s were measured, "
                f"{decades:.1f} decades; allowed: at least {NARROWEST_RANGE:g}"
            )

    def residuals(self, fluid: Fluid) -> NDArray:
        """ln(model/measured) of all numbers."""
        r = np.empty(len(self.data))
        for name, x, y, rows in self.parts:
            r[rows] = np.log(model(name, x, fluid) / y)
        return r

    def noise(self, r: NDArray) -> NDArray:
        """Scatter of each number: of all together, or of normal stresses if they have more."""
        if self.normal.any() and _rms(r[self.normal]) > _rms(r[~self.normal]):
            own = np.where(self.normal, _rms(r[self.normal]), _rms(r[~self.normal]))
        else:
            own = np.full(r.size, _rms(r))
        return np.maximum(own, NOISE_FLOOR)

    def bounds(self, layout: Layout) -> tuple[NDArray, NDArray]:
        """Smallest and largest vector."""
        eta = self.largest_viscosity * np.array([SMALLEST_SHARE, LARGEST_SHARE])
        lam = np.array([1 / (WINDOW * self.fastest), WINDOW / self.slowest])
        limits = np.array([eta, *[eta, lam, (0.0, LARGEST_MOBILITY)] * layout.count])
        return layout.vector(limits[:, 0]), layout.vector(limits[:, 1])

    def starts(self, layout: Layout) -> list[NDArray]:
        """A vector for each choice of relaxation times from the grid, the slowest mode first."""
        times = np.geomspace(1 / self.slowest, 1 / self.fastest, layout.count + SPARE_TIMES + 2)
        chosen = itertools.combinations(times[1:-1], layout.unknown_times())
        return [self._start(layout, layout.times(own)) for own in chosen]

    def _start(self, layout: Layout, times: Sequence[float]) -> NDArray:
        """Viscosities that suit given times; at given times the model is linear in them."""
        alphas = layout.mobilities(START_MOBILITY)
        modes = [Mode(1.0, lam, alpha) for lam, alpha in zip(times, alphas, strict=True)]
        eta_s, matrix, right = self.known.solvent_viscosity, [], []
        for name, x, y, _ in self.parts:
            solvent = model(name, x, Fluid(1.0)) / y
            alone = [model(name, x, Fluid(1.0, (mode,))) / y - solvent for mode in modes]
            if eta_s is None:
                matrix.append(np.column_stack([solvent, *alone]))
                right.append(np.ones_like(y))
            else:
                matrix.append(np.column_stack(alone) if alone else np.empty((y.size, 0)))
                right.append(1 - eta_s * solvent)
        eta = nnls(np.vstack(matrix), np.concatenate(right))[0]
        eta = np.clip(eta, SMALLEST_START * self.largest_viscosity, self.largest_viscosity)
        own, of_modes = ([eta[0]], eta[1:]) if eta_s is None else ([1.0], eta)
        rows = list(zip(of_modes, times, alphas, strict=True))
        return layout.vector(np.concatenate([own, np.ravel(rows)]))

    def solve(self, count: int) -> FluidFit:
        """Best fit with this number of modes."""
        layout = Layout(count, self.known)
        if layout.size == 0:
            return self._finished(layout, np.array([]), np.zeros((len(self.data), 0)))
        low, high = self.bounds(layout)

        def minimum(start, weights, tolerance, evaluations):
            return least_squares(
                lambda vector: weights * self.residuals(layout.fluid(vector)),
                np.clip(start, low + 1e-6, high - 1e-6),
                bounds=(low, high),
                xtol=tolerance,
                ftol=tolerance,
                gtol=tolerance,
                max_nfev=evaluations,
            )

        equal = np.ones(len(self.data))
        rough = [minimum(start, equal, ROUGH, 40) for start in self.starts(layout)]
        rough.sort(key=lambda found: found.cost)
        fine = [minimum(found.x, equal, FINE, 200) for found in rough[:POLISHED]]
        best = min(fine, key=lambda found: found.cost)
        for _ in range(REWEIGHTED if self.normal.any() else 0):
            noise = self.noise(self.residuals(layout.fluid(best.x)))
            best = minimum(best.x, noise.min() / noise, FINE, 200)
        return self._finished(layout, best.x, best.jac)

    def _finished(self, layout: Layout, vector: NDArray, jacobian: NDArray) -> FluidFit:
        order = layout.slowest_first(vector)
        vector, jacobian = vector[order], jacobian[:, order]
        fluid, n, p = layout.fluid(vector), len(self.data), layout.size
        r = self.residuals(fluid)
        noise = self.noise(r)
        variance = n * noise.min() ** 2 / (n - p)
        uncertainties, correlation = _spread(jacobian, variance)
        low, high = self.bounds(layout)
        natural = np.where(layout.logarithmic, np.exp([vector, low, high]), [vector, low, high])
        alone = math.sqrt(variance) / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
        reasons = [*self._reasons(layout, vector, uncertainties, alone), *_out_of_order(fluid)]
        return FluidFit(
            fluid=fluid,
            names=layout.names,
            values=natural[0],
            uncertainties=uncertainties,
            correlation=correlation,
            information=jacobian.T @ jacobian / variance,
            limits=natural[1:],
            data=self.data.assign(model=self.data["measured"] * np.exp(r), residual=r, noise=noise),
            criterion=2 * np.log(noise).sum() + p * math.log(n),
            undetermined=tuple(reasons),
        )

    def _reasons(self, layout: Layout, vector, uncertainties, alone) -> Iterator[str]:
        """A line of text for each parameter that is not determined.

        Args:
            layout: Of the vector.
            vector: Best values.
            uncertainties: Standard errors.
            alone: What these were if all other parameters were known.
        """
        for name, value, error, by_itself, least, most in zip(
            layout.names, vector, uncertainties, alone, *self.bounds(layout), strict=True
        ):
            if by_itself > OUT_OF_SIGHT:
                yield f"{name}: nothing that was measured depends on it"
            elif name.endswith("mobility"):
                if most - value < 1e-3:
                    yield f"{name}: {value:.2g}, the largest allowed"
                elif not error <= LARGEST_MOBILITY_UNCERTAINTY:
                    yield (
                        f"{name}: {value:.2g} with an uncertainty of {error:.2g}; "
                        f"allowed: {LARGEST_MOBILITY_UNCERTAINTY:g}"
                    )
            elif min(value - least, most - value) < 1e-3:
                yield f"{name}: {math.exp(value):.3g}, at the limit of what was measured"
            elif not error <= LARGEST_UNCERTAINTY:
                yield (
                    f"{name}: {math.exp(value):.3g} with a relative uncertainty of "
                    f"{100 * error:.0f} %; allowed: {100 * LARGEST_UNCERTAINTY:.0f} %"
                )


def _out_of_order(fluid: Fluid) -> Iterator[str]:
    """Modes are named by their order, so that known numbers belong to the right ones."""
    for k, (slow, fast) in enumerate(itertools.pairwise(fluid.modes)):
        if fast.relaxation_time > slow.relaxation_time:
            yield (
                f"modes[{k + 1}].relaxation_time: {fast.relaxation_time:.3g} s, slower than the "
                f"mode before it, {slow.relaxation_time:.3g} s, which fluid.fit puts there"
            )


def _rms(r) -> float:
    return float(np.sqrt(np.mean(np.square(r))))


def _spread(jacobian: NDArray, variance: float) -> tuple[NDArray, NDArray]:
    """Standard errors and correlation matrix; huge, not infinite, where nothing is determined."""
    if not jacobian.shape[1]:
        return np.zeros(0), np.zeros((0, 0))
    _, singular, V = np.linalg.svd(jacobian, full_matrices=False)
    singular = np.maximum(singular, SINGULAR * singular[0])
    scaled = V.T / singular
    covariance = variance * scaled @ scaled.T
    errors = np.sqrt(np.diag(covariance))
    return errors, covariance / np.outer(errors, errors)
