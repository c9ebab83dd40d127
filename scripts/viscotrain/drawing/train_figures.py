"""The figures of trains: distributions of spacings, and spheres along the channel."""

import itertools
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from viscotrain.drawing.conventions import train_conditions
from viscotrain.drawing.style import BLUE, COLUMN, GREY, STYLE, VERMILLION, Drawing, styled
from viscotrain.trains.repeats import moving_frame
from viscotrain.trains.statistics import TOUCHING
from viscotrain.trains.variables import with_errors

DRAWN_LENGTH = 80.0  # of a train, in d
WORDS = 2.0  # width of what is written beside a panel, in inches


SCALARS = ["deborah", "confinement", "volume_fraction", "feed_volume_fraction"]
SCALARS += ["injection_rate", "memory_number"]


def kept(trains: xr.Dataset, measures: Sequence[str], others: Sequence[str] = ()) -> xr.Dataset:
    """What a figure shows of trains: measures with their errors, conditions, attributes of law."""
    names = [f"{name}{end}" for name in measures for end in ("", "_halfwidth", "_model_error")]
    rate = [name for name in ("sphere_rate",) if name in trains]
    data = trains[[*names, *others, *SCALARS, *rate]]
    data.attrs = {name: trains.attrs[name] for name in ("injection", "model_error")}
    return data


@styled
def spacing(trains: xr.Dataset) -> Drawing:
    """Distribution of the distances of successive spheres at each station, over all repeats."""
    measures = ["spacing_density", "mean_spacing", "spacing_mode", "spacing_variation"]
    measures += ["even_share", "touching_share"]
    injected = [f"{name}_injected" for name in measures if f"{name}_injected" in trains]
    data = kept(trains, measures, ["mean_spacing_law", *injected])
    stations = data["station"].values
    centres = data["spacing_bin"].values
    width = float(data["spacing_bin"].attrs["bin_width"])
    edges = np.append(centres - width / 2, centres[-1] + width / 2)
    figure = Figure(figsize=(COLUMN + WORDS, 1.2 + 0.8 * len(stations)), layout="constrained")
    figure.get_layout_engine().set(h_pad=0.02, hspace=0.0)
    panels = figure.subplots(len(stations), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    law = float(data["mean_spacing_law"])
    for n, axes in enumerate(panels):
        _draw_distribution(axes, data.isel(station=n), edges)
        mean = axes.axvline(law, color="black", lw=0.8, ls=(0, (4, 2)))
        axes.set_xlim(edges[0] - 2 * width, edges[-1])
        axes.xaxis.set_major_locator(MaxNLocator(8, integer=True, steps=[1, 2, 5, 10]))
        axes.yaxis.set_major_locator(MaxNLocator(3))
        axes.spines[["top", "right"]].set_visible(False)
    high = data["spacing_density"] + data["spacing_density_halfwidth"].fillna(0.0)
    panels[0].set_ylim(0.0, 1.05 * float(high.max()))
    panels[-1].set_xlabel("distance to the sphere ahead, $s^*$ [$d$]")
    figure.supylabel("probability density [$1/d$]", fontsize=STYLE["axes.labelsize"])
    figure.suptitle(train_conditions(data), fontsize=STYLE["axes.titlesize"])
    entries = [(mean, rf"equally spaced: ${_factor(trains)}\,(d/D)^2/\phi$ = {law:.2f} $d$")]
    entries += _keys(trains)
    figure.legend(*zip(*entries, strict=True), loc="outside lower center", ncols=2)
    return Drawing(figure, data)


def _keys(trains: xr.Dataset) -> list:
    """Legend of the injection law, and of both errors, as far as they are known."""
    variation = float(trains["spacing_variation_injected"])
    law = f"as the {trains.attrs['injection']} injection makes it, CV {variation:.2f}"
    entries: list = [(Line2D([], [], color=VERMILLION, lw=0.8, ls=(0, (1, 1))), law)]
    if (repeats := trains.sizes["repeat"]) > 1:
        band = Patch(facecolor=BLUE, alpha=0.3, lw=0)
        sampling = f"sampling error (95 %, {repeats} repeats), first \N{PLUS-MINUS SIGN}"
        entries.append((band, sampling))
    model = Patch(facecolor=BLUE, alpha=0.6, lw=0)
    return [*entries, (model, "model error (table and closure), last \N{PLUS-MINUS SIGN}")]


def _draw_distribution(axes: Axes, station: xr.Dataset, edges: NDArray):
    density = station["spacing_density"].values
    for end, alpha in (("_halfwidth", 0.3), ("_model_error", 0.6)):
        half = np.nan_to_num(station[f"spacing_density{end}"].values)
        low, high = np.maximum(density - half, 0), density + half
        axes.stairs(high, edges, baseline=low, fill=True, color=BLUE, alpha=alpha, lw=0)
    axes.stairs(density, edges, color=BLUE, lw=1.0)
    law = station["spacing_density_injected"].values
    axes.stairs(law, edges, color=VERMILLION, lw=0.8, ls=(0, (1, 1)), baseline=None)
    place = {"ha": "left", "va": "top", "transform": axes.transAxes}
    axes.text(1.02, 1.0, _measures(station), fontsize=6.5, linespacing=1.3, **place)


def _factor(trains: xr.Dataset) -> str:
    """That of the spacing law in the channel: 2/3 in a tube, less in a duct."""
    if "channel" not in trains.attrs:
        return r"\frac{2}{3}"
    own = trains["mean_spacing_law"] * trains["volume_fraction"] / trains["confinement"] ** 2
    return f"{float(own):.3f}"


def _measures(station: xr.Dataset) -> str:
    """Mean and mode, how even spacings are, share of touching spheres, in words."""

    def words(name: str, decimals: int, factor: float = 1.0) -> str:
        return with_errors(station, name, decimals, factor, " \N{PLUS-MINUS SIGN} ")

    mode = words("spacing_mode", 1)
    return (
        f"$z$ = {float(station['station']):g} $D$: mean {words('mean_spacing', 2)} $d$\n"
        f"mode {'none: flat' if mode == 'flat' else f'{mode} $d$'}\n"
        f"CV {words('spacing_variation', 3)}\n"
        f"within 20 % of mean {words('even_share', 1, 100)} %\n"
        f"touching spheres {words('touching_share', 1, 100)} %"
    )


@styled
def train(trains: xr.Dataset) -> Drawing:
    """Successive spheres against channel position, in a frame that moves with them."""
    tracks = ["track_time", "track_position"]
    data = kept(trains, [], tracks).transpose("track_sphere", "track_station", ...)
    entered = data["track_position"].values[:, 0]
    data = data.isel(track_sphere=entered > entered[0] - DRAWN_LENGTH)
    z = data["track_station"].values
    y = moving_frame(z, data["track_time"].values, float(data["confinement"]))
    data["track_position"] = data["track_position"].copy(data=y)  # in the frame of those drawn
    figure = Figure(figsize=(COLUMN, 4.6), layout="constrained")
    axes = figure.add_subplot()
    width = _one_diameter(figure, y)
    start = axes.hlines(y[:, 0], z[0], z[-1], color=GREY, lw=0.5, ls=(0, (1, 2)), zorder=1)
    entries = [(start, "as entered")]
    for pieces, colour, label in zip(
        _pieces(z, y),
        (BLUE, VERMILLION),
        ("sphere", f"touching ($s^*$ < {TOUCHING:g})"),
        strict=True,
    ):
        if pieces:
            axes.add_collection(LineCollection(pieces, colors=colour, linewidths=width))
            entries.append((Line2D([], [], color=colour, lw=2), label))
    axes.set(xlim=(z[0], z[-1]), ylim=(y.min() - 2, y.max() + 2))
    axes.set_xlabel("position along the channel, $z$ [$D$]")
    axes.set_ylabel("position in the frame of the train [$d$]\n(the flow is upwards)")
    axes.set_title(train_conditions(data))
    figure.legend(*zip(*entries, strict=True), loc="outside lower center", ncols=3)
    return Drawing(figure, data)


def _one_diameter(figure: Figure, y: NDArray) -> float:
    """Width of a line in points that is about as wide as a sphere."""
    points = 72 * 0.8 * figure.get_figheight() / (y.max() - y.min() + 4)
    return float(np.clip(points, 0.6, 4.0))


def _pieces(z: NDArray, y: NDArray) -> tuple[list[NDArray], list[NDArray]]:
    """Lines of all spheres from station to station: apart from others, and touching one.

    Args:
        z: Stations, shape (station,).
        y: Positions in the moving frame in d, the first sphere ahead, shape (sphere, station).
    """
    near = np.abs(np.diff(y, axis=0)) < TOUCHING
    touches = np.zeros(y.shape, dtype=bool)
    touches[1:] |= near
    touches[:-1] |= near
    alone: list[NDArray] = []
    touching: list[NDArray] = []
    for sphere, state in zip(y, touches, strict=True):
        cuts = [0, *(np.flatnonzero(state[1:] != state[:-1]) + 1), z.size - 1]
        for start, end in itertools.pairwise(cuts):
            piece = np.stack([z[start : end + 1], sphere[start : end + 1]], axis=-1)
            (touching if state[start] else alone).append(piece)
    return alone, touching
