"""One page to explore a study: any De, any train, in a browser, without a network.

The page asks nothing of a network, and its content security policy says so: a browser runs the two
scripts that the page holds, known by their hashes, and loads nothing. All text from a file is
escaped. The page holds plotly's JavaScript, packed, and, as JSON, the interpolant on a grid that is
even on the drawn axis (1 - 1/s), the nodes of the table with their errors, ordering lengths, and
the tracks of the first repeat of each train.
"""

import base64
import gzip
import hashlib
import html
import itertools
import json
import math
import re
import string
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.colors import to_hex
from plotly.offline import get_plotlyjs

from viscotrain.drawing.conventions import (
    DISTANCE_TICKS,
    SIGNED,
    distance_coordinate,
)
from viscotrain.drawing.style import BLUE, VERMILLION, deborah_colour
from viscotrain.drawing.train_figures import OCTAVES, WIDE_AND_CLOSE
from viscotrain.fluid.units import CENTIMETRES, MICROMETRES
from viscotrain.table.attributes import ERRORS, INTERPOLATED
from viscotrain.table.interpolation import TripletVelocities, VelocityTable
from viscotrain.table.memory import largest, remark
from viscotrain.table.pairs import pair_velocity
from viscotrain.table.points import holes, largest_error
from viscotrain.trains.design_map import BAR
from viscotrain.trains.statistics import TOUCHING
from viscotrain.trains.variables import rate_in_words, unequal, with_errors
from viscotrain.words import CONTACT, INACCURATE, NEGLIGIBLE, PAIRS, PARTICLES

GRID = 81  # points of the interpolant per axis
DIGITS = 4  # significant ones of a velocity
COLOURS = 33  # of a colour map, between which a browser interpolates
LENGTHS = "YlGnBu_r"  # colour map of ordering lengths

STATISTICS = {  # of the table of a train: name, decimals, factor, and whether it is a length in d
    "mean spacing": ("mean_spacing", 2, 1.0, True),
    "most frequent": ("spacing_mode", 1, 1.0, True),
    "CV": ("spacing_variation", 3, 1.0, False),
    "within 20 % of the mean [%]": ("even_share", 1, 100.0, False),
    "touching spheres [%]": ("touching_share", 1, 100.0, False),
}
POLICY_PLACE = "(policy)"  # until the scripts are known
SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
TEMPLATE = Path(__file__).with_suffix(".html")


class _Page(string.Template):
    """The template; its placeholders do not look like those of JavaScript."""

    delimiter = "@@"


def page(
    table: xr.Dataset,
    units: xr.Dataset,
    trains: Sequence[xr.Dataset],
    study: str,
    order: xr.Dataset | None = None,
    flow: xr.Dataset | None = None,
) -> str:
    """HTML of the page.

    Args:
        table: The velocity table.
        units: Result of `units.physical_units`.
        trains: As `repeats.run_repeats` returns them.
        study: Its name.
        order: Of `order.orders`; None for a page without ordering lengths.
        flow: Without spheres, of the stage `channel_flow`; None for one without pressures.
    """
    grid = np.linspace(0.0, 1.0, GRID)
    ticks = np.array(DISTANCE_TICKS, dtype=float)
    errors = [largest_error(table.sel(deborah=De)) for De in table["deborah"].values]
    library = get_plotlyjs()
    data = {
        "grid": grid.round(6).tolist(),
        "ticks": {"at": distance_coordinate(ticks).tolist(), "s": _numbers(ticks)},
        "closest": float(distance_coordinate(VelocityTable(table).smallest_distance)),
        "particle": MICROMETRES * float(units["particle_diameter"]),
        "channel": MICROMETRES * float(units["channel_diameter"]),
        "confinement": float(units["particle_diameter"] / units["channel_diameter"]),
        "colours": {
            "signed": _scale(SIGNED),
            "wide": _scale(WIDE_AND_CLOSE),
            "lengths": _scale(LENGTHS),
            "sphere": BLUE,
            "touching": VERMILLION,
        },
        "octaves": OCTAVES,
        "layers": [
            layer | _device(units, trains, flow, float(De)) | {"error": _number(error)}
            for layer, De, error in zip(
                _layers(table, grid), table["deborah"].values, errors, strict=True
            )
        ],
        "trains": [
            _train(train, units, dict(zip(table["deborah"].values, errors, strict=True)))
            for train in trains
        ],
        "order": None if order is None else _order(order),
    }
    text = _Page(TEMPLATE.read_text(encoding="utf-8")).substitute(
        policy=POLICY_PLACE,
        title=html.escape(f"viscotrain: study {study}"),
        plotly=base64.b64encode(gzip.compress(library.encode(), mtime=0)).decode(),
        particle=_micrometres(units["particle_diameter"]),
        channel=_channel(units),
        source=html.escape(f"{table.attrs.get('source', '')}; {table.attrs.get('history', '')}"),
        data=json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
    )
    return text.replace(POLICY_PLACE, _policy([library, *SCRIPT.findall(text)]), 1)


def _policy(own: Sequence[str]) -> str:
    """Content security policy of a page: its own scripts and styles, and nothing from elsewhere."""
    digests = (hashlib.sha256(script.encode()).digest() for script in own)
    scripts = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    rules = ["default-src 'none'", f"script-src {scripts}", "style-src 'unsafe-inline'"]
    return "; ".join([*rules, "img-src data:", "base-uri 'none'", "form-action 'none'"])


def _micrometres(diameter: xr.DataArray) -> str:
    """A diameter in mm in words."""
    return f"{MICROMETRES * float(diameter):.3g} um"


def _channel(units: xr.Dataset) -> str:
    """The channel's diameter, and what must be said of a duct."""
    remark = units.attrs.get("channel")
    return _micrometres(units["channel_diameter"]) + (f" ({html.escape(remark)})" if remark else "")


def _scale(name: str) -> list:
    """A colour map as plotly takes it."""
    places = np.linspace(0.0, 1.0, COLOURS)
    return [[float(x), to_hex(matplotlib.colormaps[name](x))] for x in places]


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
        f"flow rate {float(own['flow_rate']):.3g} \N{MICRO SIGN}L/min",
        f"mean velocity {1e3 * float(own['mean_velocity']):.3g} mm/s",
    ]
    if flow is not None and trains:
        words.append(_pressure(own, flow, float(trains[0]["channel_length"])))
    for train in trains:
        if float(train["deborah"]) == De:
            rate = rate_in_words(float(train["injection_rate"]) / float(own["time"]))
            words.append(
                f"{rate} spheres per second at {100 * float(train['volume_fraction']):.3g} %"
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
    return f"pressure drop {drop:.3g} bar along {length:g} D ({centimetres:.3g} cm)"


# ---------------------------------------------------------------------------- relative velocities


def _layers(table: xr.Dataset, grid: np.ndarray) -> Iterator[dict[str, Any]]:
    """What is drawn at each De; without interpolant where the table has holes."""
    velocities = VelocityTable(table)
    missing = list(holes(table))
    colours = deborah_colour(velocities.deborah)
    with np.errstate(divide="ignore"):
        s = 1.0 / (1.0 - grid)
    for De, colour in zip(velocities.deborah, colours, strict=True):
        layer = table.sel(deborah=De).transpose("sp", "sf", "particle", ...)
        lost = {(sp, sf) for at, sp, sf in missing if at == De}
        nodes = np.diff(layer["velocity"].sel(particle=list(PARTICLES)).values, axis=-1)
        item: dict[str, Any] = {"name": f"{De:g}", "colour": to_hex(colour)}
        item["remark"] = _memory(layer)
        item |= {"surface": None, "pair": None}
        item["limit"] = float(np.nanmax(np.abs(nodes), initial=NEGLIGIBLE))
        if not lost:
            item |= _interpolated(velocities.at(De), s)
        yield item | _nodes(layer, nodes, lost)


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
    words = remark(layer)
    return words and f"{words}: gaps change by up to {largest(layer):.2g} d in a relaxation time"


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
    """Ordering lengths in D over De and the volume fraction in %, ascending."""
    ascending = found.sortby("volume_fraction")
    return {
        "deborah": [f"{De:g}" for De in ascending["deborah"].values],
        "fraction": _numbers(100 * ascending["volume_fraction"].values),
        "spacing": _numbers(ascending["spacing"].values),
        "length": _numbers(ascending["ordering_length"].values),
        "stability": ascending["stability"].values.tolist(),
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
    De, phi, feed = (
        float(train[name]) for name in ("deborah", "volume_fraction", "feed_volume_fraction")
    )
    tracks = train[["track_time", "track_position"]].transpose("track_sphere", "track_station")
    stations, count = train["track_station"].values, train.sizes["track_sphere"]
    time = (tracks["track_time"] - tracks["track_time"].isel(track_station=0)).mean("track_sphere")
    first = train.isel(repeat=0)
    contact = first["contact_distance"].isel(passage=slice(1, count)).values
    words = remark(train)
    drift = errors.get(De, math.nan) * time.values / float(train["confinement"])
    return {
        "name": f"De = {De:g}, volume fraction {100 * phi:.3g} %, in the feed {100 * feed:.3g} %"
        + (f", {words}" if words else ""),
        "deborah": f"{De:g}",
        "fraction": 100 * phi,
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
    """What enters, by which law, and what model errors are made of."""
    De, rate = float(train["deborah"]), float(train["injection_rate"])
    known = De > 0 and De in units["deborah"].values
    enter = f"{rate:.3g} Ubar/D"
    if known:
        enter = f"{rate_in_words(rate / float(units['time'].sel(deborah=De)))} per second"
    touching = 100 * float(train["touching_share_injected"])
    injected = float(train["spacing_variation_injected"])
    return (
        f"Spheres enter by the {train.attrs['injection']} law{unequal(train)}, {enter}: it makes "
        f"a CV of {injected:.2f} and {touching:.1f} % touching spheres. "
        f"Model errors from {train.attrs['model_error']}."
    )


def _columns(physical: bool) -> Iterator[str]:
    """Heads of the table of a train, in d and D or in um and cm."""
    yield "z [cm]" if physical else "z [D]"
    for name, (*_, is_length) in STATISTICS.items():
        unit = " [\N{MICRO SIGN}m]" if physical else " [d]"
        yield name + unit * is_length


def _statistics(train: xr.Dataset, units: xr.Dataset, physical: bool) -> Iterator[list[str]]:
    """A row per station, with both errors, in d and D or in um and cm."""
    between = " \N{PLUS-MINUS SIGN} "
    size = MICROMETRES * float(units["particle_diameter"])
    for n, station in enumerate(train["station"].values):
        own, row = train.isel(station=n), [f"{station:g}"]
        if physical:
            row = [f"{station * CENTIMETRES * float(units['channel_diameter']):.3g}"]
        for name, decimals, factor, is_length in STATISTICS.values():
            how = (1, factor * size) if physical and is_length else (decimals, factor)
            row.append(with_errors(own, name, *how, between=between))
        yield row
