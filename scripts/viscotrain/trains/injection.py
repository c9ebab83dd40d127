r"""Injection of spheres: random intervals that give a volume fraction, without overlap.

A new sphere enters at z = 0 after random intervals, in D/Ubar, whose mean follows from the volume
fraction phi of spheres in the channel, where they flow with the velocity U_p of a single sphere:

    dt_eq = V_p/(A phi U_p) = (2/3) beta^3/(phi U_p)

in a tube, of area A = pi R^2; in a duct less by the share of its inscribed tube (`fluid.channel`).
So spheres enter at the rate 1/dt_eq, in Ubar/D. What is poured in holds fewer of the fast spheres
and more of the slow fluid; by conservation, with the flow rate Q = A Ubar, in a tube

    phi_feed = V_p/(dt_eq Q) = phi U_p/Ubar,
    s* = (2/3) beta^2/phi = (U_p/Ubar) (2/3) beta^2/phi_feed.

The original study has U_max in place of U_p: with it phi in the channel is U_max/U_p times what it
is called, 1 % (De = 5) to 3 % (De = 0) more at beta = 0.2.

**Laws.** No interval is shorter than what it takes to move by one diameter, t_0 (`injection_law`).

    uniform, the original study's:   in [t_0, 2 dt_eq - t_0],           CV = (1 - t_0/dt_eq)/sqrt(3)
    poisson, spheres mixed at random that cannot overlap (hard core):
                                     t_0 plus an exponential deviate,   CV = 1 - t_0/dt_eq
    even, behind a device that spaces them:
                                     dt_eq,                             CV = 0

A law decides how even a train is from the start on: at phi = 0.4 % and beta = 0.2, whose mean
distance is 6.7 d, the CV is 0.49 or 0.85.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viscotrain.errors import TrainError
from viscotrain.fluid.channel import ROUND, CrossSection
from viscotrain.words import FEWEST_TRAIN_SPHERES


@dataclass(frozen=True)
class InjectionLaw:
    """Random intervals between injections.

    Args:
        mean: Their mean, dt_eq, in D/Ubar.
        shortest: The shortest one, t_0 <= dt_eq.
    """

    mean: float
    shortest: float

    def draw(self, rng: np.random.Generator) -> float:
        """One interval."""
        raise NotImplementedError

    def share_below(self, interval: NDArray | float) -> NDArray:
        """Share of intervals below some, of any shape."""
        raise NotImplementedError

    @property
    def variation(self) -> float:
        """Coefficient of variation of the intervals."""
        raise NotImplementedError

    @property
    def free(self) -> float:
        """What is random of the mean, in D/Ubar."""
        return self.mean - self.shortest


class Uniform(InjectionLaw):
    """Intervals between the shortest one and as much above the mean."""

    def draw(self, rng: np.random.Generator) -> float:
        """See `InjectionLaw.draw`."""
        return rng.uniform(self.mean - self.free, self.mean + self.free)

    def share_below(self, interval: NDArray | float) -> NDArray:
        """See `InjectionLaw.share_below`."""
        since = np.asarray(interval) - self.shortest
        return np.clip(since / (2 * self.free), 0.0, 1.0) if self.free > 0 else 1.0 * (since > 0)

    @property
    def variation(self) -> float:
        """See `InjectionLaw.variation`."""
        return self.free / self.mean / math.sqrt(3)


class Poisson(InjectionLaw):
    """The shortest interval and an exponential deviate: a Poisson process of hard spheres."""

    def draw(self, rng: np.random.Generator) -> float:
        """See `InjectionLaw.draw`."""
        return self.shortest + rng.exponential(self.free)

    def share_below(self, interval: NDArray | float) -> NDArray:
        """See `InjectionLaw.share_below`."""
        since = np.maximum(np.asarray(interval) - self.shortest, 0.0)
        return -np.expm1(-since / self.free) if self.free > 0 else 1.0 * (since > 0)

    @property
    def variation(self) -> float:
        """See `InjectionLaw.variation`."""
        return self.free / self.mean


class Even(InjectionLaw):
    """All intervals equal to the mean."""

    def draw(self, rng: np.random.Generator) -> float:
        """See `InjectionLaw.draw`; draws nothing."""
        return self.mean

    def share_below(self, interval: NDArray | float) -> NDArray:
        """See `InjectionLaw.share_below`."""
        return 1.0 * (np.asarray(interval) > self.mean)

    @property
    def variation(self) -> float:
        """See `InjectionLaw.variation`."""
        return 0.0


INJECTIONS: dict[str, type[InjectionLaw]] = {"uniform": Uniform, "poisson": Poisson, "even": Even}


def injection_law(
    *,
    injection: str = "uniform",
    confinement: float,
    volume_fraction: float,
    velocity: float,
    slowest: float,
    section: CrossSection = ROUND,
) -> InjectionLaw:
    """The intervals that give a volume fraction, without overlap.

    The last sphere of the train must have moved by one diameter, beta D, when the next one
    enters. That takes beta/slowest with the velocity of the slowest sphere of a triplet, which is
    the shortest interval; in a train that is slower still the next sphere waits.

    Args:
        injection: Name of one of `INJECTIONS`.
        confinement: beta = d/D.
        volume_fraction: phi, in the channel.
        velocity: U_p, of a single sphere, in Ubar.
        slowest: Smallest velocity of spheres in triplets, in Ubar.
        section: Of the channel.

    Raises:
        TrainError: The mean interval is below the shortest one.
    """
    mean = 2 / 3 * confinement**3 / (volume_fraction * velocity) * section.inscribed_share
    shortest = confinement / slowest
    if mean < shortest:
        largest = volume_fraction * mean / shortest
        raise TrainError(
            f"volume fraction is {volume_fraction:g}, in the feed "
            f"{feed_volume_fraction(volume_fraction, velocity):.4g}; allowed: at most "
            f"{largest:.4g}, in the feed {feed_volume_fraction(largest, velocity):.4g}, above "
            "which spheres would enter the channel before there is room for them"
        )
    return INJECTIONS[injection](mean, shortest)


def feed_volume_fraction(volume_fraction: float, velocity: float) -> float:
    """phi_feed, what is poured in, from phi in the channel and U_p in Ubar."""
    return volume_fraction * velocity


def channel_volume_fraction(feed: float, velocity: float) -> float:
    """The phi in the channel from phi_feed, what is poured in, and U_p in Ubar."""
    return feed / velocity


def initial_positions(law: InjectionLaw, isolated: float, rng: np.random.Generator) -> NDArray:
    """Of the spheres of the start, in D: one at the inlet, the others as if they had been injected.

    Args:
        law: Of the intervals.
        isolated: Velocity of a single sphere, in Ubar.
        rng: Source of the intervals.
    """
    intervals = [law.draw(rng) for _ in range(FEWEST_TRAIN_SPHERES - 1)]
    return isolated * np.concatenate([[0.0], np.cumsum(intervals)])
