r"""Closures: velocities of all spheres of a train, from those of triplets.

Along the flow z_1 < ... < z_N are the positions in d, U_1, U_2 and U_3 the velocities of trailing,
middle and leading sphere of a triplet at its two distances (`interpolation.TripletVelocities`).

**Every sphere.** From the seat of sphere i, with missing neighbours at infinity,

    U_i = U_2(z_i - z_{i-1}, z_{i+1} - z_i)
          + sum_{j > i+1} W_1(z_{j-1} - z_i, z_j - z_{j-1})
          + sum_{j < i-1} W_3(z_i - z_{j+1}, z_{j+1} - z_j),

    W_1(a, b) = U_1(a, b) - U_1(a, inf),    W_3(a, b) = U_3(b, a) - U_3(inf, a).

Each farther sphere acts as in the triplet of sphere i, the sphere just inside it at a distance a,
and itself at b from that one. As the pair has one flow, U_1(s, inf) = U_2(inf, s), a train of three
is the triplet, and the ends of a train need no equation of their own.

**Increments.** W_1 and W_3 are tabulated, as bicubic splines on an even grid in 1/a and 1/b. The
sum ends where sphere and inner sphere are `reach` apart: from there on |W_1| and |W_3| are below
`NEGLIGIBLE_TERM`, whatever b is. It is looked for on distances 1 % apart, up to `FARTHEST`, and
differs between Deborah numbers: some 20 d at De = 1 and 30 d at De = 5 for d/D = 0.2.

**Nearest.** The original study's closure: two neighbours each, one for the spheres at the ends,

    U_1(z_2 - z_1, z_3 - z_2),    U_2(z_i - z_{i-1}, z_{i+1} - z_i),    U_3(., z_N - z_{N-1}).

**One term poorer.** Both closures end with what three spheres do together. What four do, the error
of every sphere, is of the size of what the last term adds, or smaller. So `POORER` has the same
closures with pairs in the place of that term, from which the error of a train is estimated
(`model_error`): with every sphere, farther ones act as if the spheres in between were not there,

    W_1(a, b) = U_1(a + b, inf) - U_p,    W_3(a, b) = U_3(inf, a + b) - U_p;

with the nearest, the two neighbours do,

    U_i = U_2(z_i - z_{i-1}, inf) + U_2(inf, z_{i+1} - z_i) - U_p.

For six equally spaced spheres with gaps of 1 d and 2 d the former differs from every sphere by 4e-5
and 1e-5 Ubar at De = 5, 7e-5 and 8e-6 at De = 1, and every sphere from a simulation of all six by
2e-5 and 3e-6, 8e-6 and 2e-6. To end the sum one sphere earlier would tell nothing: it ends where
its terms are negligible.

**Memory.** The stress around spheres that leave each other is that of smaller distances, and drives
them on (`table.memory`). To first order in the memory number M of a pair,

    dU = dU_held (1 + c M),    M = De |dU_held|/beta,

half of it for either sphere. In a train each gap so adds to the two spheres at its ends, and to no
others; c is fitted to direct simulations (`studies.whole_channel`).

The two spheres of a train of two are middle spheres with one neighbour at infinity, a single one
with both: for both closures alike.
"""

from collections.abc import Callable
from typing import Protocol

import numba
import numpy as np
from numpy.typing import NDArray

from viscotrain.words import LEADING, MIDDLE, TRAILING

NEGLIGIBLE_TERM = 1e-8  # Ubar
FARTHEST = 100.0  # d: velocities fall by e in 2 to 3 d at d/D = 0.2; a tail in 1/s is the table's
SEARCH = 1.01  # ratio of successive distances
NONE = np.array([np.inf])  # the distance to a neighbour that is not there
FUSED = {"contract"}  # products may be added before they are rounded, which takes less time
CELLS = 256  # of the splines, on each axis: errors below 1e-9 Ubar with nodes from 1.05 d on


class Velocities(Protocol):
    """What a closure needs to know of triplets; `interpolation.TripletVelocities` is one."""

    smallest_distance: float  # where lubrication begins, in d
    slowest: float  # smallest velocity, in Ubar
    isolated: float  # velocity of a single sphere, U_p, in Ubar
    decay: float  # length in d over which what pairs do decays by e, beyond their last distance

    def closure(self, sp: NDArray, sf: NDArray, particle: int | NDArray) -> NDArray:
        """U of one sphere of triplets at distances of shape (n,), in Ubar."""


class Closure:
    """Velocities of a train without lubrication.

    Args:
        velocities: Of triplets.

    Attributes:
        reach: Distance in d from which on spheres behind a neighbour are not felt.
    """

    reach = 0.0

    def __init__(self, velocities: Velocities):
        self.triplets = velocities
        self.smallest_distance = velocities.smallest_distance
        self.slowest = velocities.slowest
        self.isolated = velocities.isolated

    def free_velocities(self, distance: NDArray, far: NDArray | None = None) -> NDArray:
        """U in Ubar, shape (N,).

        Args:
            distance: Of neighbours in d, shape (N - 1,).
            far: Result of `far` at these or about these distances; None: sum it.
        """
        raise NotImplementedError

    def far(self, distance: NDArray) -> NDArray:
        """What spheres behind the neighbours add to U, in Ubar, shape (N,)."""
        return np.zeros(distance.size + 1)

    def by_the_first(self, distance: NDArray) -> NDArray:
        """What the trailing sphere changes in `far` by being there, itself too, shape (N,)."""
        return np.zeros(distance.size + 1)

    def by_the_last(self, distance: NDArray) -> NDArray:
        """What the leading sphere changes in `far` by being there, itself too, shape (N,)."""
        return np.zeros(distance.size + 1)

    def _middle(self, distance: NDArray) -> NDArray:
        """Each sphere as the middle one of its triplet; neighbours that miss are at infinity."""
        s = np.concatenate([NONE, distance, NONE])
        return self.triplets.closure(s[:-1], s[1:], MIDDLE)


class Nearest(Closure):
    """Each sphere feels its two neighbours, as in the original study."""

    def free_velocities(self, distance: NDArray, far: NDArray | None = None) -> NDArray:
        """See `Closure.free_velocities`."""
        s = distance
        if s.size < 2:
            return self._middle(s)
        sp = np.concatenate([s[:1], s[:-1], s[-2:-1]])
        sf = np.concatenate([s[1:2], s[1:], s[-1:]])
        particle = np.full(s.size + 1, MIDDLE)
        particle[0], particle[-1] = TRAILING, LEADING
        return self.triplets.closure(sp, sf, particle)


class EverySphere(Closure):
    """Each sphere feels all spheres that matter.

    Attributes:
        reach: Distance to the inner sphere of a triplet, in d, at which the sum ends.
    """

    def __init__(self, velocities: Velocities):
        super().__init__(velocities)
        x = np.linspace(0.0, 1.0 / self.smallest_distance, CELLS + 1)
        with np.errstate(divide="ignore"):
            s = 1.0 / x
        self._trailing, self._leading = map(_coefficients, self.increments(velocities, s, s))
        self._cells_times_distance = CELLS * self.smallest_distance
        self.reach = reach(velocities, s, self.increments)

    @staticmethod
    def increments(velocities: Velocities, a: NDArray, b: NDArray) -> tuple[NDArray, NDArray]:
        """W_1(a, b) and W_3(a, b) in Ubar, each of shape (a, b), from distances in d."""
        return increments(velocities, a, b)

    def free_velocities(self, distance: NDArray, far: NDArray | None = None) -> NDArray:
        """See `Closure.free_velocities`."""
        return self._middle(distance) + (self.far(distance) if far is None else far)

    def far(self, distance: NDArray) -> NDArray:
        """See `Closure.far`."""
        added = np.zeros(distance.size + 1)
        if distance.size > 1:
            splines = self._trailing, self._leading
            _add_increments(added, distance, self.reach, self._cells_times_distance, *splines)
        return added

    def by_the_first(self, distance: NDArray) -> NDArray:
        """See `Closure.by_the_first`."""
        ends = self.reach, self._cells_times_distance
        return _by_the_first(distance, *ends, self._trailing, self._leading)

    def by_the_last(self, distance: NDArray) -> NDArray:
        """See `Closure.by_the_last`."""
        ends = self.reach, self._cells_times_distance
        backwards = np.ascontiguousarray(distance[::-1])
        return _by_the_first(backwards, *ends, self._leading, self._trailing)[::-1]


class FartherAsPairs(EverySphere):
    """Each sphere feels all that matter, those behind its neighbours as if they were alone."""

    @staticmethod
    def increments(velocities: Velocities, a: NDArray, b: NDArray) -> tuple[NDArray, NDArray]:
        """See `EverySphere.increments`."""
        s = np.add.outer(a, b).ravel()
        none, shape = np.full(s.size, np.inf), (a.size, b.size)
        trailing = velocities.closure(s, none, TRAILING) - velocities.isolated
        leading = velocities.closure(none, s, LEADING) - velocities.isolated
        return trailing.reshape(shape), leading.reshape(shape)


class NeighboursAsPairs(Closure):
    """Each sphere feels its two neighbours, each as if it were alone."""

    def free_velocities(self, distance: NDArray, far: NDArray | None = None) -> NDArray:
        """See `Closure.free_velocities`."""
        none = np.full(distance.size, np.inf)
        U = np.full(distance.size + 1, self.isolated)
        U[1:] += self.triplets.closure(distance, none, MIDDLE) - self.isolated
        U[:-1] += self.triplets.closure(none, distance, MIDDLE) - self.isolated
        return U


class WithMemory(Closure):
    """Another closure, and what the gaps have been.

    Args:
        held: Velocities of trains whose gaps are held.
        strength: c De/beta, in 1/Ubar.
    """

    def __init__(self, held: Closure, strength: float):
        super().__init__(held.triplets)
        self._held, self._strength, self.reach = held, strength, held.reach

    def free_velocities(self, distance: NDArray, far: NDArray | None = None) -> NDArray:
        """See `Closure.free_velocities`."""
        free = self._held.free_velocities(distance, far)
        relative = np.diff(free)
        free[1:] += self._strength / 2 * relative * np.abs(relative)
        free[:-1] -= self._strength / 2 * relative * np.abs(relative)
        return free

    def far(self, distance: NDArray) -> NDArray:
        """See `Closure.far`."""
        return self._held.far(distance)

    def by_the_first(self, distance: NDArray) -> NDArray:
        """See `Closure.by_the_first`."""
        return self._held.by_the_first(distance)

    def by_the_last(self, distance: NDArray) -> NDArray:
        """See `Closure.by_the_last`."""
        return self._held.by_the_last(distance)


CLOSURES: dict[str, type[Closure]] = {"every_sphere": EverySphere, "nearest": Nearest}
POORER: dict[str, type[Closure]] = {"every_sphere": FartherAsPairs, "nearest": NeighboursAsPairs}
Increments = Callable[[Velocities, NDArray, NDArray], tuple[NDArray, NDArray]]


def make_closure(name: str, velocities: Velocities, strength: float = 0.0) -> Closure:
    """The closure of this name, out of `CLOSURES`, with a memory of this strength if any."""
    return with_memory(CLOSURES[name](velocities), strength)


def with_memory(held: Closure, strength: float) -> Closure:
    """A closure, with a memory of this strength if any."""
    return WithMemory(held, strength) if strength > 0 else held


def increments(velocities: Velocities, a: NDArray, b: NDArray) -> tuple[NDArray, NDArray]:
    """W_1(a, b) and W_3(a, b) in Ubar, each of shape (a, b), from distances in d."""
    inner, outer = a.repeat(b.size), np.tile(b, a.size)
    none = np.full(inner.size, np.inf)
    trailing = velocities.closure(inner, outer, TRAILING)
    trailing -= velocities.closure(inner, none, TRAILING)
    leading = velocities.closure(outer, inner, LEADING)
    leading -= velocities.closure(none, inner, LEADING)
    return trailing.reshape(a.size, b.size), leading.reshape(a.size, b.size)


def reach(velocities: Velocities, b: NDArray, of: Increments = increments) -> float:
    """Distance a in d from which on increments are negligible at all b, at most `FARTHEST`."""
    nearest = velocities.smallest_distance
    steps = np.ceil(np.log(FARTHEST / nearest) / np.log(SEARCH))
    a = np.geomspace(nearest, FARTHEST, int(steps) + 1)
    largest = np.max(np.abs(of(velocities, a, b)), axis=(0, 2))
    felt = (largest >= NEGLIGIBLE_TERM).nonzero()[0]
    return float(a[min(felt[-1] + 1, a.size - 1)]) if felt.size else nearest


def _coefficients(values: NDArray) -> NDArray:
    """Coefficients in cubic B-splines of the spline through values on an even grid.

    At both ends of each axis it is not-a-knot: the fourth differences of coefficients vanish.

    Args:
        values: Shape (n, n).

    Returns:
        Shape (n + 2, n + 2).
    """
    n = values.shape[0]
    matrix = np.zeros((n + 2, n + 2))
    for row in range(n):
        matrix[row + 1, row : row + 3] = 1 / 6, 4 / 6, 1 / 6
    matrix[0, :5] = matrix[-1, -5:] = 1, -4, 6, -4, 1
    rows = np.linalg.solve(matrix, np.pad(values, 1))
    return np.ascontiguousarray(np.linalg.solve(matrix, rows.T).T)


@numba.njit(cache=True, error_model="numpy", fastmath=FUSED)
def _add_increments(U, distance, reach, cells_times_distance, trailing, leading):
    """Add to U, shape (N,), what spheres behind the neighbours do; see `EverySphere`."""
    cells, last = trailing.shape[0] - 3, distance.size
    outer, across = np.empty(last, np.int64), np.empty((last, 4))
    for n in range(last):
        outer[n], basis = _cell(cells_times_distance / distance[n], cells)
        for m in range(4):
            across[n, m] = basis[m]
    for p in range(last):
        a, added = 0.0, 0.0
        for q in range(p + 1, last + 1):  # p and q feel the spheres behind each other
            a += distance[q - 1]
            if a >= reach:
                break
            inner, along = _cell(cells_times_distance / a, cells)
            if q < last:
                added += _spline(trailing, inner, along, outer[q], across[q])
            if p > 0:
                U[q] += _spline(leading, inner, along, outer[p - 1], across[p - 1])
        U[p] += added


@numba.njit(cache=True, error_model="numpy", fastmath=FUSED)
def _by_the_first(distance, reach, cells_times_distance, own, others):
    """The terms of `_add_increments` that the first sphere is in, shape (N,).

    It feels spheres by the spline `own`; by `others` it is felt, across the one next to it.
    """
    cells, last = own.shape[0] - 3, distance.size
    added, a = np.zeros(last + 1), 0.0
    for q in range(1, last):
        a += distance[q - 1]
        if a >= reach:
            break
        inner, along = _cell(cells_times_distance / a, cells)
        outer, across = _cell(cells_times_distance / distance[q], cells)
        added[0] += _spline(own, inner, along, outer, across)
    a = 0.0
    for q in range(2, last + 1):
        a += distance[q - 1]
        if a >= reach:
            break
        inner, along = _cell(cells_times_distance / a, cells)
        outer, across = _cell(cells_times_distance / distance[0], cells)
        added[q] += _spline(others, inner, along, outer, across)
    return added


@numba.njit(cache=True, error_model="numpy", fastmath=FUSED)
def _cell(x, cells):
    """Cell that holds x, in widths of cells, and the four B-splines that are not 0 at x."""
    cell = int(min(x, cells - 1.0))
    t = min(x, float(cells)) - cell
    u = 1.0 - t
    basis = u**3 / 6, 2 / 3 - t**2 * (1 - t / 2), 2 / 3 - u**2 * (1 - u / 2), t**3 / 6
    return cell, basis


@numba.njit(cache=True, error_model="numpy", fastmath=FUSED)
def _spline(coefficients, i, along, j, across):
    """Value of a bicubic spline in a cell, (i, j), by the B-splines of `_cell` on each axis."""
    (a0, a1, a2, a3), c = along, coefficients
    value = 0.0
    for m in range(4):
        column = j + m
        row = a0 * c[i, column] + a1 * c[i + 1, column]
        row += a2 * c[i + 2, column] + a3 * c[i + 3, column]
        value += row * across[m]
    return value
