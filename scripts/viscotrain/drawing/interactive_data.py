"""What the interactive page holds: velocities, ordering lengths and trains, as JSON takes them.

The interpolant is on a grid that is even on the drawn axis (1 - 1/s); beside it are the nodes of
the table with their errors, ordering lengths, and the tracks of the first repeat of each train.
Where the table has holes there is no interpolant and no ordering length, and `missing` says so.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.colors import to_hex

from viscotrain.drawing.conventions import (
    DISTANCE_TICKS,
    INJECTIONS,
    ORDERING,
    ORDERING_LIMITS,
    ORDERING_TICKS,
    SIGNED,
    beyond,
    distance_coordinate,
    power_of_ten,
)
from viscotrain.drawing.relative_velocities import WIDEST
from viscotrain.drawing.style import BLUE, VERMILLION, deborah_look
from viscotrain.drawing.train_figures import DARKEST, WIDE_AND_CLOSE
from viscotrain.fluid.units import CENTIMETRES, MICROMETRES
from viscotrain.table.attributes import ERRORS, INTERPOLATED
from viscotrain.table.interpolation import TripletVelocities, VelocityTable
from viscotrain.table.memory import largest
from viscotrain.table.pairs import pair_velocity, tabulated_pair_velocity
from viscotrain.table.points import holes, largest_error
from viscotrain.trains.design_map import BAR
from viscotrain.trains.statistics import TOUCHING
from viscotrain.trains.variables import amounts_in_words, in_digits, unequal, with_errors
from viscotrain.words import CONTACT, INACCURATE, NEGLIGIBLE, PAIRS, PARTICLES

GRID = 81  # points of the interpolant per axis
DIGITS = 4  # significant ones of a velocity
COLOURS = 33  # of a colour map, between which a browser interpolates
DARK_SIGNED = "#92C5DE", "#2166AC", "#16181C", "#B2182B", "#F4A582"  # as RdBu_r, dark at zero
SYMBOLS = {"o": "circle", "s": "square", "D": "diamond", "^": "triangle-up", "v": "triangle-down"}
SYMBOLS |= {"P": "cross", "*": "star", "X": "x", "h": "hexagon"}  # plotly's, of matplotlib's
MICRO = "\N{MICRO SIGN}"

STATISTICS = {  # of the table of a train: name, decimals, factor, and whether it is a length in d
    "mean spacing": ("mean_spacing", 2, 1.0, True),
    "most frequent": ("spacing_mode", 1, 1.0, True),
    "CV": ("spacing_variation", 3, 1.0, False),
    "within 20 % of the mean [%]": ("even_share", 1, 100.0, False),
    "touching spheres [%]": ("touching_share", 1, 100.0, False),
}


def page_data(
    table: xr.Dataset,
    units: xr.Dataset,
    trains: Sequence[xr.Dataset],
    order: xr.Dataset | None,
    flow: xr.Dataset | None,
) -> dict[str, Any]:
    """All of it; arguments are those of `interactive.page`."""
    errors = [largest_error(table.sel(deborah=De)) for De in table["deborah"].values]
    layers = [
        layer | _device(units, trains, flow, float(De)) | {"error": _number(error)}
        for layer, De, error in zip(_layers(table), table["deborah"].values, errors, strict=True)
    ]
    ticks = np.array(DISTANCE_TICKS, dtype=float)
    return {
        "grid": _grid().round(6).tolist(),
        "ticks": {"at": distance_coordinate(ticks).tolist(), "s": _numbers(ticks)},
        "closest": float(distance_coordinate(VelocityTable(table).smallest_distance)),
        "particle": MICROMETRES * float(units["particle_diameter"]),
        "channel": MICROMETRES * float(units["channel_diameter"]),
        "confinement": float(units["particle_diameter"] / units["channel_diameter"]),
        "widest": WIDEST,
        "power": power_of_ten(max(layer["limit"] for layer in layers)),
        "colours": {
            "signed": _scale(SIGNED),
            "signed_dark": _even(DARK_SIGNED),
            "wide": _scale(WIDE_AND_CLOSE, DARKEST),
            "lengths": _scale(ORDERING),
            "sphere": BLUE,
            "touching": VERMILLION,
        },
        "lengths": {"limits": ORDERING_LIMITS, "ticks": ORDERING_TICKS},
        "missing": _missing(table),
        "layers": layers,
        "trains": [
            _train(train, units, dict(zip(table["deborah"].values, errors, strict=True)))
            for train in trains
        ],
        "order": None if order is None else _order(order),
    }


def _scale(name: str, cut: float = 0.0) -> list:
    """A colour map as plotly takes it, without so much of it at both ends."""
    places = np.linspace(cut, 1.0 - cut, COLOURS)
    return _even([to_hex(matplotlib.colormaps[name](x)) for x in places])


def _even(colours: Sequence[str]) -> list:
    """Colours at even places."""
    return [[n / (len(colours) - 1), colour] for n, colour in enumerate(colours)]


def _grid() -> np.ndarray:
    """Places on the drawn axis, from contact to infinity."""
    return np.linspace(0.0, 1.0, GRID)


def _number(value) -> float | None:
    """A number with `DIGITS` significant digits; None where there is none."""
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None


def _numbers(values: np.ndarray) -> list:
    """Nested lists of numbers."""
    return [_numbers(row) if np.ndim(row) else _number(row) for row in values]


# ---------------------------------------------------------------------------------------- device


def _device(
    units: xr.Dataset, trains: Sequence[xr.Dataset], flow: xr.Dataset | None, De: float
) -> dict[str, Any]:
    """What one De is in the channel of the study, in words, and factors; None where unknown."""
    if not (De > 0 and De in units["deborah"].values):
        return {"speed": None, "seconds": None, "device": []}
    own = units.sel(deborah=De)
    words = [
        f"flow rate {in_digits(float(own['flow_rate']))} {MICRO}L/min",
        f"mean velocity {in_digits(1e3 * float(own['mean_velocity']))} mm/s",
    ]
    if flow is not None and trains:
        words.append(_pressure(own, flow, float(trains[0]["channel_length"])))
    for train in trains:
        if float(train["deborah"]) == De:
            rate = in_digits(float(train["injection_rate"]) / float(own["time"]))
            words.append(
                f"{rate} spheres per second at {100 * float(train['volume_fraction']):.2g} %"
            )
    speed = float(own["mean_velocity"]) * 1e6  # um/s
    return {"speed": speed, "seconds": float(own["time"]), "device": words}


def _pressure(units: xr.Dataset, flow: xr.Dataset, length: float) -> str:
    """Pressure drop of the flow without spheres along the channel, G L in eta_0 Ubar/D, in words.

    Args:
        units: At one De.
        flow: At all.
        length: L of the channel in D.
    """
    gradient = float(flow["pressure_gradient"].sel(deborah=units["deborah"]))
    drop = BAR * gradient * length * float(units["stress"])
    centimetres = CENTIMETRES * length * float(units["channel_diameter"])
    return f"pressure drop {in_digits(drop)} bar along {length:g} D ({centimetres:.3g} cm)"


# ---------------------------------------------------------------------------- relative velocities


def _missing(table: xr.Dataset) -> str:
    """What the page cannot show, in words; empty if nothing is missing."""
    lost = [De for De, *_ in holes(table)]
    words = [f"De = {De:g} ({lost.count(De)})" for De in sorted(set(lost))]
    if not words:
        return ""
    return (
        f"Points of the table without a solution: {', '.join(words)}. Nothing is interpolated "
        "there, and no ordering length is known."
    )


def _layers(table: xr.Dataset) -> Iterator[dict[str, Any]]:
    """What is drawn at each De; without interpolant where the table has holes."""
    velocities = VelocityTable(table)
    missing = list(holes(table))
    with np.errstate(divide="ignore"):
        s = 1.0 / (1.0 - _grid())
    for De in velocities.deborah:
        layer = table.sel(deborah=De).transpose("sp", "sf", "particle", ...)
        lost = {(sp, sf) for at, sp, sf in missing if at == De}
        nodes = np.diff(layer["velocity"].sel(particle=list(PARTICLES)).values, axis=-1)
        look = deborah_look(De)
        item: dict[str, Any] = {"name": f"{De:g}", "colour": to_hex(look["color"])}
        item |= {"symbol": SYMBOLS[look["marker"]], "remark": _memory(layer)}
        item |= {"surface": None, "pair": None, "pairs": _pairs(layer)}
        item["limit"] = float(np.nanmax(np.abs(nodes), initial=NEGLIGIBLE))
        if not lost:
            item |= _interpolated(velocities.at(De), s)
        yield item | _nodes(layer, nodes, lost)


def _pairs(layer: xr.Dataset) -> list[list]:
    """Simulated pairs: place, distance, relative velocity, error, whether it is accurate."""
    distance, U = layer["pair_distance"].values, tabulated_pair_velocity(layer)
    errors = layer["pair_error"].values if "pair_error" in layer else np.full(U.shape, np.nan)
    fine = layer["pair_status"].values != INACCURATE
    rows = zip(distance, U, errors, fine, strict=True)
    return [
        [float(distance_coordinate(s)), *map(_number, (s, value, error)), bool(accurate)]
        for s, value, error, accurate in rows
        if math.isfinite(value)
    ]


def _nodes(layer: xr.Dataset, relative: np.ndarray, lost: set) -> dict[str, list]:
    """Simulated points by their kind: places, distances, two relative velocities, two errors."""
    errors = np.full(relative.shape, np.nan)
    if ERRORS[1] in layer:
        own = layer[ERRORS[1]].sel(pair=list(PAIRS)).transpose("sp", "sf", "pair")
        errors = own.values
    found: dict[str, list] = {"solved": [], "inaccurate": [], "holes": []}
    for (i, sp), (j, sf) in itertools.product(
        *map(enumerate, (layer["sp"].values, layer["sf"].values))
    ):
        if layer["origin"].values[i, j] == INTERPOLATED:
            continue
        rough = layer["status"].values[i, j] == INACCURATE
        kind = "holes" if (sp, sf) in lost else "inaccurate" if rough else "solved"
        place = [float(distance_coordinate(s)) for s in (sp, sf)]
        numbers = [_number(value) for value in (sp, sf, *relative[i, j], *errors[i, j])]
        found[kind].append(place + numbers)
    return found


def _memory(layer: xr.Dataset) -> str:
    """What to say of the memory numbers at one De, if something is beyond the range."""
    words = beyond(layer)
    return words and f"{words}, gaps change by up to {largest(layer):.2g} d in a relaxation time"


def _interpolated(velocities: TripletVelocities, s: np.ndarray) -> dict:
    """Relative velocities, rows along sf and columns along sp, and those of a pair alone."""
    surface = np.diff(velocities(s[:, None], s[None, :]), axis=-1)
    return {
        "surface": [_numbers(surface[..., n].T) for n in range(2)],
        "pair": _numbers(pair_velocity(velocities, s)),
        "limit": float(max(np.abs(surface).max(), NEGLIGIBLE)),
    }


# ----------------------------------------------------------------------------------------- order


def _order(found: xr.Dataset) -> dict:
    """Ordering lengths in D over De and the volume fraction in %, ascending; that of the channel.

    A length is none where it is infinite; stability is none where it is not known.
    """
    ascending = found.sortby("volume_fraction")
    return {
        "deborah": [f"{De:g}" for De in ascending["deborah"].values],
        "fraction": _numbers(100 * ascending["volume_fraction"].values),
        "spacing": _numbers(ascending["spacing"].values),
        "length": _numbers(ascending["ordering_length"].values),
        "stability": _numbers(ascending["stability"].values),
        "channel": float(found["length"]),
    }


# ---------------------------------------------------------------------------------------- trains


def _train(train: xr.Dataset, units: xr.Dataset, errors: dict[float, float]) -> dict:
    """Tracks of successive spheres of the first repeat, against the position in the channel.

    Args:
        train: Result of `repeats.run_repeats`.
        units: Result of `units.physical_units`.
        errors: Of the table's relative velocities, in Ubar, by De.

    Returns:
        Positions in d; `drift` in d, by how much the table's error E may have changed a gap since
        the entry: E t/beta after a time t in D/Ubar.
    """
    De, phi = float(train["deborah"]), 100 * float(train["volume_fraction"])
    tracks = train[["track_time", "track_position"]].transpose("track_sphere", "track_station")
    stations, count = train["track_station"].values, train.sizes["track_sphere"]
    time = (tracks["track_time"] - tracks["track_time"].isel(track_station=0)).mean("track_sphere")
    first = train.isel(repeat=0)
    contact = first["contact_distance"].isel(passage=slice(1, count)).values
    drift = errors.get(De, math.nan) * time.values / float(train["confinement"])
    return {
        "name": f"De = {De:g}, \N{GREEK SMALL LETTER PHI} = {phi:.2g} %",
        "remark": beyond(train),
        "deborah": f"{De:g}",
        "fraction": phi,
        "entry": _entry(train, units),
        "columns": list(_columns(False)),
        "statistics": list(_statistics(train, units, False)),
        "columns_physical": list(_columns(True)),
        "statistics_physical": list(_statistics(train, units, True)),
        "stations": stations.round(3).tolist(),
        "time": _numbers(time.values),
        "drift": _numbers(drift),
        "law": float(train["mean_spacing_law"]),
        "near": (TOUCHING + contact - CONTACT).round(4).tolist(),
        "diameters": first["diameter"].isel(passage=slice(0, count)).values.round(3).tolist(),
        "positions": train["track_position"].values.round(3).tolist(),
    }


def _entry(train: xr.Dataset, units: xr.Dataset) -> str:
    """What enters, and by which law."""
    De, rate = float(train["deborah"]), float(train["injection_rate"])
    phi, feed = amounts_in_words(train)
    known = De > 0 and De in units["deborah"].values
    enter = f"{rate:.2g} in a time D/\N{LATIN CAPITAL LETTER U WITH MACRON}"
    if known:
        enter = f"{in_digits(rate / float(units['time'].sel(deborah=De)))} spheres per second"
    touching = 100 * float(train["touching_share_injected"])
    injected = float(train["spacing_variation_injected"])
    law = INJECTIONS.get(train.attrs["injection"], train.attrs["injection"])
    return (
        f"Spheres are {phi} % of the volume in the channel, {feed} % in the feed. "
        f"Injection: {law}{unequal(train)}, {enter}; this makes a CV of {injected:.2f} and "
        f"{touching:.1f} % touching spheres."
    )


def _columns(physical: bool) -> Iterator[str]:
    """Heads of the table of a train, in d and D or in um and cm."""
    yield "z [cm]" if physical else "z [D]"
    for name, (*_, is_length) in STATISTICS.items():
        unit = f" [{MICRO}m]" if physical else " [d]"
        yield name + unit * is_length


def _as_known(station: xr.Dataset, name: str, factor: float) -> int:
    """Decimals of a length, none where its errors are above one; at most one."""
    ends = [f"{name}{end}" for end in ("_halfwidth", "_model_error")]
    return 0 if any(factor * float(station[end]) >= 1 for end in ends if end in station) else 1


def _statistics(train: xr.Dataset, units: xr.Dataset, physical: bool) -> Iterator[list[str]]:
    """A row per station, with both errors, in d and D or in um and cm."""
    between = " \N{PLUS-MINUS SIGN} "
    size = MICROMETRES * float(units["particle_diameter"])
    for n, station in enumerate(train["station"].values):
        own, row = train.isel(station=n), [f"{station:g}"]
        if physical:
            row = [f"{station * CENTIMETRES * float(units['channel_diameter']):.3g}"]
        for name, decimals, factor, is_length in STATISTICS.values():
            how = (decimals, factor)
            if physical and is_length:
                how = (_as_known(own, name, factor * size), factor * size)
            row.append(with_errors(own, name, *how, between=between))
        yield row
