"""The figure of how spheres are grouped: pair correlation, and strings by their length."""

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from viscotrain.drawing.conventions import train_conditions
from viscotrain.drawing.style import COLUMN, SMALL, STYLE, VERMILLION, Drawing, styled
from viscotrain.drawing.train_figures import kept
from viscotrain.trains.statistics import LONGEST_STRING, TOUCHING

WIDTH = 0.8  # of the bars of all stations together
NAMES = {2: "doublets", 3: "triplets"}


@styled
def strings(trains: xr.Dataset) -> Drawing:
    """Pair correlation at the stations, and the share of spheres in strings of touching ones."""
    data = kept(trains, ["pair_correlation", "string_share"], ["string_share_injected"])
    figure = Figure(figsize=(COLUMN, 5.2), layout="constrained")
    upper, lower = figure.subplots(2, 1)
    colours = matplotlib.colormaps["viridis"](np.linspace(0, 0.88, data.sizes["station"]))
    _draw_correlation(upper, data, colours)
    _draw_strings(lower, data, colours)
    figure.suptitle(train_conditions(data), fontsize=STYLE["axes.titlesize"])
    handles = [Line2D([], [], color=colour, lw=2) for colour in colours]
    labels = [f"$z$ = {z:g} $D$" for z in data["station"].values]
    handles.append(Line2D([], [], color=VERMILLION, lw=1.2))
    labels.append("by the injection law")
    if trains.sizes["repeat"] > 1:
        handles.append(Patch(facecolor="black", alpha=0.2, lw=0))
        labels.append("band, thin bar: sampling (95 %)")
    handles.append(Line2D([], [], color="black", lw=3))
    labels.append("thick bar: model error")
    figure.legend(handles, labels, loc="outside lower center", ncols=2, columnspacing=1.2)
    return Drawing(figure, data)


def _draw_correlation(axes: Axes, data: xr.Dataset, colours):
    s = data["spacing_bin"].values
    axes.axhline(1.0, color="black", lw=0.6, ls=(0, (4, 2)))
    for n, colour in enumerate(colours):
        own = data.isel(station=n)
        g = own["pair_correlation"].values
        half = np.nan_to_num(own["pair_correlation_halfwidth"].values)
        axes.plot(s, g, color=colour, lw=1)
        if n == len(colours) - 1:
            axes.fill_between(s, g - half, g + half, color=colour, alpha=0.25, lw=0)
            error = own["pair_correlation_model_error"].values
            axes.vlines(s, g - error, g + error, color=colour, lw=2)
    axes.set(xlim=(1.0, s[-1]), ylim=(0, None))
    axes.set_xlabel("distance $s$ [$d$]")
    axes.set_ylabel("pair correlation, $g(s)$\n(1: no order)")
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True, steps=[1, 2, 5, 10]))


def _draw_strings(axes: Axes, data: xr.Dataset, colours):
    """Bars of strings of two and more; singlets are the rest, in words."""
    length = data["string_length"].values[1:]
    width = WIDTH / len(colours)
    for n, colour in enumerate(colours):
        own = data.isel(station=n, string_length=slice(1, None))
        x = length + width * (n - (len(colours) - 1) / 2)
        share = 100 * own["string_share"].values
        axes.bar(x, share, 0.9 * width, color=colour, alpha=0.6)
        for end, lw in (("_halfwidth", 0.8), ("_model_error", 3)):
            half = 100 * np.nan_to_num(own[f"string_share{end}"].values)
            axes.vlines(x, np.maximum(share - half, 0), share + half, color=colour, lw=lw)
    law = 100 * data["string_share_injected"].values[1:]
    axes.hlines(law, length - WIDTH / 2, length + WIDTH / 2, color=VERMILLION, lw=1.2)
    names = [NAMES.get(n, f"{n}{' or more' if n == LONGEST_STRING else ''}") for n in length]
    axes.set_xticks(length, names)
    axes.set_xlabel(f"spheres in a string (closer than {TOUCHING:g} $d$)")
    axes.set_ylabel("share of spheres [%]")
    alone = 100 * data["string_share"].isel(station=-1, string_length=0)
    words = f"singlets, at the last station: {float(alone):.1f} %"
    axes.text(0.98, 0.95, words, ha="right", va="top", fontsize=SMALL, transform=axes.transAxes)
