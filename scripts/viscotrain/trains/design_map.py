r"""Design map: what a train looks like after a length of channel, over De and volume fraction.

A device is designed from a fluid and a particle to a flow rate, a concentration and a channel
length. So the trains stage is run over (De, phi), and its measures of the spacing, recorded along
the channel, come together with the numbers that one sets at the bench:

    Q = A Ubar,    L = z,    dp(L) = (-dp/dz) L,

with the pressure gradient of the flow without spheres (`channel_flow`), which spheres of a volume
fraction of a percent raise little, and the spheres per second (`injection`). A channel that ends at
z has the spacings recorded at z at its outlet.

The volume fraction that the study gives, in the channel or in the feed, is a dimension; the other
one follows at each De.

**Ordered position.** The first position from which on, up to the last one recorded, the coefficient
of variation of the spacing is not above a threshold; between two stations on the straight line
through their values. It is 0 if the train enters so, and infinite if it is not so at the end. The
earliest and the latest one are those of the coefficient less and plus both its errors.

**Ordering length.** What `order` says of equally spaced trains at the De of the map, as far as its
volume fractions go: it is known between conditions, too, where nothing was simulated.
"""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from viscotrain.fluid.channel import ROUND, CrossSection
from viscotrain.fluid.units import CENTIMETRES, MICROMETRES
from viscotrain.table import memory
from viscotrain.table.attributes import ATTRIBUTES
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import order
from viscotrain.trains.variables import SPHERE_RATE, rate_in_words, unequal, with_errors
from viscotrain.words import BEYOND_QUASI_STEADY

MEASURES = ("mean_spacing", "spacing_mode", "spacing_variation", "even_share", "touching_share")
ERRORS = ("_halfwidth", "_model_error")
NAMES = tuple(name + end for name in MEASURES for end in ("", *ERRORS))
OF_THE_LAW = ("spacing_variation_injected", "even_share_injected", "touching_share_injected")
FRACTIONS = ("volume_fraction", "feed_volume_fraction")
BAR = 1e-5  # of one Pa
SPACINGS = 240  # of the ordering length: on a page they are less than a millimetre apart
BESIDE = 1.2  # beyond the widest spacing of the map, over it


def ordered_position(z: ArrayLike, variation: ArrayLike, threshold: float) -> float:
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
    flow: xr.Dataset,
    ordered_variation: float,
    section: CrossSection = ROUND,
    attributes: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """Trains of all conditions as one dataset over (deborah, volume_fraction, station).

    Args:
        points: Results of `repeats.run_repeats` with the same stations, one per condition.
        units: Result of `units.physical_units`.
        flow: Without spheres, of the stage `channel_flow`.
        ordered_variation: Threshold of `ordered_position`.
        section: Of the channel.
        attributes: Global attributes.

    Returns:
        The measures of the spacing with their `_halfwidth` and `_model_error`, `ordered_position`
        (deborah, volume_fraction) in D with `_earliest` and `_latest`, `memory_number`, what
        the injection law itself makes, and physical numbers: `flow_rate` (deborah) in uL/min,
        `sphere_rate` (deborah, volume_fraction) in 1/s, `length` (station) in cm, `pressure_drop`
        (deborah, station) in bar. It may be over `feed_volume_fraction` instead.
    """
    text, given = points[0], str(points[0].attrs["given"])
    z = text["station"].values
    deborah = sorted({float(point["deborah"]) for point in points})
    fractions = sorted({float(point[given]) for point in points})
    (other,) = set(FRACTIONS) - {given}
    of_conditions = (other, "injection_rate", *OF_THE_LAW)
    values = _filled(points, deborah, fractions, of_conditions)
    grid = ["deborah", given, "station"]
    dims = {name: grid for name in NAMES} | {name: grid[:2] for name in of_conditions}
    scales = units.sel(deborah=deborah)
    rate = values["injection_rate"] / scales["time"].values[:, None]
    return xr.Dataset(
        {name: (dims[name], values[name], dict(text[name].attrs)) for name in values}
        | {
            name: (grid[:2], order, _words("1", ORDERED_POSITION[name]))
            for name, order in _ordered_positions(z, values, ordered_variation).items()
        }
        | {
            "memory_number": (grid[:2], _memory(points, deborah, fractions), MEMORY),
            "ordered_variation": ((), ordered_variation, _words("1", THRESHOLD)),
            "confinement": text["confinement"],
            "inscribed_share": ((), section.inscribed_share, _words("1", INSCRIBED_SHARE)),
            "diameter_variation": text["diameter_variation"],
            "sphere_rate": (grid[:2], rate, _words("s-1", SPHERE_RATE)),
        }
        | _physical(scales, flow.sel(deborah=deborah), z),
        coords={
            "deborah": (grid[0], deborah, dict(text["deborah"].attrs)),
            given: (given, fractions, dict(text[given].attrs)),
            "station": text["station"],
        },
        attrs={**(attributes or {}), **_kept(text), **section.attributes},
    ).set_coords(["length", other])


def ordering(
    dataset: xr.Dataset, table: VelocityTable, closure: str, section: CrossSection = ROUND
) -> xr.Dataset:
    """Stability and ordering length of equally spaced trains, wherever the map has conditions.

    Args:
        dataset: Result of `combine`.
        table: Of velocities, of the channel.
        closure: Name of the closure, of `closures.CLOSURES`.
        section: Of the channel.

    Returns:
        Result of `order.orders` with `feed_volume_fraction` (deborah, spacing), phi U/Ubar.
    """
    beta = float(dataset["confinement"])
    thinnest = section.mean_spacing(beta, float(dataset["volume_fraction"].min()))
    farthest = max(order.FARTHEST_SPACING, BESIDE * thinnest)
    spacing = order.spacings(table, farthest, SPACINGS)
    deborah = dataset["deborah"].values.tolist()
    found = order.orders(table, beta, closure, spacing, section, deborah)
    feed = found["volume_fraction"] * found["velocity"]
    return found.assign(feed_volume_fraction=feed.transpose("deborah", "spacing"))


def _kept(point: xr.Dataset) -> dict[str, str]:
    """Attributes of trains that the map has too."""
    return {name: point.attrs[name] for name in KEPT}


def _ordered_positions(
    z: NDArray, values: Mapping[str, NDArray], threshold: float
) -> dict[str, NDArray]:
    """The ordered position of each condition, and the earliest and the latest that it may be."""
    variation = values["spacing_variation"]
    error = sum(np.nan_to_num(values[f"spacing_variation{end}"]) for end in ERRORS)
    missing = np.isnan(values["mean_spacing"]).all(axis=-1)  # not simulated
    found = {}
    for end, sign in (("", 0), ("_earliest", -1), ("_latest", 1)):
        order = np.apply_along_axis(
            lambda own: ordered_position(z, own, threshold), -1, variation + sign * error
        )
        found[f"ordered_position{end}"] = np.where(missing, math.nan, order)
    return found


def _physical(units: xr.Dataset, flow: xr.Dataset, z: NDArray) -> dict[str, xr.Variable]:
    """What of the map is in physical units: diameters, flow rate, length, pressure drop.

    Args:
        units: At the Deborah numbers of the map.
        flow: Without spheres, at the same.
        z: Stations in D, shape (station,).
    """
    gradient = flow["pressure_gradient"].values
    drop = (BAR * gradient * units["stress"].values)[:, None] * z
    length = CENTIMETRES * float(units["channel_diameter"]) * z
    taken = ("channel_diameter", "particle_diameter", "flow_rate")
    return {name: units[name].variable for name in taken} | {
        "length": xr.Variable(["station"], length, _words("cm", LENGTH)),
        "pressure_drop": xr.Variable(["deborah", "station"], drop, _words("bar", PRESSURE_DROP)),
    }


def _filled(
    points: Sequence[xr.Dataset], deborah: list, fractions: list, of_conditions: Sequence[str]
) -> dict[str, NDArray]:
    """Measures on the grid of conditions, and what each condition has; NaN where none is."""
    given, stations = str(points[0].attrs["given"]), points[0].sizes["station"]
    shape = len(deborah), len(fractions)
    values = {name: np.full((*shape, stations), np.nan) for name in NAMES}
    values |= {name: np.full(shape, np.nan) for name in of_conditions}
    for point in points:
        at = deborah.index(float(point["deborah"])), fractions.index(float(point[given]))
        for name in values:
            values[name][at] = point[name].values
    return values


def _memory(points: Sequence[xr.Dataset], deborah: list, fractions: list) -> NDArray:
    """Largest memory number of each condition; NaN where none was simulated."""
    given = str(points[0].attrs["given"])
    values = np.full((len(deborah), len(fractions)), np.nan)
    for point in points:
        at = deborah.index(float(point["deborah"])), fractions.index(float(point[given]))
        values[at] = memory.largest(point)
    return values


ORDERED_POSITION = {
    "ordered_position": "first position over channel diameter from which on the coefficient of "
    "variation of the spacing is not above ordered_variation; inf: it is above at the outlet",
    "ordered_position_earliest": "the same, if the coefficient of variation is smaller by its "
    "sampling and model error: the first that it may be",
    "ordered_position_latest": "the same, if it is larger by both: the last that it may be",
}
INSCRIBED_SHARE = "area of the tube that fits the channel over that of the channel"
KEPT = ("given", "injection")  # attributes of trains
LENGTH = "position along the channel, the length of one that ends there"
PRESSURE_DROP = "pressure drop of the flow without spheres, from the inlet to the position"
MEMORY = ATTRIBUTES["memory_number"]
THRESHOLD = "coefficient of variation of the spacing of a train that counts as ordered"


def _words(units: str, long_name: str) -> dict[str, str]:
    return {"long_name": long_name, "units": units}


def conditions(dataset: xr.Dataset) -> Iterator[xr.Dataset]:
    """The parts of the map that were simulated, by De and, fastest, volume fraction."""
    given = dataset.attrs["given"]
    for De in dataset["deborah"].values:
        for fraction in dataset[given].values:
            own = dataset.sel({"deborah": De, given: fraction})
            if np.isfinite(own["mean_spacing"]).any():
                yield own


def table(dataset: xr.Dataset) -> pd.DataFrame:
    """The map in the units of the bench: one row per De, volume fraction and channel length.

    Args:
        dataset: Result of `combine`.
    """
    return pd.concat(map(_rows, conditions(dataset)), ignore_index=True)


def _rows(own: xr.Dataset) -> pd.DataFrame:
    """The rows of one condition."""
    diameter = MICROMETRES * float(own["particle_diameter"])
    cm = CENTIMETRES * float(own["channel_diameter"])
    columns = {
        "deborah": float(own["deborah"]),
        "flow_rate_uL_per_min": float(own["flow_rate"]),
        "volume_fraction_percent": 100 * float(own["volume_fraction"]),
        "feed_volume_fraction_percent": 100 * float(own["feed_volume_fraction"]),
        "spheres_per_second": float(own["sphere_rate"]),
        "injection": own.attrs["injection"],
        "channel_length_D": own["station"].values,
        "channel_length_cm": own["length"].values,
        "pressure_drop_bar": own["pressure_drop"].values,
    }
    for name, column, factor in COLUMNS:
        for end in ("", *ERRORS):
            columns[column + end] = factor * own[name + end].values
        if f"{name}_injected" in own:
            columns[f"{column}_injected"] = factor * float(own[f"{name}_injected"])
    for name in ("mean_spacing", "spacing_mode"):
        columns[f"{name}_um"] = diameter * own[name].values
    for end in ("", "_earliest", "_latest"):
        length = float(own[f"ordered_position{end}"])
        columns |= {f"ordered_position{end}_D": length, f"ordered_position{end}_cm": cm * length}
    columns["memory_number"] = float(own["memory_number"])
    return pd.DataFrame(columns)


COLUMNS = (  # of the table: measure, its name there, factor
    ("mean_spacing", "mean_spacing_d", 1),
    ("spacing_mode", "spacing_mode_d", 1),
    ("spacing_variation", "spacing_variation", 1),
    ("even_share", "even_share_percent", 100),
    ("touching_share", "touching_share_percent", 100),
)


def headline(dataset: xr.Dataset) -> list[str]:
    """The condition with the most even spacing at the outlet, in lines of text."""
    outlets = [own.isel(station=-1) for own in conditions(dataset)]
    best = min(outlets, key=lambda own: float(own["spacing_variation"]))
    ordered = sum(math.isfinite(own["ordered_position"]) for own in outlets)
    rate = float(best["sphere_rate"])
    enter = f", {rate_in_words(rate)} spheres/s" if math.isfinite(rate) else ""
    return [
        f"ordered (coefficient of variation up to {float(dataset['ordered_variation']):g}) at "
        f"{ordered} of {len(outlets)} conditions, {dataset.attrs['injection']} injection"
        f"{unequal(dataset)};",
        f"the most even train, {with_errors(best, 'spacing_variation', 3)} (sampling, model), "
        f"at De = {float(best['deborah']):g},",
        f"phi = {100 * float(best['volume_fraction']):.3g} %, in the feed "
        f"{100 * float(best['feed_volume_fraction']):.3g} %{enter}",
        *_remarks(dataset),
    ]


def _remarks(dataset: xr.Dataset) -> list[str]:
    """Names the Deborah numbers with conditions beyond the quasi-steady range, if any."""
    rows = dataset.transpose("deborah", ...)
    names = [f"{De:g}" for De in rows["deborah"].values if memory.remark(rows.sel(deborah=De))]
    lines = [f"{BEYOND_QUASI_STEADY}: De {', '.join(names)}"] if names else []
    return [*lines, *filter(None, [dataset.attrs.get("channel")])]
