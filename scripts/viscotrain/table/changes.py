"""Fewer triplets at high Deborah numbers: what changes with De is smoother than what is there.

At such a De triplets are simulated at every second distance (`triplets.every_second`), pairs at
all. What a third sphere adds to them, T (`interpolation`), is at the other nodes

    T(De) = T(De_below) + S[T(De) - T(De_below)],

with S the interpolant through every second distance, and De_below the Deborah number before. The
check of the table (`check`) measures what this costs, and refuses it where it is too much.
"""

import numpy as np
import xarray as xr

from viscotrain.table.attributes import INTERPOLATED
from viscotrain.table.interpolation import interpolant
from viscotrain.table.points import holes
from viscotrain.table.triplets import every_second
from viscotrain.words import NOT_ATTEMPTED, PARTICLES, SOLVED


def interpolate_changes(table: xr.Dataset, deborah: float):
    """Fill a table at one De between every second distance, in place.

    Where a simulation that this needs has no solution, all of these points stay holes.
    """
    sp, sf = (every_second(table[name].values.tolist()) for name in ("sp", "sf"))
    k = int(np.flatnonzero(table["deborah"] == deborah)[0])
    below = table.isel(deborah=[k - 1])
    coarse = [layer.sel(sp=sp, sf=sf) for layer in (table.isel(deborah=[k]), below)]
    if any(any(holes(layer)) for layer in (below, *coarse)):
        return
    high, low = (interpolant(layer.isel(deborah=0)) for layer in coarse)
    U = table["velocity"].transpose("deborah", "sp", "sf", "particle").sel(particle=list(PARTICLES))
    distances = np.stack(np.meshgrid(table["sp"], table["sf"], indexing="ij"), axis=-1)
    status = table["status"].transpose("deborah", "sp", "sf")
    for i, j in np.argwhere(status[k].values == NOT_ATTEMPTED):
        change = high(*distances[i, j]) - low(*distances[i, j])
        at = {"deborah": k, "sp": i, "sf": j}
        table["velocity"][at] = U[k - 1, i, j].values + change
        table["status"][at], table["origin"][at] = SOLVED, INTERPOLATED
