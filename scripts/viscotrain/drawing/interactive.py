"""One page to explore a study: any De, any train, in a browser, without a network.

The page asks nothing of a network, and its content security policy says so: a browser runs the two
scripts that the page holds, known by their hashes, and loads nothing. All text from a file is
escaped. The page holds plotly's JavaScript and, as JSON, the interpolant on a grid that is even on
the drawn axis (1 - 1/s), the nodes of the table, and the tracks of the first repeat of each train.
"""

import base64
import hashlib
import html
import itertools
import json
import re
import string
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import to_hex
from plotly.offline import get_plotlyjs

from viscotrain.drawing.conventions import DISTANCE_TICKS, distance_coordinate
from viscotrain.drawing.style import deborah_colour
from viscotrain.fluid.units import CENTIMETRES, MICROMETRES
from viscotrain.table.attributes import INTERPOLATED
from viscotrain.table.interpolation import TripletVelocities, VelocityTable
from viscotrain.table.memory import largest, remark
from viscotrain.table.pairs import pair_velocity
from viscotrain.table.points import holes
from viscotrain.trains.variables import rate_in_words, unequal, with_errors
from viscotrain.words import INACCURATE, NEGLIGIBLE, PARTICLES

GRID = 81  # points of the interpolant per axis
DIGITS = 4  # significant ones of a velocity
COLUMNS = {  # of the table of a train: statistic, decimals, factor
    "mean spacing [d]": ("mean_spacing", 2, 1.0),
    "most frequent [d]": ("spacing_mode", 1, 1.0),
    "CV": ("spacing_variation", 3, 1.0),
    "within 20 % of the mean [%]": ("even_share", 1, 100.0),
    "touching spheres [%]": ("touching_share", 1, 100.0),
}
POLICY_PLACE = "(policy)"  # until the scripts are known
SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
TEMPLATE = Path(__file__).with_suffix(".html")


class _Page(string.Template):
    """The template; its placeholders do not look like those of JavaScript."""

    delimiter = "@@"


def page(table: xr.Dataset, units: xr.Dataset, trains: Sequence[xr.Dataset], study: str) -> str:
    """HTML of the page.

    Args:
        table: The velocity table.
        units: Result of `units.physical_units`.
        trains: As `repeats.run_repeats` returns them.
        study: Its name.
    """
    grid = np.linspace(0.0, 1.0, GRID)
    ticks = np.array(DISTANCE_TICKS, dtype=float)
    data = {
        "grid": grid.round(6).tolist(),
        "ticks": {
            "at": distance_coordinate(ticks).tolist(),
            "text": ["\N{INFINITY}" if np.isinf(s) else f"{s:g}" for s in ticks],
        },
        "layers": list(_layers(table, grid)),
        "columns": ["z [D]", *COLUMNS],
        "trains": [_train(train, units) for train in trains],
    }
    text = _Page(TEMPLATE.read_text(encoding="utf-8")).substitute(
        policy=POLICY_PLACE,
        title=html.escape(f"viscotrain: study {study}"),
        plotly=get_plotlyjs(),
        particle=_micrometres(units["particle_diameter"]),
        channel=_channel(units),
        source=html.escape(f"{table.attrs.get('source', '')}; {table.attrs.get('history', '')}"),
        data=json.dumps(data, allow_nan=False).replace("<", "\\u003c"),
    )
    return text.replace(POLICY_PLACE, _policy(text), 1)


def _policy(text: str) -> str:
    """Content security policy of a page: its own scripts and styles, and nothing from elsewhere."""
    digests = (hashlib.sha256(own.encode()).digest() for own in SCRIPT.findall(text))
    scripts = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    rules = ["default-src 'none'", f"script-src {scripts}", "style-src 'unsafe-inline'"]
    return "; ".join([*rules, "img-src data:", "base-uri 'none'", "form-action 'none'"])


def _micrometres(diameter: xr.DataArray) -> str:
    """A diameter in mm in words."""
    return f"{MICROMETRES * float(diameter):.3g} um"


def _channel(units: xr.Dataset) -> str:
    """The channel's diameter, and what must be said of a duct."""
    remark = units.attrs.get("channel")
    return _micrometres(units["channel_diameter"]) + (f" ({remark})" if remark else "")


def _layers(table: xr.Dataset, grid: np.ndarray):
    """What is drawn at each De; without interpolant where the table has holes."""
    velocities = VelocityTable(table)
    missing = list(holes(table))
    colours = deborah_colour(velocities.deborah)
    with np.errstate(divide="ignore"):
        s = 1.0 / (1.0 - grid)
    for De, colour in zip(velocities.deborah, colours, strict=True):
        layer = table.sel(deborah=De).transpose("sp", "sf", "particle", ...)
        nodes = np.diff(layer["velocity"].sel(particle=list(PARTICLES)).values, axis=-1)
        lost = {(sp, sf) for at, sp, sf in missing if at == De}
        item: dict[str, Any] = {"name": f"{De:g}", "colour": to_hex(colour)}
        item["remark"] = _memory(layer)
        item |= {"surface": None, "pair": None}
        item["limit"] = float(np.nanmax(np.abs(nodes), initial=NEGLIGIBLE))
        if not lost:
            item |= _interpolated(velocities.at(De), s)
        item |= {"solved": [], "inaccurate": [], "holes": []}
        for (i, sp), (j, sf) in itertools.product(
            *map(enumerate, (table["sp"].values, table["sf"].values))
        ):
            if layer["origin"].values[i, j] == INTERPOLATED:
                continue
            rough = layer["status"].values[i, j] == INACCURATE
            kind = "holes" if (sp, sf) in lost else "inaccurate" if rough else "solved"
            words = [
                _words(sp, sf, value) + (", not accurate" if kind == "inaccurate" else "")
                for value in nodes[i, j]
            ]
            item[kind].append(
                [float(distance_coordinate(sp)), float(distance_coordinate(sf)), *words]
            )
        yield item


def _memory(layer: xr.Dataset) -> str:
    """What to say of the memory numbers at one De, if something is beyond the range."""
    words = remark(layer)
    return words and f"{words}: gaps change by up to {largest(layer):.2g} d in a relaxation time"


def _interpolated(velocities: TripletVelocities, s: np.ndarray) -> dict:
    """Relative velocities, rows along sf and columns along sp, and those of a pair alone."""
    surface = np.diff(velocities(s[:, None], s[None, :]), axis=-1)
    return {
        "surface": [_rounded(surface[..., n].T) for n in range(2)],
        "pair": _rounded(pair_velocity(velocities, s)),
        "limit": float(max(np.abs(surface).max(), NEGLIGIBLE)),
    }


def _rounded(values: np.ndarray) -> list:
    """Nested lists with `DIGITS` significant digits."""
    if values.ndim > 1:
        return [_rounded(row) for row in values]
    return [float(f"{value:.{DIGITS}g}") for value in values]


def _words(sp: float, sf: float, relative: float) -> str:
    value = "no solution" if np.isnan(relative) else f"{relative:.3e} Ubar"
    return f"sp = {sp:g}, sf = {sf:g}: {value}"


def _train(train: xr.Dataset, units: xr.Dataset) -> dict:
    """Tracks of successive spheres of the first repeat, against the position in the channel.

    Args:
        train: Result of `repeats.run_repeats`.
        units: Result of `units.physical_units`.
    """
    De, phi, feed = (
        float(train[name]) for name in ("deborah", "volume_fraction", "feed_volume_fraction")
    )
    stations = train["track_station"].values
    channel = float(units["channel_diameter"])
    words = remark(train)
    return {
        "name": f"De = {De:g}, volume fraction {100 * phi:.3g} %, in the feed {100 * feed:.3g} %"
        + (f", {words}" if words else ""),
        "entry": _entry(train, units),
        "statistics": list(_statistics(train)),
        "stations": stations.round(3).tolist(),
        "centimetres": (CENTIMETRES * channel * stations).round(3).tolist(),
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


def _statistics(train: xr.Dataset) -> Iterator[list[str]]:
    """A row per station, with both errors."""
    between = " \N{PLUS-MINUS SIGN} "
    for n, station in enumerate(train["station"].values):
        own = train.isel(station=n)
        words = [with_errors(own, *how, between=between) for how in COLUMNS.values()]
        yield [f"{station:g}", *words]
