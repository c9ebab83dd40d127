r"""Velocities in a duct: those of the inscribed tube, moved on with the faster or slower flow.

Spheres on the axis of a duct act on each other as in the inscribed tube at the same Ubar, and all
of them lag behind the fluid on the axis as there:

    U_i(duct) = U_i(tube) + U_max(duct) - U_max(tube).

Relative velocities do not change. What does is how long spheres stay in the channel, and with it
what they do to each other on the way, how many enter in a second, and phi_feed = phi U_p/Ubar.
U_max of a square is 5 % above that of a tube in a Newtonian fluid, that of a flat duct up to 25 %
below.
"""

from pathlib import Path

import numpy as np
import xarray as xr

from viscotrain.errors import TableError
from viscotrain.table.interpolation import VelocityTable


def in_duct(table: xr.Dataset, flow: xr.Dataset) -> xr.Dataset:
    """A velocity table with the drift of a duct.

    Args:
        table: As `assembly.combine` makes it.
        flow: Without spheres, of the duct, at the same Deborah numbers.

    Raises:
        TableError: The flow is not known at one of them.
    """
    largest = flow["centreline_velocity"].sel(deborah=table["deborah"].values)
    unknown = table["deborah"].values[np.isnan(largest.values)]
    if unknown.size:
        raise TableError(
            f"flow of the duct is not known at De = {', '.join(f'{De:g}' for De in unknown)}; "
            "allowed: a fluid whose shear stress grows with the shear rate"
        )
    drift = largest.values - table["centreline_velocity"]
    moved = {name: table[name] + drift for name in ("velocity", "pair_velocity")}
    moved["centreline_velocity"] = largest
    return table.assign(
        {name: table[name].copy(data=_like(table[name], moved[name])) for name in moved}
    )


def _like(there: xr.DataArray, values: xr.DataArray) -> np.ndarray:
    """Values in the order of dimensions that the table has."""
    return values.transpose(*there.dims).values


def open_table(path: Path, duct: Path | None) -> VelocityTable:
    """A table from its file, with the drift of a duct if there is the file of its flow."""
    if duct is None:
        return VelocityTable.open(path)
    return VelocityTable(in_duct(xr.load_dataset(path), xr.load_dataset(duct)))
