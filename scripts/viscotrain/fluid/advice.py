"""What to measure next: which further data would determine what a fit leaves open.

A measurement of a quantity y at a rate adds to the information matrix (the inverse of the
covariance, `fit_problem`) of the parameters p

    (dy_p dy_p^T)/s^2,    dy_p = d ln y/dp at the best fluid,    s the scatter of ln y,

so that its worth is known before it is made (optimal design of experiments; Atkinson, Donev &
Tobias, Optimum Experimental Designs, with SAS, 2007). Tried are `PER_DECADE` points per decade over
one decade, then two, ..., anywhere around the rates of the modes; of each quantity the narrowest
range is named which determines what is open, and of these ranges the best. This is a linear
estimate at the best fluid, with the mobility that the fit starts with in place of those that are
open.
"""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from viscotrain.fluid.fit_parameters import logarithmic, with_values
from viscotrain.fluid.fit_problem import (
    LARGEST_MOBILITY_UNCERTAINTY,
    LARGEST_UNCERTAINTY,
    NORMAL_STRESS,
    START_MOBILITY,
    FluidFit,
    model,
)
from viscotrain.fluid.measurements import COLUMNS, QUANTITIES

PER_DECADE = 10
WIDEST = 3  # decades of a measurement that is proposed
AROUND = 100.0  # factor by which it may lie outside the modes' own rates
LEAST_NOISE = {NORMAL_STRESS: 0.05}  # that a rheometer has, at best
USUAL_NOISE = 0.02  # the same of other quantities
SURE = 0.05  # relative uncertainty of a relaxation time or a viscosity measured by other means
PRIOR = 5.0  # what is thought of a parameter before any measurement, in its own unit
STEP = 1e-5  # of derivatives, in the vector of the fit
OTHER_MEANS = {
    "modes[0].relaxation_time": "the longest relaxation time from extensional rheometry "
    "(fluid.fit.relaxation_times)",
    "solvent_viscosity": "the viscosity of the solvent (fluid.solvent_viscosity)",
}


def helpful(fitted: FluidFit) -> Iterator[str]:
    """Measurements that would determine what is open, one a line; none if no single one would."""
    open_ones = _not_determined(fitted)
    if not fitted.fluid.modes or not open_ones:
        return
    limit = _limits(fitted)
    information = fitted.information + np.eye(limit.size) / PRIOR**2
    rates = _rates(fitted)
    for quantity in QUANTITIES:
        worth = _worth(fitted, open_ones, quantity, rates)
        found = _best_range(worth, information, open_ones, limit)
        if found is not None:
            first, last, errors = found
            yield (
                f"{quantity.replace('_', ' ')} at {_range(quantity, rates[first], rates[last])} "
                f"({_words(fitted, open_ones, errors)})"
            )
    for name, text in OTHER_MEANS.items():
        if name in fitted.names:
            known = np.zeros(limit.size)
            known[fitted.names.index(name)] = 1 / SURE
            errors = _errors(information + np.outer(known, known))
            if np.all((errors <= limit)[open_ones]):
                yield text


def _limits(fitted: FluidFit) -> NDArray:
    """Largest uncertainty that a fit may have, of each parameter."""
    logs = logarithmic(fitted.names)
    return np.where(logs, LARGEST_UNCERTAINTY, LARGEST_MOBILITY_UNCERTAINTY)


def _not_determined(fitted: FluidFit) -> list[int]:
    """Indices of parameters of which the fit says so."""
    named = {reason.partition(":")[0] for reason in fitted.undetermined}
    return [k for k, name in enumerate(fitted.names) if name in named]


def _rates(fitted: FluidFit) -> NDArray:
    """Rates in 1/s at which measurements are tried, at round numbers, `PER_DECADE` a decade."""
    times = [mode.relaxation_time for mode in fitted.fluid.modes]
    low = math.floor(math.log10(1 / (AROUND * max(times))))
    high = math.ceil(math.log10(AROUND / min(times)))
    return np.logspace(low, high, PER_DECADE * (high - low) + 1)


def _worth(fitted: FluidFit, open_ones: list[int], quantity: str, rates: NDArray) -> NDArray:
    """Derivatives of ln y over its scatter, shape (rate, p)."""
    own = fitted.data.loc[fitted.data["quantity"] == quantity, "noise"]
    scatter = own if len(own) else fitted.data["noise"]
    noise = max(float(scatter.min()), LEAST_NOISE.get(quantity, USUAL_NOISE))
    logs = logarithmic(fitted.names)
    unknown = np.isin(np.arange(logs.size), open_ones) & ~logs
    best = np.where(logs, np.log(np.where(logs, fitted.values, 1.0)), fitted.values)
    best = np.where(unknown, START_MOBILITY, best)

    def logarithm(vector: NDArray) -> NDArray:
        values = np.where(logs, np.exp(vector), vector)
        return np.log(model(quantity, rates, with_values(fitted.fluid, fitted.names, values)))

    # Forward, not central: a mobility may be at its limit 0.
    steps = STEP * np.eye(logs.size)
    return np.stack([logarithm(best + step) - logarithm(best) for step in steps], 1) / STEP / noise


def _best_range(worth: NDArray, information: NDArray, open_ones: list[int], limit: NDArray):
    """First and last index of the rates, and the errors with them; None if no range is enough."""
    for decades in range(1, WIDEST + 1):
        count = PER_DECADE * decades + 1
        tried = []
        for first in range(0, len(worth) - count + 1, PER_DECADE // 2):
            rows = worth[first : first + count]
            errors = _errors(information + rows.T @ rows)
            tried.append((float(np.max((errors / limit)[open_ones])), first, errors))
        left, first, errors = min(tried, key=lambda item: item[0], default=(math.inf, 0, limit))
        if left <= 1:
            return first, first + count - 1, errors
    return None


def _errors(information: NDArray) -> NDArray:
    """Standard errors of all parameters."""
    return np.sqrt(np.diag(np.linalg.inv(information)))


def _range(quantity: str, low: float, high: float) -> str:
    """Rates in words: shear rates of 10 to 100 1/s."""
    abscissa = str(COLUMNS[quantity].abscissa)
    plural = abscissa.replace("_", " ").replace("frequency", "frequencie") + "s"
    low, high = (float(f"{rate:.2g}") for rate in (low, high))  # 320, not 3.2e+02
    return f"{plural} of {low:g} to {high:g} {COLUMNS[abscissa].unit}"


def _words(fitted: FluidFit, open_ones: list[int], errors: NDArray) -> str:
    """What the errors would be."""
    return ", ".join(
        f"{fitted.names[k]} to {errors[k]:.2g}"
        if fitted.names[k].endswith("mobility")
        else f"{fitted.names[k]} to {100 * errors[k]:.0f} %"
        for k in open_ones
    )
