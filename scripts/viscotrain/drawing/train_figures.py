"""The figures of trains: distributions of spacings, and spheres along the channel."""

import math
from collections.abc import Sequence

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from viscotrain.drawing.conventions import (
    BELOW_ERROR,
    INJECTIONS,
    POSITION,
    SIGNED,
    train_conditions,
)
from viscotrain.drawing.style import BLUE, GREY, PAGE, SMALL, STYLE, VERMILLION, Drawing, styled
from viscotrain.trains.measured import DENSITIES, probability
from viscotrain.trains.measured import WORDS as MEASURED_WORDS
from viscotrain.trains.statistics import TOUCHING
from viscotrain.trains.variables import with_errors
from viscotrain.words import CONTACT, NEGLIGIBLE

BEYOND = 1.1  # the axis of distances, over the largest of them
WIDE_AND_CLOSE = "PuOr_r"
DARKEST = 0.12  # of it at both ends is left out, where purple is as good as black
ROUND_DISTANCES = (1, 1.5, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 100)  # d, on the colour bar
DOTTED = (0, (1, 1))

MEASURED = [*MEASURED_WORDS, *DENSITIES, "measured_spacing", "measured_station"]
SCALARS = ["deborah", "confinement", "volume_fraction", "feed_volume_fraction"]
SCALARS += ["injection_rate", "memory_number", "diameter_variation"]
OF_LAW = "injection", "given", "model_error"  # attributes of trains


def kept(trains: xr.Dataset, measures: Sequence[str], others: Sequence[str] = ()) -> xr.Dataset:
    """What a figure shows of trains: measures with their errors, conditions, attributes of law."""
    names = [f"{name}{end}" for name in measures for end in ("", "_halfwidth", "_model_error")]
    rate = [name for name in ("sphere_rate",) if name in trains]
    data = trains[[*names, *others, *SCALARS, *rate]]
    data.attrs = {name: trains.attrs[name] for name in OF_LAW}
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
    figure = Figure(figsize=(PAGE, 1.2 + 0.8 * len(stations)), layout="constrained")
    figure.get_layout_engine().set(h_pad=0.02, hspace=0.0)
    panels = figure.subplots(len(stations), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    law = float(data["mean_spacing_law"])
    for n, axes in enumerate(panels):
        _draw_distribution(axes, data.isel(station=n))
        near = axes.axvspan(CONTACT, TOUCHING, facecolor=VERMILLION, alpha=0.4, lw=0)
        mean = axes.axvline(law, color="black", lw=0.8, ls=(0, (4, 2)))
        axes.yaxis.set_major_locator(MaxNLocator(3))
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set(xlim=(0.5, BEYOND * _largest(data)), ylim=(0.0, 1.05 * _highest(data)))
    panels[0].set_xticks(_distance_ticks(BEYOND * _largest(data)))
    panels[-1].set_xlabel("distance to the sphere ahead, $s$ [$d$]")
    figure.supylabel("probability density [$1/d$]", fontsize=STYLE["axes.labelsize"])
    figure.suptitle(train_conditions(data), fontsize=STYLE["axes.titlesize"])
    entries = [(mean, rf"equally spaced: ${_factor(trains)}\,d\,(d/D)^2/\phi$ = {law:.3g} $d$")]
    entries += [*_keys(trains), (near, f"touching: closer than {TOUCHING:g} $d$")]
    figure.legend(*zip(*entries, strict=True), loc="outside lower center", ncols=2)
    return Drawing(figure, data)


def _distance_ticks(largest: float) -> NDArray:
    """Round distances, and contact."""
    even = MaxNLocator(8, integer=True, steps=[1, 2, 5, 10]).tick_values(0, largest)
    return np.array([CONTACT, *(tick for tick in even if CONTACT < tick <= largest)])


def _largest(data: xr.Dataset) -> float:
    """End of the last bin that holds a distance, simulated or measured."""
    density = data[["spacing_density", "spacing_density_injected"]].to_array()
    some = (density > 0).any([name for name in density.dims if name != "spacing_bin"])
    bins = data["spacing_bin"]
    largest = float(bins[some.values].max() + bins.attrs["bin_width"] / 2)
    if "measured_density" in data:
        measured = data["measured_bin"].where(data["measured_density"] > 0)
        largest = np.nanmax([largest, float(measured.max())])
    return largest


def _highest(data: xr.Dataset) -> float:
    """The highest density, with its larger error."""
    half, model = (
        data[f"spacing_density{end}"].fillna(0.0) for end in ("_halfwidth", "_model_error")
    )
    highest = float((data["spacing_density"] + np.maximum(half, model)).max())
    if "measured_density" in data:
        measured = data["measured_density"] + data["measured_density_error"]
        highest = np.nanmax([highest, float(measured.max())])
    return highest


def _keys(trains: xr.Dataset) -> list:
    """Legend of the injection law, and of both errors, as far as they are known."""
    variation = float(trains["spacing_variation_injected"])
    law = f"as they enter, {INJECTIONS[trains.attrs['injection']]}: CV {variation:.2f}"
    entries: list = [(Line2D([], [], color=GREY, lw=1, ls=DOTTED), law)]
    if (repeats := trains.sizes["repeat"]) > 1:
        band = Patch(facecolor=BLUE, alpha=0.3, lw=0)
        sampling = f"sampling error (95 %, {repeats} repeats), first \N{PLUS-MINUS SIGN}"
        entries.append((band, sampling))
    model = Line2D([], [], color="black", marker="|", ms=6, lw=0, mew=1)
    which = "second" if repeats > 1 else "after"
    words = f"model error (velocities), {which} \N{PLUS-MINUS SIGN} unless it rounds to 0"
    entries.append((model, words))
    if "measured_density" in trains:
        points = Line2D([], [], color="black", marker="o", ms=2.5, ls="")
        entries.append((points, "measured, \N{PLUS-MINUS SIGN} root of the count"))
    return entries


def _draw_distribution(axes: Axes, station: xr.Dataset):
    centres, width = station["spacing_bin"].values, station["spacing_bin"].attrs["bin_width"]
    edges = np.append(centres - width / 2, centres[-1] + width / 2)
    density = station["spacing_density"].values
    half, model = (
        np.nan_to_num(station[f"spacing_density{end}"].values)
        for end in ("_halfwidth", "_model_error")
    )
    band = {"fill": True, "color": BLUE, "alpha": 0.3, "lw": 0}
    axes.stairs(density + half, edges, baseline=np.maximum(density - half, 0), **band)
    axes.stairs(density, edges, color=BLUE, lw=1.0)
    axes.vlines(centres, np.maximum(density - model, 0), density + model, color="black", lw=0.8)
    law = station["spacing_density_injected"].values
    axes.stairs(law, edges, color=GREY, lw=1, ls=DOTTED, baseline=None)
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
    """How even the spacings are, and the share of touching spheres, in words."""

    def words(name: str, decimals: int, factor: float = 1.0) -> str:
        error = f"{name}_model_error"
        left_out = factor * float(station[error]) < 10.0**-decimals / 2  # it rounds to 0
        own = station.drop_vars(error) if left_out else station
        return with_errors(own, name, decimals, factor, " \N{PLUS-MINUS SIGN} ")

    return (
        f"$z$ = {float(station['station']):g} $D$\n"
        f"CV {words('spacing_variation', 3)}\n"
        f"touching {words('touching_share', 1, 100)} %" + _distance_in_words(station)
    )


def _distance_in_words(station: xr.Dataset) -> str:
    """How far the measured spacings are, on a line of their own; empty without some."""
    if not float(station.get("measured_count", 0)):
        return ""
    p = probability(float(station["ks_p_value"]))
    return (
        f"\nmeasured {int(station['measured_count'])}: KS {float(station['ks_distance']):.2f}, {p}"
    )


@styled
def train(trains: xr.Dataset) -> Drawing:
    """Distances of successive spheres along the channel, and what became of them since the entry.

    A row is a sphere, in order of passage: left its distance to the sphere ahead, from contact to
    the largest one, white where it is that of an equally spaced train, black where they touch;
    right the change of this distance, hatched where it is below the error of the velocities, which
    may have changed a gap by E t/beta in a time t.
    """
    data = _with_rows(trains)
    s, law = data["track_spacing"].values, float(data["mean_spacing_law"])
    contact = trains["contact_distance"].isel(repeat=0, passage=slice(1, len(s) + 1))
    touching = s < TOUCHING + (contact.values[:, None] - CONTACT)
    figure = Figure(figsize=(PAGE, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    left.set_facecolor("black")
    ratio = np.log(np.where(touching, np.nan, np.maximum(s, CONTACT)) / law)
    most = max(math.log(s.max() / law), NEGLIGIBLE)
    norm = TwoSlopeNorm(0.0, min(math.log(CONTACT / law), -NEGLIGIBLE), most)
    colours = matplotlib.colormaps[WIDE_AND_CLOSE](np.linspace(DARKEST, 1 - DARKEST, 256))
    drawn = _draw_rows(left, data, ratio, norm, ListedColormap(colours))
    bar = figure.colorbar(drawn, ax=left, location="bottom", aspect=30)
    bar.ax.set_xscale("linear")  # as far apart as their logarithms
    ticks = [tick for tick in ROUND_DISTANCES if tick <= s.max()]
    bar.set_ticks(np.log(np.array(ticks) / law), labels=[f"{tick:g}" for tick in ticks])
    bar.minorticks_off()
    black = f"\nblack: touching, $s$ < {TOUCHING:g} $d$" if touching.any() else ""
    bar.set_label(f"$s$ [$d$]; white: the mean, {law:.3g} $d${black}")
    change = s - s[:, :1]
    most = max(float(np.abs(change).max()), NEGLIGIBLE)
    drawn = _draw_rows(right, data, change, TwoSlopeNorm(0.0, -most, most), SIGNED)
    unknown = np.abs(change) <= data["track_error"].values
    _hatch_rows(right, data, unknown)
    bar = figure.colorbar(drawn, ax=right, location="bottom", aspect=30)
    hatched = "\nhatched: below the error of the velocities" if unknown.any() else ""
    bar.set_label(f"change of $s$ [$d$]; red: the gap has opened{hatched}")
    left.set_ylabel("sphere, in order of passage")
    titles = "distance to the sphere ahead, $s$", "its change since the entry"
    for axes, title in zip((left, right), titles, strict=True):
        axes.set_xlabel(POSITION)
        axes.set_title(title, loc="left")
    left.invert_yaxis()
    figure.suptitle(train_conditions(data), fontsize=STYLE["axes.titlesize"])
    return Drawing(figure, data)


def _with_rows(trains: xr.Dataset) -> xr.Dataset:
    """What is drawn of tracks: distances to the sphere ahead, and the error of their changes."""
    data = kept(trains, [], ["track_time", "track_position", "mean_spacing_law", "velocity_error"])
    data = data.transpose("track_sphere", "track_station", ...)
    ahead = -data["track_position"].diff("track_sphere", label="upper")
    ahead = ahead.assign_coords(track_sphere=np.arange(2, ahead.sizes["track_sphere"] + 2))
    ahead.attrs = {"long_name": "distance to the sphere ahead over diameter", "units": "1"}
    since = (data["track_time"] - data["track_time"].isel(track_station=0)).mean("track_sphere")
    error = data["velocity_error"] * since / data["confinement"]
    words = (
        "error of the change of a distance since the entry, over diameter, by that of velocities"
    )
    return data.drop_vars(["track_time", "track_position"]).assign(
        track_spacing=ahead, track_error=error.assign_attrs(long_name=words, units="1")
    )


def _draw_rows(axes: Axes, data: xr.Dataset, values: NDArray, norm: TwoSlopeNorm, cmap):
    """A row for each sphere, white at zero; nothing where there is no value."""
    z, number = data["track_station"].values, data["track_sphere"].values
    style = {"cmap": cmap, "norm": norm, "shading": "nearest", "rasterized": True}
    return axes.pcolormesh(z, number, np.ma.masked_invalid(values), **style)


def _hatch_rows(axes: Axes, data: xr.Dataset, where: NDArray):
    """Hatch parts of rows."""
    z = data["track_station"].values
    for number, row in zip(data["track_sphere"].values, where, strict=True):
        axes.fill_between(z, number - 0.5, number + 0.5, where=row, **BELOW_ERROR)
