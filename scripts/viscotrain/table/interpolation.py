r"""Velocities of three spheres at any two distances, from a table of them.

The velocities U_1, U_2, U_3 (trailing, middle, leading sphere) are known at nodes of the distances
sp = (z_2 - z_1)/d and sf = (z_3 - z_2)/d, the last node of either axis being infinite.

**Coordinate.** x = 1/s maps contact...infinity onto 1...0, and infinity to exactly 0. Against
pairs solved at 26 distances (De 0.5 to 12), 1/s and its like were as good as maps with an
exponential tail, which need a length of decay that changes with De.

**Interpolant.** A tensor product of cubic splines in x with not-a-knot ends (a parabola through
three nodes, a line through two), for all three velocities at once. In terms of the cardinal splines
l_m, which are 1 at their own node and 0 at the others,

    U_p(sp, sf) = sum_mn l_m(1/sp) l_n(1/sf) U_p(sp_m, sf_n).

At infinity the first polynomial of a spline reduces to its constant, so pairs and single spheres
come out as tabulated, without rounding.

**Contact.** The table ends at a smallest distance s_min > 1. Closer spheres feel lubrication: they
move as at s_min, but their relative velocity goes to zero linearly with the gap (`lubrication`), so
they never overlap. There is no other extrapolation.

This module needs no NGSolve.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Self

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from viscotrain.errors import TableError
from viscotrain.table.lubrication import ROUND_OFF, lubricate
from viscotrain.words import CONTACT, MIDDLE, PARTICLES

SAME_DEBORAH = 1e-9  # relative difference of two Deborah numbers that are one
MOST_NAMED = 8  # holes that a message names


def coordinate(distance: ArrayLike) -> NDArray:
    """The coordinate of interpolation, 1/s: 1 at contact, exactly 0 at infinity."""
    return 1.0 / np.asarray(distance, dtype=float)


class TripletVelocities:
    """Velocities of a triplet as a function of its two distances, at one Deborah number.

    Args:
        sp: Distances of the middle sphere to the trailing one at the nodes, in d: above contact,
            ascending, the last one infinite.
        sf: The same of the leading sphere to the middle one.
        velocity: U at the nodes in Ubar, shape (sp, sf, 3), particles in the order `PARTICLES`.

    Raises:
        TableError: Nodes that are not as above, or velocities that are not finite.
    """

    def __init__(self, sp: ArrayLike, sf: ArrayLike, velocity: ArrayLike):
        sp, sf, velocity = (np.asarray(item, dtype=float) for item in (sp, sf, velocity))
        _check_nodes("sp", sp)
        _check_nodes("sf", sf)
        if velocity.shape != (sp.size, sf.size, len(PARTICLES)):
            raise TableError(
                f"velocities have the shape {velocity.shape}; "
                f"allowed: ({sp.size}, {sf.size}, {len(PARTICLES)}), for sp, sf and the particles"
            )
        if not np.isfinite(velocity).all():
            raise TableError("velocities are not finite at every node; allowed: no holes")
        self.smallest_distance = float(max(sp[0], sf[0]))
        self.slowest = float(velocity.min())
        self.isolated = float(velocity[-1, -1, MIDDLE])
        # infinity first: x ascends from 0
        self._x_p, self._x_f = coordinate(sp[::-1]), coordinate(sf[::-1])
        self._cells = _polynomials(self._x_p, self._x_f, velocity[::-1, ::-1])

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
        hundreds of triplets at each of thousands of steps: a third of the time of `NdBSpline`.

        Args:
            sp: Distances to the trailing sphere, shape (n,).
            sf: Distances to the leading sphere, shape (n,).
            particle: `TRAILING`, `MIDDLE` or `LEADING`, one for all or shape (n,).
        """
        nearest = 1.0 / self.smallest_distance
        x_p, x_f = np.minimum(1.0 / sp, nearest), np.minimum(1.0 / sf, nearest)
        i, j = _cell(self._x_p, x_p), _cell(self._x_f, x_f)
        x_p, x_f = x_p - self._x_p[i], x_f - self._x_f[j]
        cells_p, cells_f = self._x_p.size - 1, self._x_f.size - 1
        c = self._cells.take((particle * cells_p + i) * cells_f + j, axis=-1)
        b = _horner(c, x_p)
        return _horner(b, x_f)


def _check_nodes(name: str, nodes: NDArray):
    good = nodes.ndim == 1 and nodes.size >= 2 and nodes[0] > CONTACT and np.isposinf(nodes[-1])
    if not (good and (nodes[1:] > nodes[:-1]).all()):
        raise TableError(
            f"nodes of {name} are {nodes.tolist()}; allowed: at least two, "
            "above contact (1), ascending, the last one infinite"
        )


def _cell(nodes: NDArray, x: NDArray) -> NDArray:
    """Index of the cell that holds x; a node belongs to the cell that begins there."""
    return nodes[1:-1].searchsorted(x, side="right")


def _horner(coefficients: NDArray, x: NDArray) -> NDArray:
    """Value of cubic polynomials; the first coefficient, of the highest power, is overwritten."""
    value = coefficients[0]
    for coefficient in coefficients[1:]:
        value *= x
        value += coefficient
    return value


def _polynomials(x_p: NDArray, x_f: NDArray, velocity: NDArray) -> NDArray:
    """Coefficients of the interpolant, shape (4, 4, 3 cells), highest power first.

    The last index runs over particles, cells of the first axis, and, fastest, of the second.

    Args:
        x_p: Coordinates of the nodes, ascending, shape (m,).
        x_f: The same on the other axis, shape (n,).
        velocity: Values at the nodes, shape (m, n, 3).
    """
    cardinal_p, cardinal_f = (_at_least_cubic(CubicSpline(x, np.eye(x.size)).c) for x in (x_p, x_f))
    cells = np.einsum("akm,bln,mnp->abpkl", cardinal_p, cardinal_f, velocity)
    return np.ascontiguousarray(cells.reshape(4, 4, -1))


def _at_least_cubic(coefficients: NDArray) -> NDArray:
    """Coefficients (power, cell, node), with zeros for powers that are not there."""
    missing = 4 - coefficients.shape[0]
    return np.pad(coefficients, ((missing, 0), (0, 0), (0, 0)))


class VelocityTable:
    """A table of velocities at its Deborah numbers.

    Args:
        dataset: Content of `velocity_table.nc`, as `assembly.combine` makes it.

    Raises:
        TableError: The dataset is not such a table.
    """

    def __init__(self, dataset: xr.Dataset):
        dims = ("deborah", "sp", "sf", "particle")
        if "velocity" not in dataset or set(dataset["velocity"].dims) != set(dims):
            raise TableError(
                f"dataset holds {sorted(map(str, dataset.variables))}; "
                f"allowed: a velocity table, with the variable velocity({', '.join(dims)})"
            )
        self.dataset = dataset
        self._velocity = dataset["velocity"].transpose(*dims).sel(particle=list(PARTICLES))

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Read a table from its netCDF file, which is closed again."""
        return cls(xr.load_dataset(path))

    @property
    def deborah(self) -> tuple[float, ...]:
        """The Deborah numbers of the table, in the definition of the study."""
        return tuple(self.dataset["deborah"].values.tolist())

    @property
    def smallest_distance(self) -> float:
        """The distance in d below which velocities follow lubrication."""
        return float(max(self.dataset["sp"][0], self.dataset["sf"][0]))

    def at(self, deborah: float) -> TripletVelocities:
        """The interpolant at one of the table's Deborah numbers.

        Raises:
            TableError: The table does not hold this Deborah number, or has holes there.
        """
        layer = self._velocity.isel(deborah=self.index(deborah))
        holes = np.argwhere(~np.isfinite(layer.values).all(axis=-1))
        sp, sf = self.dataset["sp"].values, self.dataset["sf"].values
        if len(holes):
            raise TableError(
                f"the table has {len(holes)} {'hole' if len(holes) == 1 else 'holes'} "
                f"at De = {deborah:g}: {name_geometries((sp[i], sf[j]) for i, j in holes)}; "
                "holes are never filled. Solve these points with other settings in `dns`, or take "
                "their distances out of `table`"
            )
        return TripletVelocities(sp, sf, layer.values)

    def centreline_velocity(self, deborah: float) -> float:
        """U_max of the undisturbed flow in Ubar; raises TableError like `index`."""
        return float(self.dataset["centreline_velocity"][self.index(deborah)])

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
