r"""Relative velocities of pairs at several confinements: one curve, scaled by a power of beta.

Dilute spheres of one channel and different diameters are said to have relative velocities U, in
Ubar, that fall on one curve,

    U(xi, beta) = beta^n f(xi),    xi = (s - 1) beta,    n = 4,

with beta = d/D, s the distance from centre to centre in d and xi that of the surfaces in D
(Jeyasountharan, D'Avino and Del Giudice, Phys. Fluids 34, 042015, 2022). Here n is fitted, at each
xi by itself, as the slope of the regression of log |U| on log beta,

    n = cov(log beta, log |U|)/var(log beta),

with the standard error of the scatter about the straight line, times Student's t of two degrees of
freedom less than there are diameters, or that of the errors of U, times the normal quantile,
whichever is larger: 95 %. Two diameters have no scatter.

**Range of validity.** That of neighbouring xi over which velocities collapse with n = 4: all
|U| beta^-4 differ from their geometric mean at the same xi by less than `AGREEMENT`. The longest in
log xi counts. A xi where U changes its sign, or is not `SIGNIFICANT` times its error for each
diameter, has no n and ends a range.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import norm
from scipy.stats import t as student

EXPECTED = 4.0
AGREEMENT = 0.2  # of a scaled velocity with the mean of all diameters: 20 %
SIGNIFICANT = 5.0  # times its error, at least, is a velocity whose logarithm is fitted
CONFIDENCE = 0.95


class Power(NamedTuple):
    """A fitted exponent.

    Attributes:
        exponent: n, of any shape; NaN where there is none.
        halfwidth: Of its interval of 95 % confidence.
    """

    exponent: NDArray
    halfwidth: NDArray


class Collapse(NamedTuple):
    """The range in which velocities scaled with beta^4 lie on one curve.

    Attributes:
        power: Fitted to all of it together, numbers; NaN where there is no range.
        nearest, farthest: xi at its ends, in D.
        inside: Whether a distance is in it, shape (n,).
    """

    power: Power
    nearest: float
    farthest: float
    inside: NDArray


def exponent(confinement: ArrayLike, velocity: ArrayLike, error: ArrayLike) -> Power:
    """The power n at each distance.

    Args:
        confinement: beta, shape (diameter,), at least two.
        velocity: U in Ubar, shape (diameter, ...).
        error: Of it, standard, of the same shape or one that broadcasts.
    """
    U = np.asarray(velocity, dtype=float)
    error = np.broadcast_to(np.asarray(error, dtype=float), U.shape)
    usable = (np.abs(U) >= SIGNIFICANT * error).all(axis=0) & (U != 0).all(axis=0)
    usable &= np.abs(np.sign(U).sum(axis=0)) == len(U)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = _slope(confinement, np.log(np.abs(U)), error / np.abs(U))
    return Power(*(np.where(usable, value, np.nan) for value in found))


def _slope(confinement: ArrayLike, y: NDArray, error: NDArray) -> Power:
    """Slope of y over log beta, shapes (diameter, ...), and the halfwidth of it."""
    x = np.log(np.asarray(confinement, dtype=float))
    x = (x - x.mean()).reshape(-1, *[1] * (y.ndim - 1))
    variance = (x**2).sum()
    n = (x * y).sum(axis=0) / variance
    of_errors = np.sqrt((x**2 * error**2).sum(axis=0)) / variance
    halfwidth = norm.ppf((1 + CONFIDENCE) / 2) * of_errors
    if free := len(y) - 2:
        rest = y - y.mean(axis=0) - n * x
        of_scatter = np.sqrt((rest**2).sum(axis=0) / free / variance)
        halfwidth = np.maximum(halfwidth, student.ppf((1 + CONFIDENCE) / 2, free) * of_scatter)
    return Power(n, halfwidth)


def collapse(
    confinement: ArrayLike, distance: ArrayLike, velocity: ArrayLike, error: ArrayLike
) -> Collapse:
    """The longest range of distances in which velocities go with beta^4, and the power in it.

    Args:
        confinement: beta, shape (diameter,).
        distance: xi in D, ascending, shape (n,).
        velocity: U in Ubar, shape (diameter, n).
        error: Of it, of the same shape or one that broadcasts.
    """
    xi, beta = np.asarray(distance, dtype=float), np.asarray(confinement, dtype=float)
    U = np.abs(np.asarray(velocity, dtype=float))
    with np.errstate(divide="ignore", invalid="ignore"):
        y = np.log(U)
        scaled = y - EXPECTED * np.log(beta)[:, None]
        agree = np.abs(scaled - scaled.mean(axis=0)).max(axis=0) <= np.log1p(AGREEMENT)
    agree &= np.isfinite(exponent(beta, velocity, error).exponent)
    if not agree.any():
        none = np.array(np.nan)
        return Collapse(Power(none, none), np.nan, np.nan, agree)
    best = max(_runs(agree), key=lambda run: xi[run[-1]] / xi[run[0]])
    inside = np.isin(np.arange(xi.size), best)
    share = np.broadcast_to(np.asarray(error, dtype=float), U.shape)[:, inside] / U[:, inside]
    # errors of one diameter at different distances may be the same, so they are not averaged down
    power = _slope(beta, y[:, inside].mean(axis=1), np.sqrt((share**2).mean(axis=1)))
    return Collapse(power, float(xi[best[0]]), float(xi[best[-1]]), inside)


def _runs(mask: NDArray) -> list[NDArray]:
    """Indices of neighbours that are true, a group for each run."""
    where = np.flatnonzero(mask)
    return [run for run in np.split(where, np.flatnonzero(np.diff(where) > 1) + 1) if run.size]
