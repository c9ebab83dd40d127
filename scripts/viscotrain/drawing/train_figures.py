"""The figures of trains: distributions of spacings, and spheres along the channel."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from viscotrain.drawing.conventions import SIGNED, train_conditions
from viscotrain.drawing.style import BLUE, PAGE, SMALL, STYLE, VERMILLION, Drawing, styled
from viscotrain.trains.measured import DENSITIES, probability
from viscotrain.trains.measured import WORDS as MEASURED_WORDS
from viscotrain.trains.statistics import TOUCHING
from viscotrain.trains.variables import with_errors
from viscotrain.words import CONTACT, NEGLIGIBLE

OCTAVES = 2  # of distances, drawn below and above that of an equally spaced train
WIDE_AND_CLOSE = "PuOr_r"

MEASURED = [*MEASURED_WORDS, *DENSITIES, "measured_spacing", "measured_station"]
SCALARS = ["deborah", "confinement", "volume_fraction", "feed_volume_fraction"]
SCALARS += ["injection_rate", "memory_number", "diameter_variation"]


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
    others = [name for name in MEASURED if name in trains]
    data = kept(trains, measures, ["mean_spacing_law", *injected, *others])
    stations = data["station"].values
    centres = data["spacing_bin"].values
    width = float(data["spacing_bin"].attrs["bin_width"])
    edges = np.append(centres - width / 2, centres[-1] + width / 2)
    height = 1.2 + (0.9 if others else 0.8) * len(stations)
    figure = Figure(figsize=(PAGE, height), layout="constrained")
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
    highest = float(high.max())
    if others:
        measured = data["measured_density"] + data["measured_density_error"]
        highest = np.nanmax([highest, float(measured.max())])
    panels[0].set_ylim(0.0, 1.05 * highest)
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
    entries.append((model, "model error (table and closure), last \N{PLUS-MINUS SIGN}"))
    if "measured_density" in trains:
        points = Line2D([], [], color="black", marker="o", ms=2.5, ls="")
        entries.append((points, "measured, \N{PLUS-MINUS SIGN} root of the count"))
    return entries


def _draw_distribution(axes: Axes, station: xr.Dataset, edges: NDArray):
    density = station["spacing_density"].values
    for end, alpha in (("_halfwidth", 0.3), ("_model_error", 0.6)):
        half = np.nan_to_num(station[f"spacing_density{end}"].values)
        low, high = np.maximum(density - half, 0), density + half
        axes.stairs(high, edges, baseline=low, fill=True, color=BLUE, alpha=alpha, lw=0)
    axes.stairs(density, edges, color=BLUE, lw=1.0)
    law = station["spacing_density_injected"].values
    axes.stairs(law, edges, color=VERMILLION, lw=0.8, ls=(0, (1, 1)), baseline=None)
    if "measured_density" in station:
        _draw_measured(axes, station)
    place = {"ha": "left", "va": "top", "transform": axes.transAxes}
    axes.text(1.02, 1.0, _measures(station), fontsize=SMALL, linespacing=1.3, **place)


def _draw_measured(axes: Axes, station: xr.Dataset):
    """Measured densities with the width of their bins and the error of counting."""
    density, error = (station[name].values for name in DENSITIES)
    some = np.nan_to_num(density) > 0
    half = float(station["measured_bin"].attrs["bin_width"]) / 2
    style = {"color": "black", "ls": "", "marker": "o", "ms": 2.5, "elinewidth": 0.6}
    axes.errorbar(station["measured_bin"].values[some], density[some], error[some], half, **style)


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
        f"touching spheres {words('touching_share', 1, 100)} %" + _distance_in_words(station)
    )


def _distance_in_words(station: xr.Dataset) -> str:
    """How far the measured spacings are, on a line of their own; empty without some."""
    if not float(station.get("measured_count", 0)):
        return ""
    p = probability(float(station["ks_p_value"]))
    return (
        f"\nmeasured {int(station['measured_count'])}: KS {float(station['ks_distance']):.3f}, {p}"
    )


@styled
def train(trains: xr.Dataset) -> Drawing:
    """Distances of successive spheres along the channel, and what became of them since the entry.

    A row is a sphere, in order of passage: left its distance to the sphere ahead over that of an
    equally spaced train, black where they touch; right the change of this distance.
    """
    data = kept(trains, [], ["track_time", "track_position", "mean_spacing_law"])
    data = data.transpose("track_sphere", "track_station", ...)
    ahead = -data["track_position"].diff("track_sphere", label="upper")
    ahead = ahead.assign_coords(track_sphere=np.arange(2, ahead.sizes["track_sphere"] + 2))
    ahead.attrs = {"long_name": "distance to the sphere ahead over diameter", "units": "1"}
    data = data.drop_vars(["track_time", "track_position"]).assign(track_spacing=ahead)
    s, law = ahead.values, float(data["mean_spacing_law"])
    contact = trains["contact_distance"].isel(repeat=0, passage=slice(1, len(s) + 1))
    touching = s < TOUCHING + (contact.values[:, None] - CONTACT)
    z, number = data["track_station"].values, data["track_sphere"].values
    figure = Figure(figsize=(PAGE, 4.0), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(touching, np.nan, np.log2(np.maximum(s, 1) / law))
    change = s - s[:, :1]
    most = max(float(np.abs(change).max()), NEGLIGIBLE)
    left = _draw_rows(panels[0], z, number, ratio, OCTAVES, WIDE_AND_CLOSE)
    right = _draw_rows(panels[1], z, number, change, most, SIGNED)
    panels[0].set_ylabel("sphere, in order of passage")
    titles = "distance to the sphere ahead", "its change since the entry"
    for axes, title in zip(panels, titles, strict=True):
        axes.set_xlabel("position along the channel, $z$ [$D$]")
        axes.set_title(title, loc="left")
    panels[0].invert_yaxis()
    bar = figure.colorbar(left, ax=panels[0], location="bottom", aspect=30, extend="both")
    ticks = np.arange(-OCTAVES, OCTAVES + 1)
    bar.set_ticks(ticks, labels=[f"{law * 2.0**n:.2g}" for n in ticks])
    bar.set_label(f"$s^*$ [$d$]; white: equally spaced, {law:.2f}; black: touching")
    bar = figure.colorbar(right, ax=panels[1], location="bottom", aspect=30)
    bar.set_label("change of $s^*$ [$d$]; red: the gap has opened")
    figure.suptitle(train_conditions(data), fontsize=STYLE["axes.titlesize"])
    return Drawing(figure, data)


def _draw_rows(axes: Axes, z: NDArray, number: NDArray, values: NDArray, most: float, cmap: str):
    """A row for each sphere, colours centred at zero; black where there is no value."""
    axes.set_facecolor("black")
    style = {"cmap": cmap, "vmin": -most, "vmax": most, "shading": "nearest", "rasterized": True}
    return axes.pcolormesh(z, number, np.ma.masked_invalid(values), **style)
