r"""Design map: what a train looks like after a length of channel, over De and volume fraction.

A device is designed from a fluid and a particle to a flow rate, a concentration and a channel
length. So the trains stage is run over (De, phi), and its measures of the spacing, recorded along
the channel, come together with the numbers that one sets at the bench:

    Q = (pi/4) D^2 Ubar,    L = z,    dp(L) = (-dp/dz) L,

with the pressure gradient of the undisturbed flow (`pipe`), which spheres of a volume fraction of
a percent raise little. A channel that ends at z has at its outlet the spacings recorded at z.

**Ordering length.** The first position from which on, up to the last one recorded, the coefficient
of variation of the spacing is not above a threshold; between two stations on the straight line
through their values. It is 0 if the train enters so, and infinite if it is not so at the end.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from viscotrain.fluid.parameters import DimensionlessFluid
from viscotrain.fluid.pipe import pipe_flow
from viscotrain.fluid.units import CENTIMETRES, MICROMETRES
from viscotrain.table import memory
from viscotrain.table.attributes import ATTRIBUTES
from viscotrain.words import BEYOND_QUASI_STEADY

MEASURES = ("mean_spacing", "spacing_variation", "touching_share")
NAMES = tuple(name + end for name in MEASURES for end in ("", "_halfwidth"))
BAR = 1e-5  # of one Pa


def ordering_length(z: ArrayLike, variation: ArrayLike, threshold: float) -> float:
    """First position from which on the coefficient of variation stays at or below a threshold.

    Args:
        z: Positions in D, ascending, shape (station,).
        variation: Coefficient of variation there, same shape.
        threshold: Of the coefficient of variation.

    Returns:
        The position in D; infinite where the last value is above the threshold.
    """
    z, variation = np.asarray(z, dtype=float), np.asarray(variation, dtype=float)
    above = np.flatnonzero(~(variation <= threshold))  # NaN is not ordered
    if not above.size:
        return float(z[0])
    last = above[-1]
    if last == z.size - 1:
        return math.inf
    if not np.isfinite(variation[last]):
        return float(z[last + 1])
    share = (variation[last] - threshold) / (variation[last] - variation[last + 1])
    return float(z[last] + share * (z[last + 1] - z[last]))


def combine(
    points: Sequence[xr.Dataset],
    *,
    units: xr.Dataset,
    fluid: DimensionlessFluid,
    ordered_variation: float,
    attributes: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """Trains of all conditions as one dataset over (deborah, volume_fraction, station).

    Args:
        points: Results of `repeats.run_repeats` with the same stations, one per condition.
        units: Result of `units.physical_units`.
        fluid: For the pressure gradient.
        ordered_variation: Threshold of `ordering_length`.
        attributes: Global attributes.

    Returns:
        The measures of the spacing with their `_halfwidth`, `ordering_length` in D and
        `memory_number` (deborah, volume_fraction), and physical numbers: `flow_rate` (deborah) in
        uL/min, `length` (station) in cm, `pressure_drop` (deborah, station) in bar.
    """
    z = points[0]["station"].values
    deborah = sorted({float(point["deborah"]) for point in points})
    phi = sorted({float(point["volume_fraction"]) for point in points})
    values = _filled(points, deborah, phi)
    order = np.apply_along_axis(
        lambda variation: ordering_length(z, variation, ordered_variation),
        -1,
        values["spacing_variation"],
    )
    order[np.isnan(values["mean_spacing"]).all(axis=-1)] = math.nan  # not simulated
    grid = ["deborah", "volume_fraction", "station"]
    text = points[0]
    return xr.Dataset(
        {name: (grid, values[name], dict(text[name].attrs)) for name in NAMES}
        | {
            "spacing_mode": (grid, values["spacing_mode"], _words("1", MODE)),
            "memory_number": (grid[:2], _memory(points, deborah, phi), ATTRIBUTES["memory_number"]),
            "ordering_length": (grid[:2], order, _words("1", ORDERING_LENGTH)),
            "ordered_variation": ((), ordered_variation, _words("1", THRESHOLD)),
            "confinement": text["confinement"],
        }
        | _physical(units.sel(deborah=deborah), fluid, z),
        coords={
            "deborah": (grid[0], deborah, dict(text["deborah"].attrs)),
            "volume_fraction": (grid[1], phi, dict(text["volume_fraction"].attrs)),
            "station": text["station"],
        },
        attrs=dict(attributes or {}),
    ).set_coords("length")


def _physical(units: xr.Dataset, fluid: DimensionlessFluid, z: NDArray) -> dict[str, xr.Variable]:
    """What of the map is in physical units: diameters, flow rate, length, pressure drop.

    Args:
        units: At the Deborah numbers of the map.
        fluid: For the pressure gradient.
        z: Stations in D, shape (station,).
    """
    longest_modes = units["deborah_longest_mode"].values
    gradient = np.array([pipe_flow(fluid, float(De)).pressure_gradient for De in longest_modes])
    drop = (BAR * gradient * units["stress"].values)[:, None] * z
    length = CENTIMETRES * float(units["channel_diameter"]) * z
    taken = ("channel_diameter", "particle_diameter", "flow_rate")
    return {name: units[name].variable for name in taken} | {
        "length": xr.Variable(["station"], length, _words("cm", LENGTH)),
        "pressure_drop": xr.Variable(["deborah", "station"], drop, _words("bar", PRESSURE_DROP)),
    }


def _filled(points: Sequence[xr.Dataset], deborah: list, phi: list) -> dict[str, NDArray]:
    """Measures on the grid of conditions; NaN where none is."""
    z = points[0]["station"].values
    names = [*NAMES, "spacing_mode"]
    values = {name: np.full((len(deborah), len(phi), z.size), np.nan) for name in names}
    for point in points:
        at = deborah.index(float(point["deborah"])), phi.index(float(point["volume_fraction"]))
        for name in NAMES:
            values[name][at] = point[name].values
        values["spacing_mode"][at] = pooled_mode(point)
    return values


def _memory(points: Sequence[xr.Dataset], deborah: list, phi: list) -> NDArray:
    """Largest memory number of each condition; NaN where none was simulated."""
    values = np.full((len(deborah), len(phi)), np.nan)
    for point in points:
        at = deborah.index(float(point["deborah"])), phi.index(float(point["volume_fraction"]))
        values[at] = memory.largest(point)
    return values


ORDERING_LENGTH = (
    "first position over channel diameter from which on the coefficient of variation of the "
    "spacing is not above ordered_variation; inf: it is above at the outlet"
)
MODE = "most frequent spacing of all repeats together, centre of the highest bin"
LENGTH = "position along the channel, the length of one that ends there"
PRESSURE_DROP = "pressure drop of the flow without spheres, from the inlet to the position"
THRESHOLD = "coefficient of variation of the spacing of a train that counts as ordered"


def pooled_mode(point: xr.Dataset) -> NDArray:
    """Most frequent spacing of all repeats together, in d, shape (station,).

    Repeats have the same number of spheres, so the mean of their densities is the density of all;
    its mode scatters less than the modes of the repeats.
    """
    density = point["spacing_density"].transpose("station", "spacing_bin").values
    return point["spacing_bin"].values[density.argmax(axis=-1)]


def _words(units: str, long_name: str) -> dict[str, str]:
    return {"long_name": long_name, "units": units}


def table(dataset: xr.Dataset) -> pd.DataFrame:
    """The map in the units of the bench: one row per De, volume fraction and channel length.

    Args:
        dataset: Result of `combine`.
    """
    diameter = MICROMETRES * float(dataset["particle_diameter"])
    cm = CENTIMETRES * float(dataset["channel_diameter"])
    rows = []
    for De in dataset["deborah"].values:
        for phi in dataset["volume_fraction"].values:
            own = dataset.sel(deborah=De, volume_fraction=phi)
            if not np.isfinite(own["mean_spacing"]).any():
                continue
            order = float(own["ordering_length"])
            rows.append(
                pd.DataFrame(
                    {
                        "deborah": De,
                        "flow_rate_uL_per_min": float(own["flow_rate"]),
                        "volume_fraction_percent": 100 * phi,
                        "channel_length_D": own["station"].values,
                        "channel_length_cm": own["length"].values,
                        "pressure_drop_bar": own["pressure_drop"].values,
                        "mean_spacing_d": own["mean_spacing"].values,
                        "mean_spacing_d_halfwidth": own["mean_spacing_halfwidth"].values,
                        "mean_spacing_um": diameter * own["mean_spacing"].values,
                        "spacing_mode_d": own["spacing_mode"].values,
                        "spacing_mode_um": diameter * own["spacing_mode"].values,
                        "spacing_variation": own["spacing_variation"].values,
                        "spacing_variation_halfwidth": own["spacing_variation_halfwidth"].values,
                        "touching_share_percent": 100 * own["touching_share"].values,
                        "touching_share_percent_halfwidth": 100
                        * own["touching_share_halfwidth"].values,
                        "memory_number": float(own["memory_number"]),
                        "ordering_length_D": order,
                        "ordering_length_cm": cm * order,
                    }
                )
            )
    return pd.concat(rows, ignore_index=True)


def headline(dataset: xr.Dataset) -> str:
    """The condition with the most even spacing at the outlet, in one line of text."""
    last = dataset["spacing_variation"].isel(station=-1)
    De, phi = (int(n) for n in np.unravel_index(np.nanargmin(last.values), last.shape))
    best = dataset.isel(deborah=De, volume_fraction=phi)
    ordered = int(np.isfinite(dataset["ordering_length"]).sum())
    return (
        f"ordered (coefficient of variation up to {float(dataset['ordered_variation']):g}) at "
        f"{ordered} of {int(np.isfinite(last).sum())} conditions; the most even train, "
        f"{float(best['spacing_variation'][-1]):.2f}, at De = {float(best['deborah']):g}, "
        f"phi = {100 * float(best['volume_fraction']):g} %" + _remarks(dataset)
    )


def _remarks(dataset: xr.Dataset) -> str:
    """Names the Deborah numbers with conditions beyond the quasi-steady range, if any."""
    rows = dataset.transpose("deborah", ...)
    names = [f"{De:g}" for De in rows["deborah"].values if memory.remark(rows.sel(deborah=De))]
    return f"; {BEYOND_QUASI_STEADY}: De {', '.join(names)}" if names else ""
