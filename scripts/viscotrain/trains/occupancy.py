r"""Occupancy: how many beads are in each droplet, from the times at which beads pass a station.

Droplets are cut from the stream at equal periods T = 1/F, and a bead, one of the spheres, is in the
droplet that forms while it passes. Nothing ties the two clocks together, so all phases between them
are as frequent. With passages at the times t_j, gaps g_j = t_{j+1} - t_j, and x+ = max(x, 0), a
droplet that begins at a random time between the first passage and the last but one holds

    no bead with        P(0)        = sum_j (g_j - T)+ / sum_j g_j,
    one or none with    P(0) + P(1) = sum_j [(g_j + g_{j+1} - T)+ - (g_{j+1} - T)+] / sum_j g_j,
    two or more with    P(2+)       = 1 - P(0) - P(1):

the next bead, or the next but one, comes after its end. This is the exact mean over all phases of
what counting gives.

**Limits.** An even train at F equal to the rate of beads has P(1) = 1. Beads at random times, m in
a droplet on average, have P(n) = exp(-m) m^n/n! (Poisson), so P(1) is at most 1/e = 36.8 %.

**Best frequency**: the one with the largest P(1), of `FREQUENCY_RATIO` times the rate of beads.
**Tolerance**: the range around it in which P(1) stays within `TOLERANCE` of its best.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import stdtrit

from viscotrain.trains.distribution import CONFIDENCE, RESAMPLED
from viscotrain.trains.statistics import confidence

STEP = 0.01  # between frequencies that are tried, relative
FREQUENCY_RATIO = (1 + STEP) ** np.arange(-140, 141)  # 1/4 to 4, and 1
TOLERANCE = 0.05  # of the best P(1)
FEWEST_PASSAGES = 3  # that something can be counted of
EDGES = ("best", "lowest", "highest")  # frequencies
RANDOM_BEST = math.exp(-1)  # the largest P(1) of beads at random times


def occupancy(time: NDArray, period: ArrayLike) -> NDArray:
    """Shares of droplets with no, one, and two or more beads, mean over all phases.

    Args:
        time: Of successive passages, ascending, shape (passage,).
        period: T of the droplets in the same unit, shape (...).

    Returns:
        P(0), P(1), P(2+), shape (3, ...); NaN where the period is, or of too few passages.
    """
    T = np.asarray(period, dtype=float)
    if time.size < FEWEST_PASSAGES:
        return np.full((3, *T.shape), np.nan)
    first, second = np.diff(time)[:-1], np.diff(time)[1:]

    def excess(gaps: NDArray) -> NDArray:
        return np.maximum(gaps - T[..., None], 0.0).sum(axis=-1)

    total = first.sum()
    none = excess(first) / total
    at_most_one = (excess(first + second) - excess(second)) / total
    return np.stack([none, at_most_one - none, 1 - at_most_one])


def poisson(mean: ArrayLike) -> NDArray:
    """The same of beads at random times, by their mean number in a droplet: shape (3, ...)."""
    m = np.asarray(mean, dtype=float)
    return np.stack([np.exp(-m), m * np.exp(-m), 1 - (1 + m) * np.exp(-m)])


def edges(single: NDArray) -> NDArray:
    """Best, lowest and highest frequency, over the rate of beads, of P(1) at `FREQUENCY_RATIO`.

    Args:
        single: P(1), shape (frequency_ratio,).

    Returns:
        Shape (3,), see `EDGES`; NaN where P(1) stays good up to the end, or is not known.
    """
    if not np.isfinite(single).all():
        return np.full(len(EDGES), np.nan)
    best = int(single.argmax())
    level = (1 - TOLERANCE) * single[best]
    low = _crossing(single[best::-1], FREQUENCY_RATIO[best::-1], level)
    high = _crossing(single[best:], FREQUENCY_RATIO[best:], level)
    return np.array([FREQUENCY_RATIO[best], low, high])


def _crossing(values: NDArray, where: NDArray, level: float) -> float:
    """Where values, the first above a level, fall below it, on straight lines; NaN: nowhere."""
    below = np.flatnonzero(values < level)
    if not below.size:
        return math.nan
    n = below[0]
    share = (values[n - 1] - level) / (values[n - 1] - values[n])
    return float(where[n - 1] + share * (where[n] - where[n - 1]))


def edges_halfwidth(single: NDArray) -> NDArray:
    """Half the width of the 95 % confidence interval of `edges`, at least half a step.

    Student's t times the scatter if repeats are drawn again, with replacement, which is less by
    (n - 1)/n in its variance than that of the mean of n repeats.

    Args:
        single: P(1) of each repeat, shape (repeat, frequency_ratio).

    Returns:
        Shape (3,); NaN for a single repeat.
    """
    n = len(single)
    if n < 2:
        return np.full(len(EDGES), np.nan)
    rng = np.random.default_rng(0)  # the same trains have the same error
    drawn = rng.multinomial(n, np.full(n, 1 / n), size=RESAMPLED) / n
    found = np.array([edges(mean) for mean in drawn @ single])
    scatter = found.std(axis=0, ddof=1) * math.sqrt(n / (n - 1))
    quantile = stdtrit(n - 1, (1 + CONFIDENCE) / 2)
    return np.maximum(quantile * scatter, STEP / 2 * edges(single.mean(axis=0)))


def of_passages(time: NDArray, rate: float, asked: float | None) -> dict[str, NDArray | float]:
    """All that is found at one station, each with its `_halfwidth` of 95 % confidence.

    Args:
        time: Of passages in D/Ubar, shape (repeat, passage).
        rate: Of the beads that enter, in Ubar/D.
        asked: Droplet frequency over this rate, NaN if it is not known; None for the best one.

    Returns:
        Occupancy over (count, frequency_ratio); best frequency with its P(1) and its tolerance;
        occupancy (count), that of Poisson and the mean count at the frequency asked for, or best.
    """
    shares = np.array([occupancy(t, 1 / (FREQUENCY_RATIO * rate)) for t in time])
    single = shares[:, 1]
    frequency, errors = edges(single.mean(axis=0)), edges_halfwidth(single)
    ratio = frequency[0] if asked is None else asked
    gaps = np.diff(time)[:, :-1]  # in which the droplets of `occupancy` begin
    with np.errstate(invalid="ignore"):
        passing = gaps.shape[-1] / gaps.sum(axis=-1)
    mean = float(passing.mean() / (ratio * rate))
    with_errors = {
        "occupancy_curve": confidence(shares),
        "best_single": confidence(single[:, single.mean(axis=0).argmax()]),
        "occupancy": confidence(np.array([occupancy(t, 1 / (ratio * rate)) for t in time])),
    }
    pairs = zip(EDGES, frequency, errors, strict=True)
    with_errors |= {f"{name}_frequency_ratio": (value, error) for name, value, error in pairs}
    values: dict[str, NDArray | float] = {"droplet_frequency_ratio": ratio, "mean_count": mean}
    values["poisson_occupancy"] = poisson(mean)
    for name, (value, error) in with_errors.items():
        values |= {name: value, f"{name}_halfwidth": error}
    return values
