r"""Motion of a train: each sphere is moved by its distances to its two neighbours.

**Motion.** Along the flow, sphere 1 trailing and N leading, with sp_i = (z_i - z_{i-1})/d and
sf_i = (z_{i+1} - z_i)/d,

    dz_1/dt = U_1(sp_2, sf_2),    dz_i/dt = U_2(sp_i, sf_i),    dz_N/dt = U_3(sp_{N-1}, sf_{N-1}),

where U_1, U_2, U_3 are the velocities of a triplet (`interpolation.TripletVelocities`). The two
spheres of a train of two are middle spheres with one neighbour at infinity, a single one with
both. Gaps below the table's smallest distance are lubricated over the whole chain: the two
velocities at one gap come from two different triplets, so a triplet's own limit would not stop
overlap.

**State.** y = (z_1, x_1, ..., x_{N-1}): the position of the trailing sphere, and the logarithms of
the gaps, x_j = log(s_j - 1). A gap in lubrication closes or opens exponentially, so its logarithm
changes evenly; it may close to less than the rounding of positions and open again, and never
reaches contact.

**Time.** Heun's method; steps end at every injection and every exit. Their length is controlled by
the difference between Heun's and Euler's state, which bounds the error of the latter. Within a step
y(t) is the parabola of the method's two slopes. The times at which spheres pass a station or the
outlet are roots, in closed form, of the parabola that has a sphere's velocity at the beginning and
its positions at both ends.

Units: positions and times in D and D/Ubar, distances and snapshots in d, velocities in Ubar.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from viscotrain.table.lubrication import ROUND_OFF, ChainMotion, lubricate
from viscotrain.words import CONTACT, LEADING, MIDDLE, TRAILING

TOLERANCE = 1e-4  # of Euler's distances in one step, in d; Heun's are far better
LOGARITHM_TOLERANCE = 0.02  # of its gaps, relative: 1e-3 d when a gap leaves lubrication
LONGEST_STEP = 2.0  # D/Ubar
SAFETY, SHRINK, GROW = 0.8, 0.2, 2.0  # limits of the next step's length over the last one's


class Velocities(Protocol):
    """What a train needs to know; `interpolation.TripletVelocities` is one."""

    smallest_distance: float  # where lubrication begins, in d
    slowest: float  # smallest velocity, in Ubar
    isolated: float  # velocity of a single sphere, in Ubar

    def closure(self, sp: NDArray, sf: NDArray, particle: int | NDArray) -> NDArray:
        """U of one sphere of triplets at distances of shape (n,), in Ubar."""


def chain_motion(velocities: Velocities, gap: NDArray) -> ChainMotion:
    """Velocities of a train, shape (N,), from its gaps s - 1, shape (N - 1,), trailing first."""
    s = CONTACT + gap
    if s.size < 2:  # one or two spheres, each the middle one of a triplet with missing neighbours
        none = np.array([np.inf])
        sp, sf = np.concatenate([none, s]), np.concatenate([s, none])
        particle: int | NDArray = MIDDLE
    else:
        sp = np.concatenate([s[:1], s[:-1], s[-2:-1]])
        sf = np.concatenate([s[1:2], s[1:], s[-1:]])
        particle = np.full(s.size + 1, MIDDLE)
        particle[0], particle[-1] = TRAILING, LEADING
    free = velocities.closure(sp, sf, particle)
    return lubricate(free, gap, velocities.smallest_distance - CONTACT)


class Step(NamedTuple):
    """One step of Heun's method, of `duration` > 0, and the parabolas in between.

    Attributes:
        y: State at its beginning, shape (N,).
        start: dy/dt there.
        end: dy/dt at the end of a step of Euler's method.
        duration: Length of the step in D/Ubar.
    """

    y: NDArray
    start: NDArray
    end: NDArray
    duration: float

    def state(self, tau, item=slice(None)) -> NDArray:
        """The state, or items of it, a time `tau` after the beginning."""
        bend = (self.end[item] - self.start[item]) / (2 * self.duration)
        return self.y[item] + tau * (self.start[item] + tau * bend)

    def error(self, tolerance: float) -> float:
        """Largest error of Euler's gaps over what is allowed: above 1 the step is too long."""
        logarithm = np.abs(self.end[1:] - self.start[1:]) * (self.duration / 2)
        allowed = np.minimum(LOGARITHM_TOLERANCE, tolerance * np.exp(-self.y[1:]))
        return float(np.max(logarithm / allowed, initial=0.0))


@dataclass
class Channel:
    """What moves spheres, and how exactly.

    Args:
        velocities: Of triplets.
        confinement: d/D.
        tolerance: Of Euler's distances in one step, in d.
    """

    velocities: Velocities
    confinement: float
    tolerance: float = TOLERANCE

    def __post_init__(self):
        self._trial = LONGEST_STEP  # length of the next step

    def state(self, z: NDArray) -> NDArray:
        """State of a train, from its positions in D, trailing first."""
        gap = np.diff(z) / self.confinement - CONTACT
        return np.concatenate([z[:1], np.log(np.maximum(gap, ROUND_OFF))])

    def positions(self, y: NDArray) -> NDArray:
        """Positions of a train in D, trailing first."""
        distances = self.confinement * (CONTACT + np.exp(y[1:]))
        return np.concatenate([y[:1], distances]).cumsum()

    def motion(self, y: NDArray) -> tuple[NDArray, NDArray]:
        """Velocities of the spheres in Ubar, and dy/dt."""
        if not y.size:
            return y, y
        gap = np.exp(y[1:])
        U = chain_motion(self.velocities, gap)
        return U.velocity, np.concatenate([U.velocity[:1], U.relative / (self.confinement * gap)])

    def step(self, y: NDArray, longest: float) -> tuple[Step, NDArray]:
        """One step within the tolerance, not longer than `longest`, and velocities at its start."""
        velocity, start = self.motion(y)
        while True:
            duration = min(longest, self._trial)
            _, end = self.motion(y + duration * start)
            step = Step(y, start, end, duration)
            error = step.error(self.tolerance)
            factor = min(max(SAFETY / math.sqrt(error), SHRINK), GROW) if error > 0 else GROW
            if error > 1:
                self._trial = duration * factor
                continue
            # a step cut short by an event says little about the next one
            self._trial = min(LONGEST_STEP, max(duration * factor, self._trial))
            return step, velocity


def arrival(way: NDArray, speed: NDArray, whole_way: NDArray, duration: float) -> NDArray:
    """Time to cover `way`, of spheres that start with a speed and cover another way in `duration`.

    Their positions are taken as parabolas in time; the time is from 0 to `duration`.
    """
    bend = (whole_way / duration - speed) / duration
    tau = 2 * way / (speed + np.sqrt(speed**2 + 4 * bend * way))
    return np.minimum(np.maximum(tau, 0.0), duration)
