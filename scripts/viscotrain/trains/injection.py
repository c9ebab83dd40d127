r"""Injection of spheres: random intervals that give a volume fraction, without overlap.

A new sphere enters at z = 0 after random intervals, uniform in [dt_eq - dt_r, dt_eq + dt_r], with
dt_eq = V_p/(pi R^2 phi U_max) (`injection_law`). Intervals are in D/Ubar.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viscotrain.errors import TrainError
from viscotrain.words import FEWEST_TRAIN_SPHERES


@dataclass(frozen=True)
class InjectionLaw:
    """Intervals between injections in D/Ubar, uniform in mean -+ half_width."""

    mean: float
    half_width: float

    def draw(self, rng: np.random.Generator) -> float:
        """One interval."""
        return rng.uniform(self.mean - self.half_width, self.mean + self.half_width)


def injection_law(
    *, confinement: float, volume_fraction: float, centreline_velocity: float, slowest: float
) -> InjectionLaw:
    r"""The intervals that give a volume fraction, as random as they can be without overlap.

    In units of D/Ubar the mean is

        dt_eq = V_p/(pi R^2 phi U_max) = (2/3) beta^3/(phi U_max).

    The last sphere of the train must have moved by one diameter, beta D, when the next one
    enters. That takes beta/slowest with the velocity of the slowest sphere of a triplet, which is
    the shortest interval; in a train that is slower still the next sphere waits.

    Raises:
        TrainError: The mean interval is below the shortest one.
    """
    mean = 2 / 3 * confinement**3 / (volume_fraction * centreline_velocity)
    shortest = confinement / slowest
    if mean < shortest:
        largest = volume_fraction * mean / shortest
        raise TrainError(
            f"volume fraction is {volume_fraction:g}; allowed: at most {largest:.4g}, above which "
            "spheres would enter the channel before there is room for them"
        )
    return InjectionLaw(mean, mean - shortest)


def initial_positions(law: InjectionLaw, isolated: float, rng: np.random.Generator) -> NDArray:
    """Of the spheres of the start, in D: one at the inlet, the others as if they had been injected.

    Args:
        law: Of the intervals.
        isolated: Velocity of a single sphere, in Ubar.
        rng: Source of the intervals.
    """
    intervals = [law.draw(rng) for _ in range(FEWEST_TRAIN_SPHERES - 1)]
    return isolated * np.concatenate([[0.0], np.cumsum(intervals)])
