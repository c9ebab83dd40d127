"""Fit of the fluid to measured moduli and viscosities.

The residuals are r = ln(model/measured) of all numbers together, G', G'' and eta alike, so that
noise is relative and each point counts once. Their squares are minimised over ln eta_s, ln eta_k,
ln lambda_k and alpha_k within bounds, from several starts: every choice of relaxation times from a
logarithmic grid over the measured window, with viscosities by non-negative least squares.

The number of modes minimises the Bayesian information criterion (Schwarz, Ann. Stat. 6, 1978, 461)

    BIC = n ln(sum r^2/n) + p ln n,      n numbers, p parameters;

modes are added one by one until it rises.

Covariance = s^2 (J^T J)^-1 with s^2 = sum r^2/(n - p), J the derivatives of r (Gauss-Newton). The
standard error of a logarithm is a relative uncertainty. A fit whose parameters are not determined
is refused: a mode is a property of the fluid, or it is not worth a simulation.
"""

import itertools
import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
import yaml
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls

from viscotrain.errors import DataError
from viscotrain.fluid import rheology
from viscotrain.fluid.measurements import QUANTITIES
from viscotrain.fluid.parameters import Mode

MOST_MODES = 4  # tried where the number of modes is not given
NARROWEST_RANGE = 1.0  # decades of rates: less than the relaxation of a single mode
LARGEST_MISFIT = 0.25  # rms of r: more is another fluid, or another unit
LARGEST_UNCERTAINTY = 0.5  # relative, of a viscosity or a time
LARGEST_MOBILITY_UNCERTAINTY = 0.25  # absolute
VERY_STRONG = 10.0  # difference of BIC that rules a model out (Kass & Raftery, JASA 90, 1995, 773)
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
DIGITS = 4  # of the fluid that is written: fewer than the minimisation has, more than data deserve


@dataclass(frozen=True)
class Fluid:
    """A solvent viscosity in Pa s and modes in Pa s, s and 1, the longest time first."""

    solvent_viscosity: float
    modes: tuple[Mode, ...] = ()


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


@dataclass(frozen=True)
class Result:
    """The fit that was chosen, and all that were compared, by number of modes."""

    chosen: FluidFit
    candidates: tuple[FluidFit, ...]


def model(quantity: str, abscissa: NDArray, fluid: rheology.FluidLike) -> NDArray:
    """What a rheometer would measure: one of `measurements.QUANTITIES` at rates in 1/s."""
    functions = {
        "storage_modulus": rheology.storage_modulus,
        "loss_modulus": rheology.loss_modulus,
        "viscosity": rheology.viscosity,
    }
    return functions[quantity](abscissa, fluid)


def fit(
    data: pd.DataFrame, modes: int | None = None, solvent_viscosity: float | None = None
) -> Result:
    """Fit a fluid to measured numbers.

    Args:
        data: As from `measurements.read`.
        modes: Number of modes; None to choose it.
        solvent_viscosity: In Pa s, if it is known; None to fit it.

    Raises:
        DataError: The data cannot determine a fluid, or no fluid describes them.
    """
    numbers = _Problem(data, solvent_viscosity)
    wanted = numbers.possible_numbers_of_modes() if modes is None else [modes]
    numbers.check(wanted)
    candidates: list[FluidFit] = []
    for count in wanted:
        candidates.append(numbers.solve(count))
        if len(candidates) > 1 and candidates[-1].criterion > candidates[-2].criterion:
            break
    return Result(_choose(candidates), tuple(candidates))


def _choose(candidates: Sequence[FluidFit]) -> FluidFit:
    """The smallest BIC whose parameters are determined, unless data rule it out."""
    ranked = sorted(candidates, key=lambda candidate: candidate.criterion)
    best = ranked[0]
    if not best.misfit <= LARGEST_MISFIT:
        raise DataError(
            f"the best fluid, with {_modes(best)}, misses the data by {100 * best.misfit:.0f} % "
            f"(rms); allowed: {100 * LARGEST_MISFIT:.0f} %. Are all units right "
            "(rad/s, not Hz; Pa s, not mPa s), and all files of the same fluid?"
        )
    for candidate in ranked:
        if candidate.criterion - best.criterion > VERY_STRONG:
            break
        if not candidate.undetermined:
            return candidate
    raise DataError(
        "\n".join(
            [
                f"the data do not determine a fluid with {_modes(best)}:",
                *(f"  {reason}" for reason in best.undetermined),
                "allowed: fewer modes (fluid.fit.modes), a known fluid.solvent_viscosity, or more "
                "data",
            ]
        )
    )


def _modes(fitted: FluidFit) -> str:
    count = len(fitted.fluid.modes)
    return f"{count} mode" + ("" if count == 1 else "s")


# ---------------------------------------------------------------------------------------- outcome


def rounded(fluid: rheology.FluidLike) -> dict:
    """The fluid as the config spells it, to a few digits, so that it does not follow round-off."""

    def short(value: float) -> float:
        return float(f"{value:.{DIGITS}g}")

    return {
        "solvent_viscosity": short(fluid.solvent_viscosity),
        "modes": [
            {
                "viscosity": short(mode.viscosity),
                "relaxation_time": short(mode.relaxation_time),
                "mobility": short(mode.mobility),
            }
            for mode in fluid.modes
        ],
    }


def as_yaml(fitted: FluidFit) -> str:
    """The section `fluid` of a config, with what it rests on as comments."""
    files = ", ".join(sorted({Path(name).name for name in fitted.data["file"]}))
    errors = ", ".join(
        f"{name} {error:.2g}" if name.endswith("mobility") else f"{name} {100 * error:.1f} %"
        for name, error in zip(fitted.names, fitted.uncertainties, strict=True)
    )
    comment = (
        f"Fitted to {len(fitted.data)} numbers in {files}, rms deviation {100 * fitted.misfit:.1f} "
        f"%. Standard errors: {errors or 'nothing was fitted'}."
    )
    falling = _falling_stress(fitted.fluid)
    if falling is not None:
        comment += (
            f" The shear stress falls with the shear rate at {falling:.3g} 1/s: no unique steady "
            "flow there."
        )
    lines = textwrap.wrap(comment, 95)
    settings = {"sort_keys": False, "default_flow_style": None, "width": 99}
    block = yaml.safe_dump({"fluid": rounded(fitted.fluid)}, **settings)
    return "".join(f"# {line}\n" for line in lines) + block


def _falling_stress(fluid: Fluid) -> float | None:
    """The smallest shear rate in 1/s at which the shear stress falls; None if it never does."""
    times = [mode.relaxation_time for mode in fluid.modes]
    if not times:
        return None
    rates = np.geomspace(0.1 / max(times), 1e4 / min(times), 2000)
    falling = np.diff(rheology.viscosity(rates, fluid) * rates) < 0
    return float(rates[np.argmax(falling)]) if falling.any() else None


def dataset(result: Result, attributes: dict[str, str]) -> xr.Dataset:
    """Parameters with uncertainties and correlation, data with residuals, and what was compared.

    Args:
        result: Of `fit`.
        attributes: Global attributes.
    """
    fitted = result.chosen
    data = fitted.data
    logarithmic = [not name.endswith("mobility") for name in fitted.names]
    parameters = {
        "value": (fitted.values, "value: viscosities in Pa s, times in s, mobilities in 1"),
        "uncertainty": (
            fitted.uncertainties,
            "standard error: relative for viscosities and times, absolute for mobilities",
        ),
        "relative": (np.array(logarithmic, dtype=np.int8), "1: uncertainty is relative"),
    }
    numbers = {
        "abscissa": (data["abscissa"], "angular frequency in rad/s or shear rate in 1/s"),
        "measured": (data["measured"], "measured modulus in Pa or viscosity in Pa s"),
        "model": (data["model"], "the same of the fitted fluid"),
        "residual": (data["residual"], "logarithm of model over measured"),
        "line": (data["line"], "line of the file"),
    }
    compared = {
        "criterion": ([c.criterion for c in result.candidates], "Bayesian information criterion"),
        "misfit": ([c.misfit for c in result.candidates], "root mean square residual"),
        "determined": (
            np.array([not c.undetermined for c in result.candidates], dtype=np.int8),
            "1: all parameters are determined",
        ),
    }

    def described(dimension, variables):
        for name, (values, long_name) in variables.items():
            of = {"long_name": long_name}
            if name not in ("value", "abscissa", "measured", "model"):
                of["units"] = "1"
            yield name, (dimension, np.asarray(values), of)

    def texts(name):
        return np.array(data[name].tolist(), dtype=object)

    return xr.Dataset(
        {
            **dict(described("parameter", parameters)),
            "correlation": (
                ("parameter", "other_parameter"),
                fitted.correlation,
                {"long_name": "correlation of the errors of two parameters", "units": "1"},
            ),
            **dict(described("number", numbers)),
            "file": ("number", texts("file"), {"long_name": "file of the number"}),
            "quantity": ("number", texts("quantity"), {"long_name": "what was measured"}),
            **dict(described("modes", compared)),
        },
        coords={
            "parameter": ("parameter", list(fitted.names), {"long_name": "parameter"}),
            "other_parameter": ("other_parameter", list(fitted.names), {"long_name": "parameter"}),
            "modes": (
                "modes",
                [len(c.fluid.modes) for c in result.candidates],
                {"long_name": "number of modes that were tried", "units": "1"},
            ),
        },
        attrs=attributes,
    )


def summary(result: Result) -> str:
    """What was tried and chosen, as text."""
    lines = ["modes    BIC   rms deviation"]
    for c in result.candidates:
        mark = "  <- chosen" if c is result.chosen else "  undetermined" * bool(c.undetermined)
        count = len(c.fluid.modes)
        lines.append(f"{count:5d} {c.criterion:8.1f} {100 * c.misfit:8.1f} %{mark}")
    return "\n".join([*lines, "", as_yaml(result.chosen)])


# ---------------------------------------------------------------------------------------- solution


class _Problem:
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
        return 3 * count + (self.solvent_viscosity is None)

    def enough_for(self, count: int) -> bool:
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
        fluid = self.fluid(vector)
        r = np.empty(len(self.data))
        for name, x, y, rows in self.parts:
            r[rows] = np.log(model(name, x, fluid) / y)
        return r

    def bounds(self, count: int) -> tuple[NDArray, NDArray]:
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
