r"""Motion of a train: all spheres are moved by their distances.

**Motion.** dz_i/dt = U_i, from all distances, trailing sphere first, by one of the closures in
`closures`, and from the diameters of spheres that are not equal (`sizes`). Gaps below the table's
smallest distance are lubricated over the whole chain: the two velocities at one gap come from two
different triplets, so a triplet's own limit would not stop overlap.

**State.** y = (z_1, x_1, ..., x_{N-1}): the position of the trailing sphere, and the logarithms of
the gaps, x_j = log(s_j - c_j), with c_j the distance in contact, 1 for equal spheres. A gap in
lubrication closes or opens exponentially, so its logarithm changes evenly; it may close to less
than the rounding of positions and open again, and never reaches contact. Unequal spheres that
press on each other for ever stop at `DEEPEST`.

**Time.** Heun's method; steps end at every injection and every exit. What spheres behind the
neighbours add goes on over many of them before it is summed anew (`far_field`). The length of steps
is controlled by the difference between Heun's and Euler's state, which bounds the error of the
latter. Within a step y(t) is the parabola of the method's two slopes. The times at which spheres
pass a station or the outlet are roots, in closed form, of the parabola that has a sphere's velocity
at the beginning and its positions at both ends.

Units: positions and times in D and D/Ubar, distances and snapshots in d, velocities in Ubar.
"""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from viscotrain.table.lubrication import ROUND_OFF, ChainMotion, lubricate
from viscotrain.trains import step_length
from viscotrain.trains.closures import Closure
from viscotrain.trains.far_field import FarField
from viscotrain.trains.sizes import contact
from viscotrain.words import CONTACT

TOLERANCE = 1e-4  # of Euler's distances in one step, in d; Heun's are far better
LOGARITHM_TOLERANCE = 0.02  # of its gaps, relative: 1e-3 d when a gap leaves lubrication
DEEPEST = -600.0  # logarithm of a gap, near the end of what a number can be
LONGEST_STEP = 2.0  # D/Ubar


def chain_motion(
    closure: Closure,
    gap: NDArray,
    contact: NDArray | float = CONTACT,
    drift: NDArray | float = 0.0,
    far: NDArray | None = None,
) -> ChainMotion:
    """Velocities of a train, shape (N,).

    Args:
        closure: Of equal spheres.
        gap: s - c in d, trailing first, shape (N - 1,).
        contact: Distances c at which spheres touch, in d, of this shape.
        drift: What diameters add to velocities, in Ubar, shape (N,).
        far: See `Closure.free_velocities`.
    """
    free = closure.free_velocities(contact + gap, far) + drift
    return lubricate(free, gap, closure.smallest_distance - CONTACT)


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

    def state(self, tau: float) -> NDArray:
        """The state a time `tau` after the beginning."""
        return _parabolas(self.y, self.start, self.end, self.duration, tau)

    def error(self, tolerance: float) -> float:
        """Largest error of Euler's gaps over what is allowed: above 1 the step is too long."""
        allowed = tolerance * np.exp(-self.y[1:])
        return _largest_error(self.start, self.end, self.duration, allowed)


@dataclass
class Channel:
    """What moves spheres, and how exactly.

    Args:
        closure: Velocities of trains.
        confinement: d/D.
        tolerance: Of Euler's distances in one step, in d.
        response: U' of `sizes`, in Ubar.

    Attributes:
        contact: Distances at which the spheres in it touch, in d, shape (N - 1,).
        drift: What their diameters add to velocities, in Ubar, shape (N,).
        fastest: Largest relative velocity of neighbours at the beginning of any step, in Ubar.
    """

    closure: Closure
    confinement: float
    tolerance: float = TOLERANCE
    response: float = 0.0
    contact: NDArray | float = field(default=CONTACT, init=False)
    drift: NDArray | float = field(default=0.0, init=False)
    fastest: float = field(default=0.0, init=False)

    def __post_init__(self):
        self._trial = LONGEST_STEP  # length of the next step

    def hold(self, deviation: NDArray) -> NDArray:
        """Take spheres that are not equal, and return `contact`.

        Args:
            deviation: (d_i - d)/d, trailing first, shape (N,).
        """
        self.contact = touching = contact(deviation)
        self.drift = self.response * deviation
        return touching

    def state(self, z: NDArray) -> NDArray:
        """State of a train, from its positions in D, trailing first."""
        return np.concatenate([z[:1], logarithm(np.diff(z) / self.confinement - self.contact)])

    def distances(self, y: NDArray) -> NDArray:
        """Of neighbours in d, centre to centre, trailing first."""
        return self.contact + np.exp(y[1:])

    def positions(self, y: NDArray, distance: NDArray | None = None) -> NDArray:
        """Positions of a train in D, trailing first; its distances are computed if not known."""
        distance = self.distances(y) if distance is None else distance
        return _one_after_another(y[:1], distance, self.confinement)

    def motion(self, y: NDArray, far: NDArray | None = None) -> tuple[NDArray, NDArray]:
        """Velocities of the spheres in Ubar, and dy/dt; `far` as in `Closure.free_velocities`."""
        if not y.size:
            return y, y
        gap = np.exp(np.maximum(y[1:], DEEPEST))
        U = chain_motion(self.closure, gap, self.contact, self.drift, far)
        return U.velocity, _rates(y, gap, U.velocity, U.relative, self.confinement)

    def step(self, y: NDArray, longest: float, far: FarField | None = None) -> tuple[Step, NDArray]:
        """One step within the tolerance, and velocities at its start.

        Args:
            y: State.
            longest: Duration of the step, at most.
            far: What spheres behind the neighbours add; None: sum it.
        """
        velocity, start = self.motion(y, far.after(0.0) if far else None)
        gap = np.exp(y[1:])
        self.fastest = max(self.fastest, self.confinement * _largest_product(gap, start[1:]))
        if far and not far.followed:
            far.follow(self.contact + gap, gap * start[1:])
        while True:
            duration = min(longest, self._trial)
            _, end = self.motion(y + duration * start, far.after(duration) if far else None)
            step = Step(y, start, end, duration)
            error = step.error(self.tolerance)
            factor = step_length.change(error)
            if error > 1:
                self._trial = duration * factor
                continue
            # a step cut short by an event says little about the next one
            self._trial = min(LONGEST_STEP, max(duration * factor, self._trial))
            return step, velocity


def logarithm(gap: NDArray) -> NDArray:
    """Of gaps in d, as a state has them: overlap counts as contact."""
    return np.log(np.maximum(gap, ROUND_OFF))


# Compiled, since a train has some hundreds of spheres: operations on arrays of that size take
# longer to be called than to be done. Loops are compiled more quickly than operations on arrays.


@numba.njit(cache=True, error_model="numpy")
def parabola(y, start, end, duration, tau):
    """An item of the state a time `tau` after the beginning of a `Step`."""
    bend = (end - start) / (2 * duration)
    return y + tau * (start + tau * bend)


@numba.njit(cache=True, error_model="numpy")
def arrival(way, speed, whole_way, duration):
    """Time to cover `way`, of a sphere that starts with a speed and covers a way in `duration`.

    Its positions are taken as a parabola in time; the time is from 0 to `duration`.
    """
    bend = (whole_way / duration - speed) / duration
    tau = 2 * way / (speed + math.sqrt(speed**2 + 4 * bend * way))
    return min(max(tau, 0.0), duration)


@numba.njit(cache=True, error_model="numpy")
def _parabolas(y, start, end, duration, tau):
    """The state, shape (N,), a time `tau` after the beginning of a `Step`."""
    later = np.empty_like(y)
    for i in range(y.size):
        later[i] = parabola(y[i], start[i], end[i], duration, tau)
    return later


@numba.njit(cache=True, error_model="numpy")
def _rates(y, gap, velocity, relative, confinement):
    """dy/dt, shape (N,); see `Channel.motion`."""
    rate = np.empty_like(y)
    rate[0] = velocity[0]
    for j in range(gap.size):
        rate[j + 1] = relative[j] / (confinement * gap[j])
        if y[j + 1] < DEEPEST and rate[j + 1] < 0:
            rate[j + 1] = 0.0
    return rate


@numba.njit(cache=True, error_model="numpy")
def _largest_error(start, end, duration, allowed):
    """See `Step.error`; relative errors that are allowed have an upper limit."""
    largest = 0.0
    for j in range(allowed.size):
        error = abs(end[j + 1] - start[j + 1]) * (duration / 2)
        largest = max(largest, error / min(LOGARITHM_TOLERANCE, allowed[j]))
    return largest


@numba.njit(cache=True, error_model="numpy")
def _largest_product(a, b):
    """Of the sizes of products of items; 0 of none."""
    largest = 0.0
    for i in range(a.size):
        largest = max(largest, abs(a[i] * b[i]))
    return largest


@numba.njit(cache=True, error_model="numpy")
def _one_after_another(first, distance, confinement):
    """Positions in D, of no or one sphere at `first` and those ahead of it, distances in d."""
    z = np.empty(first.size + distance.size)
    for i in range(z.size):
        z[i] = first[0] if i == 0 else z[i - 1] + confinement * distance[i - 1]
    return z
