"""Fewer triplets: velocities on some lines of the grid, and between these by cross approximation.

Triplets are simulated on lines of the grid, where sp or sf is one of some of the distances
(`triplets.on_lines`). What a third sphere adds to the velocities of pairs is nearly a sum of few
products of a function of sp and one of sf. As a matrix A (sp, sf) of such a sum is

    A = A(:, J) G^+ A(I, :),    G = A(I, J),

with I and J the lines (S. A. Goreinov, E. E. Tyrtyshnikov & N. L. Zamarashkin, Linear Algebra Appl.
261, 1997, 1). The pseudo-inverse G^+ is that of the `RANK` largest singular values of G; smaller
ones are of the size of errors of simulations, which they would enlarge. Nothing is interpolated, so
lines may lie anywhere. The check of the table (`check`) measures what is left, and refuses it where
it is too much.
"""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from viscotrain.table.attributes import INTERPOLATED
from viscotrain.table.interpolation import TripletVelocities, interpolant
from viscotrain.table.points import holes
from viscotrain.table.triplets import on_lines
from viscotrain.words import NOT_ATTEMPTED, SOLVED

# In the table of config/paper.yaml at De = 62, on 4 lines, interpolation between all nodes is wrong
# by up to 2.4e-5 Ubar with 2, 1.0e-5 with 3 and 5.5e-5 with 4.
RANK = 3
NOTHING = 1e-12  # Ubar: a singular value of spheres that do not feel each other


def fill_between(table: xr.Dataset, line_spacing: int):
    """Fill a table between the lines of its grid, in place.

    At a De where a point on the lines has no solution, all of those between them stay holes.

    Args:
        table: At the points on the lines as simulated; "not attempted" between them.
        line_spacing: Number of distances from one line to the next.
    """
    axes = [table[name].values for name in ("sp", "sf")]
    sp, sf = (on_lines(axis.tolist(), line_spacing) for axis in axes)
    finite = [axis[:-1] for axis in axes]
    rows, columns = (np.isin(x, lines) for x, lines in zip(finite, (sp, sf), strict=True))
    status = table["status"].transpose("deborah", "sp", "sf")
    for k in range(table.sizes["deborah"]):
        between = np.argwhere(status[k].values == NOT_ATTEMPTED)
        layer = table.isel(deborah=k)
        parts = layer.sel(sp=sp), layer.sel(sf=sf)
        if not between.size or any(any(holes(part.expand_dims("deborah"))) for part in parts):
            continue
        pairs = _superposed(interpolant(layer.sel(sp=sp, sf=sf)), *finite)
        U = layer["velocity"].transpose("sp", "sf", "particle").values[:-1, :-1]
        added = np.moveaxis(U - pairs, -1, 0)
        filled = pairs + np.stack([cross(A, rows, columns) for A in added], axis=-1)
        for i, j in between:
            at = {"deborah": k, "sp": i, "sf": j}
            table["velocity"][at] = filled[i, j]
            table["status"][at], table["origin"][at] = SOLVED, INTERPOLATED


def cross(matrix: NDArray, rows: NDArray, columns: NDArray) -> NDArray:
    """A matrix of low rank from some of its rows and columns, given as masks.

    Args:
        matrix: Shape (m, n); other entries are not looked at.
        rows: Shape (m,).
        columns: Shape (n,).
    """
    left, size, right = np.linalg.svd(matrix[np.ix_(rows, columns)], full_matrices=False)
    rank = min(RANK, int((size > NOTHING).sum()))
    inverse = (right[:rank].T / size[:rank]) @ left[:, :rank].T
    return matrix[:, columns] @ inverse @ matrix[rows]


def _superposed(velocities: TripletVelocities, sp: NDArray, sf: NDArray) -> NDArray:
    """U of three spheres of which each two act as if they were alone, shape (sp, sf, 3)."""
    behind = velocities(sp, np.inf)[:, None] - velocities.isolated
    ahead = velocities(np.inf, sf) - velocities.isolated
    outer = velocities(np.add.outer(sp, sf), np.inf) - velocities.isolated
    trailing = behind[..., 0] + outer[..., 0]
    middle = behind[..., 1] + ahead[..., 1]
    leading = outer[..., 1] + ahead[..., 2]
    return velocities.isolated + np.stack(np.broadcast_arrays(trailing, middle, leading), axis=-1)
