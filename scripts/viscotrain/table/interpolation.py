r"""Velocities of three spheres at any two distances, from a table of them.

The velocities U_1, U_2, U_3 (trailing, middle, leading sphere) are known at nodes of the distances
sp = (z_2 - z_1)/d and sf = (z_3 - z_2)/d, and those of two spheres alone at more distances s.

**Pairs, and what a third sphere adds.** With the velocity U of a single sphere and what a pair
adds to it, a(s) for its trailing and b(s) for its leading sphere,

    U_1 = U + a(sp) + a(sp + sf) + T_1(sp, sf)
    U_2 = U + b(sp) + a(sf)      + T_2(sp, sf)
    U_3 = U + b(sf) + b(sp + sf) + T_3(sp, sf).

T, by which a third sphere changes what two do to each other, vanishes where either distance is
infinite. It is much smaller than a and b unless all three are close, so that few nodes are enough
for it, while pairs, which have one distance only, are resolved finely.

**Splines.** a and b are cubic splines in x = 1/s, flat at infinity and not-a-knot at the other end,
T is a tensor product of them. x maps contact...infinity onto 1...0. Against pairs solved at 26
distances (De 0.5 to 12), 1/s and its like were as good as maps with an exponential tail, which need
a length of decay that changes with De.

**Far away** all of them decay exponentially: beyond its last node s_L each one goes on as
exp(-(s - s_L)/l), as knots at `BEYOND` lengths of decay further on. l is that of |a| + |b|, from
the last two distances at which it is not an error of the simulation (`decay_length`).

**Contact.** The table ends at a smallest distance s_min > 1. Closer spheres feel the resistance of
their gaps (`lubrication`), so they never overlap. There is no other extrapolation.

This module needs no NGSolve.
"""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple, Self

import numba
import numpy as np
import xarray as xr
import yaml
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from viscotrain.errors import TableError
from viscotrain.files import read_dataset
from viscotrain.table.lubrication import ROUND_OFF, lubricate
from viscotrain.table.points import holes
from viscotrain.words import CONTACT, LEADING, MIDDLE, OF_A_PAIR, PARTICLES, TRAILING

SAME_DEBORAH = 1e-9  # relative difference of two Deborah numbers that are one
MOST_NAMED = 8  # holes that a message names
# Knots of a tail, in lengths of decay: so dense that a spline through them does not swing.
BEYOND = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 15.0, 20.0)
NOISE = 1e-5  # Ubar: that may be an error of the simulation
LONGEST_DECAY = 1.0  # length of decay over the last distance: longer ones are not resolved by it


def coordinate(distance: ArrayLike) -> NDArray:
    """The coordinate of interpolation, 1/s: 1 at contact, exactly 0 at infinity."""
    return 1.0 / np.asarray(distance, dtype=float)


class Pairs(NamedTuple):
    """Velocities of two spheres alone.

    Attributes:
        distance: Centre to centre in d, finite, ascending, shape (n,).
        velocity: U of the trailing and of the leading sphere in Ubar, shape (n, 2).
    """

    distance: NDArray
    velocity: NDArray


class TripletVelocities:
    """Velocities of a triplet as a function of its two distances, at one Deborah number.

    Args:
        sp: Distances of the middle sphere to the trailing one at the nodes, in d: above contact,
            ascending, the last one infinite.
        sf: The same of the leading sphere to the middle one.
        velocity: U at the nodes in Ubar, shape (sp, sf, 3), particles in the order `PARTICLES`.
        pairs: Two spheres alone, at the finite nodes and between them; None for those of `velocity`
            where one of the distances is infinite.

    Raises:
        TableError: Nodes that are not as above, or velocities that are not finite.
    """

    def __init__(
        self, sp: ArrayLike, sf: ArrayLike, velocity: ArrayLike, pairs: Pairs | None = None
    ):
        sp, sf, velocity = (np.asarray(item, dtype=float) for item in (sp, sf, velocity))
        _check_nodes("sp", sp)
        _check_nodes("sf", sf)
        if velocity.shape != (sp.size, sf.size, len(PARTICLES)):
            raise TableError(
                f"velocities have the shape {velocity.shape}; "
                f"allowed: ({sp.size}, {sf.size}, {len(PARTICLES)}), for sp, sf and the particles"
            )
        pairs = edges(sp, sf, velocity) if pairs is None else pairs
        if not (np.isfinite(velocity).all() and np.isfinite(pairs.velocity).all()):
            raise TableError("velocities are not finite at every node; allowed: no holes")
        self.smallest_distance = float(max(sp[0], sf[0]))
        self.isolated = float(velocity[-1, -1, MIDDLE])
        self.slowest = float(min(velocity.min(), pairs.velocity.min()))
        alone = _Pair(pairs, self.isolated)
        self.decay = alone.decay
        third = velocity[:-1, :-1] - alone.superposed(sp[:-1], sf[:-1])
        self._x_p = np.union1d(alone.x, _knots(sp[:-1], alone.decay))
        self._x_f = np.union1d(alone.x, _knots(sf[:-1], alone.decay))
        self._cells = _polynomials(self._x_p, self._x_f, alone, (sp[:-1], sf[:-1], third))
        self._alike = np.array_equal(self._x_p, self._x_f)
        self._x_far, self._far = alone.x, alone.outer_cells()

    def __call__(self, sp: ArrayLike, sf: ArrayLike) -> NDArray:
        """U of the three spheres in Ubar, shape (..., 3), at distances that broadcast to (...).

        Raises:
            TableError: A distance is NaN or below contact.
        """
        sp, sf = np.broadcast_arrays(np.asarray(sp, dtype=float), np.asarray(sf, dtype=float))
        distances = np.stack([sp, sf], axis=-1)
        wrong = distances[~(distances >= CONTACT - ROUND_OFF)]
        if wrong.size:
            raise TableError(f"distance is {wrong[0]:g} d; allowed: from contact, 1, to infinity")
        free = np.stack([self.closure(sp, sf, particle) for particle in range(3)], axis=-1)
        gap = distances - CONTACT
        return lubricate(free, gap, self.smallest_distance - CONTACT).velocity

    def closure(self, sp: NDArray, sf: NDArray, particle: int | NDArray) -> NDArray:
        """U of one of the three spheres in Ubar, without lubrication.

        Distances below `smallest_distance` count as that; NaN is not looked for. Made for
        hundreds of triplets at each of thousands of steps.

        Args:
            sp: Distances to the trailing sphere, shape (...).
            sf: Distances to the leading sphere, of the same shape.
            particle: `TRAILING`, `MIDDLE` or `LEADING`, one for all or of this shape.
        """
        which = np.asarray(particle)
        splines = self._alike, self._x_p, self._x_f, self._cells, self._x_far, self._far
        U = _velocities(sp.ravel(), sf.ravel(), which.ravel(), self.smallest_distance, *splines)
        return U.reshape(sp.shape)


@numba.njit(cache=True, error_model="numpy")
def _velocities(sp, sf, particle, smallest, alike, x_p, x_f, cells, x_far, far):
    """U of one sphere of each triplet, shape (n,); see `TripletVelocities.closure`."""
    U, s_f, j, y = np.empty(sp.size), 0.0, 0, 0.0
    for n in range(sp.size):
        s_p = max(sp[n], smallest)  # in a train what was ahead of the last sphere
        i, x = (j, y) if alike and s_p == s_f else _local(x_p, 1.0 / s_p)
        s_f = max(sf[n], smallest)
        j, y = _local(x_f, 1.0 / s_f)
        k = particle[min(n, particle.size - 1)]
        value = 0.0
        for m in range(4):
            value = value * y + _cubic(cells[k, i, j, m], x)
        if k != MIDDLE:
            i, x = _local(x_far, 1.0 / (s_p + s_f))
            value += _cubic(far[k, i], x)
        U[n] = value
    return U


@numba.njit(cache=True)
def _local(knots, x):
    """Cell that holds x, and x from its beginning; a knot begins a cell."""
    cell, last = 0, knots.size - 2
    while cell < last:
        middle = (cell + last + 1) // 2
        if x >= knots[middle]:
            cell = middle
        else:
            last = middle - 1
    return cell, x - knots[cell]


@numba.njit(cache=True)
def _cubic(c, x):
    """Value of a cubic polynomial, the highest power first."""
    return ((c[0] * x + c[1]) * x + c[2]) * x + c[3]


def _check_nodes(name: str, nodes: NDArray):
    good = nodes.ndim == 1 and nodes.size >= 2 and nodes[0] > CONTACT and np.isposinf(nodes[-1])
    if not (good and (nodes[1:] > nodes[:-1]).all()):
        raise TableError(
            f"nodes of {name} are {nodes.tolist()}; allowed: at least two, "
            "above contact (1), ascending, the last one infinite"
        )


def edges(sp: NDArray, sf: NDArray, velocity: NDArray) -> Pairs:
    """The pairs at the nodes of `TripletVelocities`: one of the outer spheres is not there."""
    along_p = velocity[:-1, -1][:, [TRAILING, MIDDLE]]
    along_f = velocity[-1, :-1][:, [MIDDLE, LEADING]]
    distance, first = np.unique(np.r_[sp[:-1], sf[:-1]], return_index=True)
    return Pairs(distance, np.concatenate([along_p, along_f])[first])


def decay_length(distance: NDArray, velocity: NDArray) -> float:
    """Length in d over which what pairs add decays by e beyond their last distance.

    That between the last two distances at which it is more than an error of the simulation.

    Args:
        distance: In d, ascending, shape (n,).
        velocity: What they add, shape (n, 2).
    """
    size = np.abs(velocity).sum(axis=-1)
    known = np.flatnonzero(size > NOISE)[-2:]
    longest = LONGEST_DECAY * float(distance[-1])
    if known.size < 2:
        return longest
    (near, far), (before, last) = distance[known], size[known]
    return float(min((far - near) / math.log(before / last), longest)) if before > last else longest


def _knots(distance: NDArray, decay: float) -> NDArray:
    """Coordinates, ascending, of infinity, of a tail and of nodes."""
    tail = distance[-1] + decay * np.array(BEYOND)
    return np.r_[0.0, coordinate(np.r_[distance, tail][::-1])]


def _with_tail(values: NDArray, axis: int) -> NDArray:
    """Values at the knots of an axis, from those at its nodes: zero at infinity."""
    values = np.moveaxis(values, axis, 0)
    tail = values[-1] * np.exp(-np.array(BEYOND)).reshape(-1, *[1] * (values.ndim - 1))
    infinity = np.zeros_like(values[:1])
    return np.moveaxis(np.concatenate([values, tail, infinity])[::-1], 0, axis)


def _spline(x: NDArray, values: NDArray) -> CubicSpline:
    """Cubic spline with a slope of zero at infinity, x = 0, and not-a-knot at the other end."""
    return CubicSpline(x, values, bc_type=((1, np.zeros(values.shape[1:])), "not-a-knot"))


class _Pair:
    """What two spheres add to their velocities: a of the trailing, b of the leading one."""

    def __init__(self, pairs: Pairs, isolated: float):
        added = pairs.velocity - isolated
        self.decay = decay_length(pairs.distance, added)
        self.x = _knots(pairs.distance, self.decay)
        self.spline = _spline(self.x, _with_tail(added, 0))
        self.isolated = isolated

    def superposed(self, sp: NDArray, sf: NDArray) -> NDArray:
        """U of three spheres of which each two act as if they were alone, shape (sp, sf, 3)."""
        behind, ahead = self.spline(coordinate(sp)), self.spline(coordinate(sf))
        U = np.full((sp.size, sf.size, len(PARTICLES)), self.isolated)
        U[..., TRAILING] += behind[:, None, 0]
        U[..., MIDDLE] += behind[:, None, 1] + ahead[:, 0]
        U[..., LEADING] += ahead[:, 1]
        outer = self.spline(coordinate(sp[:, None] + sf))
        U[..., TRAILING] += outer[..., 0]
        U[..., LEADING] += outer[..., 1]
        return U

    def outer_cells(self) -> NDArray:
        """What the outer spheres of a triplet add to each other, shape (particle, cell, 4)."""
        a, b = np.moveaxis(_pieces(self.spline, self.x), -1, 0)
        return np.ascontiguousarray(np.stack([a, np.zeros_like(a), b]).swapaxes(1, 2))


def _polynomials(x_p: NDArray, x_f: NDArray, alone: _Pair, third: tuple) -> NDArray:
    """Coefficients of the interpolant, highest power first.

    Their shape is (particle, cell of sp, cell of sf, 4, 4); the last index is that of powers of sp.

    Args:
        x_p: Knots of all splines along the first axis, ascending, shape (m,).
        x_f: The same along the second axis, shape (n,).
        alone: Pairs.
        third: Nodes sp and sf, and what a third sphere adds there, shape (sp, sf, 3).
    """
    sp, sf, added = third
    values = _with_tail(_with_tail(added, 0), 1)
    p, f = (_spline(x := _knots(s, alone.decay), np.eye(x.size)) for s in (sp, sf))
    along_p = np.einsum("akm,mnp->aknp", _pieces(p, x_p), values)
    cells = np.einsum("bln,aknp->abpkl", _pieces(f, x_f), along_p)
    behind, ahead = _pieces(alone.spline, x_p), _pieces(alone.spline, x_f)
    cells[:, -1, TRAILING] += behind[:, :, None, 0]
    cells[:, -1, MIDDLE] += behind[:, :, None, 1]
    cells[-1, :, MIDDLE] += ahead[:, None, :, 0]
    cells[-1, :, LEADING] += ahead[:, None, :, 1]
    cells[-1, -1] += alone.isolated
    return np.ascontiguousarray(cells.transpose(2, 3, 4, 1, 0))


def _pieces(spline: CubicSpline, knots: NDArray) -> NDArray:
    """Coefficients (power, cell, ...) of a spline between knots, its own ones among them."""
    left = knots[:-1]
    return np.stack([spline(left, power) / math.factorial(power) for power in (3, 2, 1, 0)])


def interpolant(layer: xr.Dataset) -> TripletVelocities:
    """The velocities of a table at one Deborah number, at all distances.

    Args:
        layer: A table without holes, or a part of its grid, at one Deborah number.
    """
    U = layer["velocity"].transpose("sp", "sf", "particle").sel(particle=list(PARTICLES))
    pairs = layer["pair_velocity"].transpose("pair_distance", "particle_of_pair")
    pairs = pairs.sel(particle_of_pair=list(OF_A_PAIR))
    alone = Pairs(layer["pair_distance"].values, pairs.values)
    return TripletVelocities(layer["sp"].values, layer["sf"].values, U.values, alone)


DIMENSIONS = {  # of what is interpolated
    "velocity": ("deborah", "sp", "sf", "particle"),
    "pair_velocity": ("deborah", "pair_distance", "particle_of_pair"),
}


class VelocityTable:
    """A table of velocities at its Deborah numbers: content of `velocity_table.nc`.

    Raises:
        TableError: The dataset is not such a table.
    """

    def __init__(self, dataset: xr.Dataset):
        for name, dims in DIMENSIONS.items():
            if name not in dataset or set(dataset[name].dims) != set(dims):
                raise TableError(
                    f"dataset holds {sorted(map(str, dataset.variables))}; "
                    f"allowed: a velocity table, with the variable {name}({', '.join(dims)})"
                )
        self.dataset = dataset

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Read a table from its netCDF file, which is closed again."""
        return cls(read_dataset(path, own=False))

    @property
    def deborah(self) -> tuple[float, ...]:
        """The Deborah numbers of the table, in the definition of the study."""
        return tuple(self.dataset["deborah"].values.tolist())

    @property
    def smallest_distance(self) -> float:
        """The distance in d below which velocities follow lubrication."""
        return float(max(self.dataset["sp"][0], self.dataset["sf"][0]))

    @property
    def confinement(self) -> float:
        """d/D of the simulations.

        Raises:
            TableError: The table does not say.
        """
        settings = yaml.safe_load(self.dataset.attrs.get("simulations_settings", "")) or {}
        if "confinement" not in settings:
            raise TableError("the table does not say of which d/D it is; allowed: one that does")
        return float(settings["confinement"])

    def at(self, deborah: float) -> TripletVelocities:
        """The interpolant at one of the table's Deborah numbers.

        Raises:
            TableError: The table does not hold this Deborah number, or has holes there.
        """
        k = self.index(deborah)
        missing = [(sp, sf) for _, sp, sf in holes(self.dataset.isel(deborah=[k]))]
        if missing:
            raise TableError(
                f"the table has {len(missing)} {'hole' if len(missing) == 1 else 'holes'} "
                f"at De = {deborah:g}: {name_geometries(missing)}; "
                "holes are never filled. Solve these points with other settings in `dns`, or take "
                "their distances out of `table`"
            )
        return interpolant(self.dataset.isel(deborah=k))

    def centreline_velocity(self, deborah: float) -> float:
        """U_max of the undisturbed flow in Ubar; raises TableError like `index`."""
        return float(self.dataset["centreline_velocity"][self.index(deborah)])

    def deborah_longest_mode(self, deborah: float) -> float:
        """lambda_1 Ubar/D there; raises TableError like `index`."""
        return float(self.dataset["deborah_longest_mode"][self.index(deborah)])

    def index(self, deborah: float) -> int:
        """Position of a Deborah number in the table; raises TableError if it is not there."""
        there = np.isclose(self.dataset["deborah"], deborah, rtol=SAME_DEBORAH, atol=0.0)
        if not there.any():
            held = ", ".join(f"{De:g}" for De in self.deborah)
            raise TableError(f"De = {deborah:g} is not in the table; available: {held}")
        return int(np.argmax(there))


def name_geometries(geometries: Iterable[tuple[float, float]]) -> str:
    """Geometries in words, not more than a line or two."""
    names = [f"(sp {sp:g}, sf {sf:g})" for sp, sf in geometries]
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
