r"""What spheres behind the neighbours add to the velocities of a train, extrapolated in time.

Steps of a train end whenever a sphere enters or leaves, which in a dense train happens many times
while distances hardly change. What a sphere feels of all but its neighbours,

    F_i = sum_{j > i+1} W_1 + sum_{j < i-1} W_3        (`closures`),

costs most of a step, and changes least. So F is summed anew after an interval of time only. In
between

    F(t) = F(t_0) + (t - t_0) G,

G being the rate of change: at the start by the rates of the distances; at each new sum what was
missed, dF, corrects it by `TREND` dF/(t - t_0). If the rate changes evenly, 2 of these parts are
what it has changed, but then its errors would only change their signs; with 3/2 they are halved.

A sphere that enters or leaves changes F of those within its reach at once, by the terms that it is
in; one that enters changes G, too. When F is summed anew, dF times the interval is the error of
distances: it sets the next interval.

Units: times in D/Ubar, velocities in Ubar, distances in d.
"""

import numpy as np
from numpy.typing import NDArray

from viscotrain.trains import step_length
from viscotrain.trains.closures import Closure

SHARE = 0.01  # of the error that a step may have: so much an interval may have
FIRST, LONGEST = 0.1, 5.0  # intervals in D/Ubar
MOMENT = 0.01  # D/Ubar, over which rates of change are differences
TREND = 1.5  # of what was missed, over the interval, that the rate changes by; see above


class FarField:
    """F of the spheres in a channel, trailing sphere first.

    Args:
        closure: Velocities of trains.
        confinement: d/D.
        tolerance: Of Euler's distances in one step, in d; `motion.TOLERANCE`.
        distance: Of the neighbours at the start, in d, shape (N - 1,).
    """

    def __init__(self, closure: Closure, confinement: float, tolerance: float, distance: NDArray):
        self._closure = closure
        self._allowed = SHARE * tolerance * confinement  # Ubar times D/Ubar
        self._known = closure.far(distance)
        self._rate = np.zeros(self._known.size)
        self._age, self._interval = 0.0, FIRST
        self._entered: NDArray | None = None  # what the last sphere did when it entered
        self._begins = True  # whether no rate is known

    def after(self, time: float) -> NDArray:
        """F in Ubar, shape (N,), a time after the present one."""
        return self._known + (self._age + time) * self._rate

    @property
    def followed(self) -> bool:
        """Whether all rates of F are known."""
        return not self._begins and self._entered is None

    def follow(self, distance: NDArray, change: NDArray):
        """Take how distances change, in d per D/Ubar, where rates of F are not known yet."""
        if self._begins:
            ahead = self._closure.far(distance + MOMENT * change)
            self._rate = (ahead - self._known) / MOMENT
        elif self._entered is not None:
            ahead = self._closure.by_the_first(distance + MOMENT * change)
            more = (ahead - self._entered) / MOMENT
            self._rate += more
            self._known -= self._age * more
        self._begins, self._entered = False, None

    def advance(self, time: float, distance: NDArray):
        """Go on by a time, at the end of which neighbours have these distances."""
        self._age += time
        if self._age < self._interval or not self._known.size:
            return
        found = self._closure.far(distance)
        missed = found - self.after(0.0)
        error = float(np.max(np.abs(missed))) * self._age
        self._interval = min(self._age * step_length.change(error / self._allowed), LONGEST)
        self._rate += TREND / self._age * missed
        self._known, self._age = found, 0.0

    def enter(self, distance: NDArray):
        """Take in a trailing sphere; distances are with it."""
        self._entered = self._closure.by_the_first(distance)
        self._known = self._entered + np.concatenate([[0.0], self._known])
        self._rate = np.concatenate([[0.0], self._rate])

    def leave(self, distance: NDArray):
        """Let the leading sphere go; distances are those before."""
        change = self._closure.by_the_last(distance)
        self._known, self._rate = (self._known - change)[:-1], self._rate[:-1]
