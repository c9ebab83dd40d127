"""The figure of how spheres are grouped: pair correlation, and strings by their length in words."""

import textwrap

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from viscotrain.drawing.conventions import train_conditions
from viscotrain.drawing.style import BLUE, COLUMN, GREY, STYLE, Drawing, styled
from viscotrain.drawing.train_figures import DOTTED, kept
from viscotrain.trains.statistics import LONGEST_STRING, TOUCHING
from viscotrain.trains.variables import with_errors

SMALLEST = 5e-4  # share that is named: 0.1 %, rounded
LINE = 64  # characters that are as long as the axes
NAMES = {2: "doublets", 3: "triplets", LONGEST_STRING: f"strings of {LONGEST_STRING} or more"}


@styled
def strings(trains: xr.Dataset) -> Drawing:
    """Pair correlation at the first and at the last station, and what is touching there."""
    measures = ["pair_correlation", "string_share"]
    data = kept(trains, measures, ["string_share_injected", "spacing_density_injected"])
    figure = Figure(figsize=(COLUMN, 3.5), layout="constrained")
    axes = figure.subplots()
    first, last = (data.isel(station=n) for n in (0, -1))
    _draw_correlation(axes, first, GREY)
    _draw_correlation(axes, last, BLUE)
    _draw_longest(axes, data)
    axes.axhline(1.0, color="black", lw=0.6, ls=(0, (4, 2)))
    axes.set(xlim=(1.0, data["spacing_bin"].values[-1]), ylim=(0, None))
    axes.set_xlabel("distance $s$ [$d$]")
    axes.set_ylabel("pair correlation, $g(s)$ (1: independent spheres)")
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True, steps=[1, 2, 5, 10]))
    words = [f"spheres in strings, neighbours closer than {TOUCHING:g} $d$:"]
    words += [_in_strings(own) for own in (first, last)]
    axes.set_title("\n".join(words), loc="left", fontsize=STYLE["legend.fontsize"])
    conditions = train_conditions(data).replace(",  injection", "\ninjection")  # a column is narrow
    figure.suptitle(conditions, fontsize=STYLE["axes.titlesize"])
    entries = [
        (Line2D([], [], color=colour), f"$z$ = {float(own['station']):g} $D$")
        for own, colour in ((first, GREY), (last, BLUE))
    ]
    if trains.sizes["repeat"] > 1:
        entries.append((Patch(facecolor="black", alpha=0.2, lw=0), "sampling error (95 %)"))
    bar = Line2D([], [], color="black", marker="|", ms=6, lw=0, mew=1)
    entries.append((bar, "model error"))
    figure.legend(*zip(*entries, strict=True), loc="outside lower center", ncols=2)
    return Drawing(figure, data)


def _draw_correlation(axes: Axes, station: xr.Dataset, colour: str):
    """g(s) with both errors."""
    s, g = station["spacing_bin"].values, station["pair_correlation"].values
    half, model = (
        np.nan_to_num(station[f"pair_correlation{end}"].values)
        for end in ("_halfwidth", "_model_error")
    )
    axes.plot(s, g, color=colour, lw=1)
    axes.fill_between(s, np.maximum(g - half, 0), g + half, color=colour, alpha=0.25, lw=0)
    axes.vlines(s, np.maximum(g - model, 0), g + model, color="black", lw=0.8)


def _draw_longest(axes: Axes, data: xr.Dataset):
    """The largest distance at which spheres enter, where there is one: g falls there."""
    some = np.flatnonzero(data["spacing_density_injected"].values > 0)
    if some[-1] + 1 >= data.sizes["spacing_bin"]:
        return
    bins = data["spacing_bin"]
    longest = bins.values[some[-1]] + bins.attrs["bin_width"] / 2
    axes.axvline(longest, color=GREY, lw=1, ls=DOTTED)
    words = "largest gap\ninjected"
    place = {"ha": "left", "va": "bottom", "transform": axes.get_xaxis_transform()}
    axes.text(longest, 0.02, f" {words}".replace("\n", "\n "), fontsize=7, **place)


def _in_strings(station: xr.Dataset) -> str:
    """The shares of spheres in strings of all lengths that are worth a word, with their errors."""
    found = []
    for length in station["string_length"].values[1:]:
        own = station.sel(string_length=length)
        if float(own["string_share"]) >= SMALLEST:
            words = with_errors(own, "string_share", 1, 100, " \N{PLUS-MINUS SIGN} ")
            found.append(f"{NAMES.get(int(length), f'strings of {length}')} {words} %")
    line = f"at {float(station['station']):g} $D$: {', '.join(found) or 'none'}"
    return textwrap.fill(line, LINE, subsequent_indent="   ")
