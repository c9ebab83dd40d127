r"""Size response: how the velocity of a single sphere changes with its diameter.

    U' = dU/d(ln d) at the diameter d of the table's spheres, in Ubar.

Two diameters on either side, d(1 +- h) and d(1 +- 2h), are simulated alone. The nearer pair gives

    U' = [U(1 + h) - U(1 - h)]/2h,

whose error is estimated as

    sqrt( (U' - U'_far)^2 + (e_+^2 + e_-^2)/4h^2 ),

with U'_far of the farther pair, whose own error by the curvature of U(d) is four times as large,
and e the estimated errors of the simulations. Where one is not solved there is no number.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from viscotrain.errors import TableError
from viscotrain.table.attributes import described
from viscotrain.table.interpolation import VelocityTable
from viscotrain.words import MIDDLE, PARTICLES, has_solution

DIGITS = 6  # of ratios of diameters
MISSING = (
    "the table does not say how velocities change with the diameter (size_response); needed for "
    "particle.diameter_variation > 0"
)


class SizeResponse(NamedTuple):
    """U' and its error, in Ubar; NaN where they are not known."""

    value: float
    error: float


UNKNOWN = SizeResponse(math.nan, math.nan)


def with_size_response(table: xr.Dataset, spheres: Sequence[xr.Dataset]) -> xr.Dataset:
    """The table with the size response, and the velocities that it is from.

    Args:
        table: As `assembly.combine` makes it, with attributes that say of which d/D it is.
        spheres: Results of single spheres, as the dns stage writes them, of four other diameters.

    Raises:
        TableError: They are not of two diameters on either side.
    """
    confinement = VelocityTable(table).confinement
    parts = {float(f"{float(s['confinement']) / confinement:.{DIGITS}g}"): s for s in spheres}
    ratios = sorted(parts)
    steps = np.array(ratios) - 1
    if len(spheres) != 4 or not np.allclose(steps, -steps[::-1], atol=1e-5) or steps[1] >= 0:
        raise TableError(
            f"single spheres have {ratios} times the diameter of the table's; allowed: two pairs, "
            "each as much smaller as larger"
        )
    De = table["deborah"].values
    U, error = (np.stack([_at(parts[r], De, name) for r in ratios], axis=1) for name in NAMES)
    near, far = ((U[:, -n] - U[:, n - 1]) / (steps[-n] - steps[n - 1]) for n in (2, 1))
    own = np.hypot(error[:, 1], error[:, 2]) / (steps[2] - steps[1])
    return described(
        table.assign(
            single_velocity=(("deborah", "diameter_ratio"), U),
            single_velocity_error=(("deborah", "diameter_ratio"), error),
            size_response=("deborah", near),
            size_response_error=("deborah", np.hypot(near - far, own)),
        ).assign_coords(diameter_ratio=ratios)
    )


NAMES = ("velocity", "velocity_error")  # of a result


def _at(sphere: xr.Dataset, deborah: np.ndarray, name: str) -> np.ndarray:
    """A number of a single sphere at Deborah numbers of the table; NaN where it is not solved."""
    known = sphere[name].where(has_solution(sphere["status"]))
    if "particle" in known.dims:
        known = known.sel(particle=PARTICLES[MIDDLE])
    return known.reindex(deborah=deborah).values


def size_response(table: VelocityTable, deborah: float) -> SizeResponse:
    """U' at a Deborah number; `UNKNOWN` if the table has none, or none there.

    Raises:
        TableError: The table does not hold this Deborah number.
    """
    layer = table.dataset.isel(deborah=table.index(deborah))
    if "size_response" not in layer:
        return UNKNOWN
    return SizeResponse(float(layer["size_response"]), float(layer["size_response_error"]))


def demanded(table: VelocityTable, deborah: float) -> SizeResponse:
    """U' at a Deborah number, for what cannot do without.

    Raises:
        TableError: The table has none, or single spheres were not solved there.
    """
    found = size_response(table, deborah)
    if math.isnan(found.value):
        why = MISSING
        if "size_response" in table.dataset:
            why = f"single spheres of other diameters are not solved at De = {deborah:g}"
        raise TableError(f"{why}. scripts/tools/complete_table.py adds what a table lacks")
    return found
