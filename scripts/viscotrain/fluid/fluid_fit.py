"""Fit of the fluid to measured moduli, viscosities and normal stresses: how many modes, and which.

Parameters and their uncertainties with a given number of modes: `fit_problem`. What would help
where these are not determined: `advice`.

The number of modes minimises the Bayesian information criterion (Schwarz, Ann. Stat. 6, 1978, 461)

    BIC = n ln(sum r^2/n) + p ln n,      n numbers, p fitted parameters;

normal stresses that scatter more than the rest have a sum of their own. Modes are added one by one
until it rises.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from viscotrain.errors import DataError
from viscotrain.fluid.advice import helpful
from viscotrain.fluid.fit_parameters import Known
from viscotrain.fluid.fit_problem import FitProblem, FluidFit

LARGEST_MISFIT = 0.25  # rms of r: more is another fluid, or another unit
VERY_STRONG = 10.0  # difference of BIC that rules a model out (Kass & Raftery, JASA 90, 1995, 773)


@dataclass(frozen=True)
class Result:
    """The fit that was chosen, and all that were compared, by number of modes."""

    chosen: FluidFit
    candidates: tuple[FluidFit, ...]


def fit(data: pd.DataFrame, modes: int | None = None, known: Known | None = None) -> Result:
    """Fit a fluid to measured numbers.

    Args:
        data: As from `measurements.read`.
        modes: Number of modes; None to choose it.
        known: What is not fitted.

    Raises:
        DataError: The data cannot determine a fluid, or no fluid describes them.
    """
    numbers = FitProblem(data, known or Known())
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
    if not best.largest_misfit <= LARGEST_MISFIT:
        missed = f"{100 * best.largest_misfit:.0f} %"
        raise DataError(
            f"the best fluid, with {_modes(best)}, misses the data by {missed} "
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
                *(f"  what would help: {text}" for text in helpful(best)),
                "allowed: fewer modes (fluid.fit.modes), known numbers (fluid.solvent_viscosity, "
                "fluid.fit.relaxation_times, fluid.fit.mobilities), or more data",
            ]
        )
    )


def _modes(fitted: FluidFit) -> str:
    count = len(fitted.fluid.modes)
    return f"{count} mode" + ("" if count == 1 else "s")
