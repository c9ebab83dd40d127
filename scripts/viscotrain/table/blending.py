"""Fewer triplets: velocities on some lines of the grid, and between these by blending.

Triplets are simulated on lines of the grid, where sp or sf is one of some of the distances
(`triplets.on_lines`). With S_p the interpolant (`interpolation`) along sp through these, for any
sf, S_f the same along sf, and S_p S_f through the points where lines cross, velocities are

    U = S_p U + S_f U - S_p S_f U

(blending, or transfinite interpolation: W. J. Gordon, J. Math. Mech. 18, 1969, 931). This is U on
all lines. Between them it errs by (1 - S_p)(1 - S_f) U, the error of one interpolation as the other
one misses it: nothing where the lines resolve either of the two distances. The check of the table
(`check`) measures what is left, and refuses it where it is too much.
"""

import numpy as np
import xarray as xr

from viscotrain.table.attributes import INTERPOLATED
from viscotrain.table.interpolation import interpolant
from viscotrain.table.points import holes
from viscotrain.table.triplets import on_lines
from viscotrain.words import NOT_ATTEMPTED, SOLVED


def blend(table: xr.Dataset, line_spacing: int):
    """Fill a table between the lines of its grid, in place.

    At a De where a point on the lines has no solution, all of those between them stay holes.

    Args:
        table: At the points on the lines as simulated; "not attempted" between them.
        line_spacing: Number of distances from one line to the next.
    """
    sp, sf = (on_lines(table[name].values.tolist(), line_spacing) for name in ("sp", "sf"))
    status = table["status"].transpose("deborah", "sp", "sf")
    distances = np.stack(np.meshgrid(table["sp"], table["sf"], indexing="ij"), axis=-1)
    for k in range(table.sizes["deborah"]):
        between = np.argwhere(status[k].values == NOT_ATTEMPTED)
        layer = table.isel(deborah=k)
        parts = layer.sel(sp=sp), layer.sel(sf=sf), layer.sel(sp=sp, sf=sf)
        if not between.size or any(any(holes(part.expand_dims("deborah"))) for part in parts):
            continue
        along_p, along_f, crossings = (interpolant(part) for part in parts)
        for i, j in between:
            at, here = {"deborah": k, "sp": i, "sf": j}, distances[i, j]
            table["velocity"][at] = along_p(*here) + along_f(*here) - crossings(*here)
            table["status"][at], table["origin"][at] = SOLVED, INTERPOLATED
