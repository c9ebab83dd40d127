"""The problem of a fit: parameters of a fluid with a given number of modes, by least squares.

The residuals are r = ln(model/measured) of all numbers together, G', G'' and eta alike, so that
noise is relative and each point counts once. Their squares are minimised over ln eta_s, ln eta_k,
ln lambda_k and alpha_k within bounds, from several starts: every choice of relaxation times from a
logarithmic grid over the measured window, with viscosities by non-negative least squares.

Covariance = s^2 (J^T J)^-1 with s^2 = sum r^2/(n - p), J the derivatives of r (Gauss-Newton). The
standard error of a logarithm is a relative uncertainty. A fit whose parameters are not determined
is refused: a mode is a property of the fluid, or it is not worth a simulation.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls

from viscotrain.errors import DataError
from viscotrain.fluid import rheology
from viscotrain.fluid.measurements import QUANTITIES
from viscotrain.fluid.parameters import Fluid, Mode

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
SINGULAR = 1e-12  # ratio of singular values below which a direction is not determined


@dataclass(frozen=True)
class FluidFit:
    """The best fluid with one number of modes.

    Args:
        fluid: In physical units.
        names: Of the parameters, as in the config: solvent_viscosity, modes[0].viscosity, ...
        values: In Pa s, s and 1.
        uncertainties: Standard errors: relative for viscosities and times, absolute for mobilities.
        correlation: Of the parameters (viscosities and times: of their logarithms), shape (p, p).
        data: As from `measurements.read`, with the columns model and residual, ln(model/measured).
        criterion: BIC.
        undetermined: Why parameters are not determined; empty if they are.
    """

    fluid: Fluid
    names: tuple[str, ...]
    values: NDArray
    uncertainties: NDArray
    correlation: NDArray
    data: pd.DataFrame
    criterion: float
    undetermined: tuple[str, ...]

    @property
    def misfit(self) -> float:
        """Root mean square of the residuals."""
        return float(np.sqrt(np.mean(self.data["residual"] ** 2)))


def model(quantity: str, abscissa: NDArray, fluid: Fluid) -> NDArray:
    """What a rheometer would measure: one of `measurements.QUANTITIES` at rates in 1/s."""
    functions = {
        "storage_modulus": rheology.storage_modulus,
        "loss_modulus": rheology.loss_modulus,
        "viscosity": rheology.viscosity,
    }
    return functions[quantity](abscissa, fluid)


class FitProblem:
    """Residuals of the measured numbers as a function of a vector of parameters.

    The vector is ln eta_s, if it is fitted, then ln eta_k, ln lambda_k and alpha_k of each mode.
    """

    def __init__(self, data: pd.DataFrame, solvent_viscosity: float | None):
        self.data, self.solvent_viscosity = data, solvent_viscosity
        self.parts = [
            (name, data["abscissa"].to_numpy()[rows], data["measured"].to_numpy()[rows], rows)
            for name in QUANTITIES
            if (rows := np.flatnonzero(data["quantity"] == name)).size
        ]
        self.measured = {name for name, *_ in self.parts}
        self.slowest, self.fastest = data["abscissa"].min(), data["abscissa"].max()
        apparent = [y if name == "viscosity" else y / x for name, x, y, _ in self.parts]
        self.largest_viscosity = max((part.max() for part in apparent), default=math.nan)

    def parameters(self, count: int) -> int:
        """How many there are with this number of modes."""
        return 3 * count + (self.solvent_viscosity is None)

    def enough_for(self, count: int) -> bool:
        """Whether there are more numbers than parameters."""
        return len(self.data) > self.parameters(count)

    def possible_numbers_of_modes(self) -> list[int]:
        """A fluid without modes has no storage modulus."""
        first = 1 if "storage_modulus" in self.measured else 0
        last = max(first, sum(map(self.enough_for, range(1, MOST_MODES + 1))))
        return list(range(first, last + 1))

    def check(self, counts: Sequence[int]):
        """Refuse what no fit could succeed with."""
        fewest = min(counts)
        if not self.enough_for(fewest):
            raise DataError(
                f"found {len(self.data)} measured numbers; allowed: at least "
                f"{self.parameters(fewest) + 1}, more than the {self.parameters(fewest)} "
                f"parameters of a fluid with {fewest} mode{'' if fewest == 1 else 's'}"
            )
        if max(counts) > 0 and "viscosity" not in self.measured:
            raise DataError(
                "no viscosity was measured; allowed: moduli with viscosities, because the mobility "
                "of a mode does not act in small oscillation"
            )
        if fewest == 0 and "storage_modulus" in self.measured:
            raise DataError("found a storage modulus; allowed: at least one mode, fluid.fit.modes")
        decades = math.log10(self.fastest / self.slowest)
        if decades < NARROWEST_RANGE:
            raise DataError(
                f"rates from {self.slowest:g} to {self.fastest:g} 1/s were measured, "
                f"{decades:.1f} decades; allowed: at least {NARROWEST_RANGE:g}"
            )

    def fluid(self, vector: NDArray) -> Fluid:
        """The fluid of a vector, its modes in the same order."""
        eta_s, rest = self.solvent_viscosity, vector
        if eta_s is None:
            eta_s, rest = math.exp(vector[0]), vector[1:]
        return Fluid(
            eta_s,
            tuple(Mode(math.exp(a), math.exp(b), alpha) for a, b, alpha in rest.reshape(-1, 3)),
        )

    def residuals(self, vector: NDArray) -> NDArray:
        """ln(model/measured) of all numbers."""
        fluid = self.fluid(vector)
        r = np.empty(len(self.data))
        for name, x, y, rows in self.parts:
            r[rows] = np.log(model(name, x, fluid) / y)
        return r

    def bounds(self, count: int) -> tuple[NDArray, NDArray]:
        """Smallest and largest vector."""
        eta = np.log(self.largest_viscosity * np.array([SMALLEST_SHARE, LARGEST_SHARE]))
        lam = np.log([1 / (WINDOW * self.fastest), WINDOW / self.slowest])
        own = [eta] if self.solvent_viscosity is None else []
        limits = np.array([*own, *[eta, lam, (0.0, LARGEST_MOBILITY)] * count]).reshape(-1, 2)
        return limits[:, 0], limits[:, 1]

    def starts(self, count: int) -> list[NDArray]:
        """A vector for each choice of relaxation times from the grid."""
        times = np.geomspace(1 / self.fastest, 1 / self.slowest, count + SPARE_TIMES + 2)[1:-1]
        return [self._start(chosen) for chosen in itertools.combinations(times, count)]

    def _start(self, times: Sequence[float]) -> NDArray:
        """Viscosities that suit given times; at given times the model is linear in them."""
        modes = [Mode(1.0, lam, START_MOBILITY) for lam in times]
        matrix, right = [], []
        for name, x, y, _ in self.parts:
            solvent = model(name, x, Fluid(1.0)) / y
            alone = [model(name, x, Fluid(1.0, (mode,))) / y - solvent for mode in modes]
            if self.solvent_viscosity is None:
                matrix.append(np.column_stack([solvent, *alone]))
                right.append(np.ones_like(y))
            else:
                matrix.append(np.column_stack(alone) if alone else np.empty((y.size, 0)))
                right.append(1 - self.solvent_viscosity * solvent)
        eta = nnls(np.vstack(matrix), np.concatenate(right))[0]
        eta = np.log(np.clip(eta, SMALLEST_START * self.largest_viscosity, self.largest_viscosity))
        own, of_modes = eta[: eta.size - len(modes)], eta[eta.size - len(modes) :]
        rows = [(a, math.log(lam), START_MOBILITY) for a, lam in zip(of_modes, times, strict=True)]
        return np.concatenate([own, np.ravel(rows)])

    def solve(self, count: int) -> FluidFit:
        """Best fit with this number of modes."""
        if self.parameters(count) == 0:
            return self._finished(np.array([]), np.zeros((len(self.data), 0)))
        bounds = self.bounds(count)

        def minimum(start, tolerance, evaluations):
            inside = np.clip(start, bounds[0] + 1e-6, bounds[1] - 1e-6)
            return least_squares(
                self.residuals,
                inside,
                bounds=bounds,
                xtol=tolerance,
                ftol=tolerance,
                gtol=tolerance,
                max_nfev=evaluations,
            )

        rough = [minimum(start, ROUGH, 40) for start in self.starts(count)]
        rough.sort(key=lambda found: found.cost)
        fine = [minimum(found.x, FINE, 200) for found in rough[:POLISHED]]
        best = min(fine, key=lambda found: found.cost)
        return self._finished(best.x, best.jac)

    def _finished(self, vector: NDArray, jacobian: NDArray) -> FluidFit:
        vector, jacobian = self._longest_first(vector, jacobian)
        fluid, n, p = self.fluid(vector), len(self.data), vector.size
        r = self.residuals(vector)
        squares = max(r @ r, n * NOISE_FLOOR**2)
        uncertainties, correlation = _spread(jacobian, squares / (n - p))
        names = self._names(len(fluid.modes))
        fitted = self.data.assign(model=self.data["measured"] * np.exp(r), residual=r)
        logarithmic = np.array([not name.endswith("mobility") for name in names], dtype=bool)
        return FluidFit(
            fluid=fluid,
            names=names,
            values=np.where(logarithmic, np.exp(vector), vector),
            uncertainties=uncertainties,
            correlation=correlation,
            data=fitted,
            criterion=n * math.log(squares / n) + p * math.log(n),
            undetermined=tuple(self._reasons(names, vector, uncertainties)),
        )

    def _longest_first(self, vector: NDArray, jacobian: NDArray) -> tuple[NDArray, NDArray]:
        first = int(self.solvent_viscosity is None)
        order = first + 3 * np.argsort(-vector[first + 1 :: 3])
        order = np.concatenate([np.arange(first), *(k + np.arange(3) for k in order)]).astype(int)
        return vector[order], jacobian[:, order]

    def _names(self, count: int) -> tuple[str, ...]:
        own = ["solvent_viscosity"] if self.solvent_viscosity is None else []
        keys = ("viscosity", "relaxation_time", "mobility")
        return (*own, *(f"modes[{k}].{key}" for k in range(count) for key in keys))

    def _reasons(self, names, vector, uncertainties):
        """A line of text for each parameter that is not determined."""
        low, high = self.bounds(len(names) // 3)
        for name, value, error, least, most in zip(
            names, vector, uncertainties, low, high, strict=True
        ):
            if name.endswith("mobility"):
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
