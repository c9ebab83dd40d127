r"""Design map: ordering length over (phi, De) with what was simulated; its numbers, and curves.

**Map.** The ordering length l of equally spaced trains (`trains.order`) over the length L of the
channel, as colour: l = L is white, trains that order within the channel are green, those that need
a longer one brown. It is a function of phi; of De only those of the study are known, so each has a
band of its own and nothing is interpolated between them. Hatched where a train is unstable. The
conditions that were simulated stand on it, with the coefficient of variation at the outlet.

**Cells** are the conditions that were simulated, with all errors; **curves** are theirs along the
channel.
"""

import math

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from viscotrain.drawing.conventions import (
    FRACTION_AXES,
    POSITION,
    UNSTABLE,
    draw_ordered,
    injection_in_words,
    mark_explained,
    marked_deborah,
    remarks,
)
from viscotrain.drawing.style import (
    PAGE,
    PALE_GREY,
    SMALL,
    Drawing,
    fraction_colour,
    styled,
)
from viscotrain.fluid.units import CENTIMETRES, MICROMETRES
from viscotrain.table.memory import remark
from viscotrain.trains import design_map
from viscotrain.trains.variables import rate_in_words, with_errors

ORDERING = "BrBG_r"  # of log10(l/L), white at 0
DECADES = 1.0  # of l/L to both sides of 1
LENGTH_TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10)
FRACTION_TICKS = (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20)  # %
ROW, ENTRY_ROW, CURVE = 0.37, 0.47, 0.72  # heights in inches: three lines of text, four, a panel
AROUND_MAP, AROUND_CELLS, AROUND_CURVES, AXIS = 0.75, 1.3, 1.25, 0.4  # titles, ticks, legends
BAND = 0.86  # height of a band or of a cell, over that of its row
FEW = 7  # fractions, up to which cells of two statistics stand side by side
NEAR = 1.12  # fractions closer than this ratio have their words one above the other
WIDEST_WORDS = {1: 13, 2: 7}  # cells beside each other in which words fit, by panels in a row
DARK = 0.55  # share of the colour map below which words in a cell are white
CURVES = (
    ("spacing_variation", "CV of the\nspacing", 1),
    ("touching_share", "touching\nspheres [%]", 100),
    ("even_share", "within 20 %\nof mean [%]", 100),
)
CELLS = (  # statistic, title, decimals, factor, colours
    ("spacing_variation", "CV of the spacing at the outlet", 3, 1, "viridis_r"),
    ("even_share", "spacings within 20 % of their mean at the outlet [%]", 1, 100, "viridis"),
    ("touching_share", "touching spheres at the outlet [%]", 1, 100, "viridis_r"),
)


@styled
def draw_design_map(dataset: xr.Dataset, found: xr.Dataset) -> Drawing:
    """Ordering length over (phi, De), measures at the outlet as cells, along the channel as curves.

    Args:
        dataset: Result of `design_map.combine`.
        found: Result of `design_map.ordering`.
    """
    rows = dataset.sizes["deborah"]
    side = 2 if dataset.sizes[dataset.attrs["given"]] <= FEW else 1
    cells = rows * (ROW + ENTRY_ROW if side == 2 else 3 * ROW + ENTRY_ROW)
    heights = [
        rows * ROW + AROUND_MAP,
        cells + AROUND_CELLS / side + AXIS,
        len(CURVES) * CURVE + AROUND_CURVES,
    ]
    figure = Figure(figsize=(PAGE, sum(heights) + AXIS), layout="constrained")
    figure.get_layout_engine().set(hspace=0.03, h_pad=0.03)
    upper, middle, lower = figure.subfigures(3, 1, height_ratios=heights)
    _draw_map(upper.subplots(), dataset, found)
    _draw_cells(middle, dataset, side)
    _draw_curves(lower, lower.subplots(3, rows, sharex=True, sharey="row", squeeze=False), dataset)
    length = float(dataset["station"][-1])
    figure.suptitle(
        f"$d/D$ = {float(dataset['confinement']):g},  "
        f"$D$ = {MICROMETRES * float(dataset['channel_diameter']):g} \N{MICRO SIGN}m,  "
        f"channel of {length:g} $D$ = {float(dataset['length'][-1]):.3g} cm,  "
        f"{injection_in_words(dataset)}" + mark_explained(remarks(dataset)),
        fontsize=matplotlib.rcParams["axes.titlesize"],
    )
    return Drawing(figure, design_map.table(dataset))


# -------------------------------------------------------------------------------------------- map


def _draw_map(axes: Axes, dataset: xr.Dataset, found: xr.Dataset):
    """A band of ordering lengths for each De, and the conditions that were simulated."""
    given, length = dataset.attrs["given"], float(dataset["station"][-1])
    share = np.log10(found["ordering_length"].transpose("deborah", ...).values / length)
    look = {"cmap": ORDERING, "norm": Normalize(-DECADES, DECADES)}
    for row, De in enumerate(dataset["deborah"].values):
        own = found.sel(deborah=De)
        phi, stable = 100 * own[given].values, own["stability"].values >= 0
        bottom, top = row - BAND / 2, row + BAND / 2
        colours = np.ma.masked_where(~stable, np.minimum(share[row], 2 * DECADES))
        drawn = axes.pcolormesh(_edges(phi), [bottom, top], colours[None], rasterized=True, **look)
        axes.fill_between(_edges(phi), bottom, top, where=_beside(~stable), step="post", **UNSTABLE)
        _draw_conditions(axes, dataset.sel(deborah=De), row)
    bar = axes.figure.colorbar(drawn, ax=axes, extend="both", pad=0.01, aspect=16)
    ticks = LENGTH_TICKS if dataset.sizes["deborah"] > 2 else LENGTH_TICKS[::3]
    bar.set_ticks(np.log10(ticks), labels=[f"{tick:g}" for tick in ticks])
    bar.minorticks_off()
    bar.set_label("$l/L$")
    axes.set_title(
        "ordering length over that of the channel, $l/L$ (dotted: unstable); "
        "numbers: CV at the outlet, simulated",
        loc="left",
        pad=4,
    )
    phi = 100 * found[given].values
    axes.set(xscale="log", xlabel=FRACTION_AXES[given], xlim=(phi.min(), phi.max()))
    axes.set_xticks([tick for tick in FRACTION_TICKS if phi.min() < tick < phi.max()])
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(-0.5, dataset.sizes["deborah"] - 0.5)
    axes.set_yticks(range(dataset.sizes["deborah"]), _condition_names(dataset))
    axes.tick_params(axis="y", length=0)
    axes.spines[:].set_visible(False)


def _edges(values: NDArray) -> NDArray:
    """Where cells around values, even on a logarithmic axis, begin and end."""
    middles = np.sqrt(values[1:] * values[:-1])
    return np.concatenate([values[:1], middles, values[-1:]])


def _beside(cells: NDArray) -> NDArray:
    """Of edges: whether the cell that begins there, or else ends there, is one of these."""
    return np.append(cells, False) | np.append(False, cells)


def _draw_conditions(axes: Axes, own: xr.Dataset, row: int):
    """CV at the outlet where trains of a De were simulated."""
    phi = 100 * own[own.attrs["given"]].values
    dense = phi.size > 1 and bool((phi[1:] / phi[:-1] < NEAR).any())
    for n, (x, variation) in enumerate(
        zip(phi, own["spacing_variation"].isel(station=-1).values, strict=True)
    ):
        if math.isfinite(variation):
            axes.text(
                x,
                row + dense * 0.2 * (-1) ** n,
                f"{variation:.2f}",
                ha="center",
                va="center",
                fontsize=SMALL,
                bbox={"boxstyle": "round,pad=0.2", "facecolor": "white", "lw": 0.6},
            )


def _condition_names(dataset: xr.Dataset) -> list[str]:
    """A Deborah number with its flow rate and the pressure drop of the whole channel."""
    names = []
    for De in dataset["deborah"].values:
        own = dataset.sel(deborah=De)
        Q, drop = float(own["flow_rate"]), float(own["pressure_drop"][-1])
        bench = f"\n{Q:.3g} \N{MICRO SIGN}L/min\n{drop:.2g} bar" if math.isfinite(Q) else ""
        names.append(f"{marked_deborah(De, remark(own))}{bench}")
    return names


# ------------------------------------------------------------------------------------------ cells


def _draw_cells(figure: SubFigure, dataset: xr.Dataset, side: int):
    """Statistics at the outlet, and what enters; `side` of them beside each other."""
    rows = 4 // side
    heights = [ROW] * (rows - 1) + [ENTRY_ROW]
    panels = figure.subplots(rows, side, sharex=True, sharey=True, height_ratios=heights)
    outlet = dataset.isel(station=-1).transpose("deborah", dataset.attrs["given"])
    size = SMALL * min(1.0, WIDEST_WORDS[side] / outlet.sizes[dataset.attrs["given"]])
    for axes, (name, title, decimals, factor, colours) in zip(panels.flat, CELLS, strict=False):
        words = _in_words(outlet, name, decimals, factor)
        _draw_grid(axes, factor * outlet[name].values, words, cmap=colours, size=size)
        axes.set_title(title)
    _draw_entry(panels.flat[-1], outlet, size)
    for axes in panels.flat:
        axes.set_title(axes.get_title(), fontsize=SMALL, loc="left", pad=4)
        axes.set_title("")
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
    for axes in panels.reshape(rows, side)[-1]:
        axes.set_xlabel(FRACTION_AXES[dataset.attrs["given"]])
    fractions = 100 * dataset[dataset.attrs["given"]].values
    panels.flat[0].set_xticks(range(fractions.size), [f"{value:g}" for value in fractions])
    panels.flat[0].set_yticks(range(dataset.sizes["deborah"]), _condition_names(dataset))
    figure.suptitle(
        "simulated conditions (first \N{PLUS-MINUS SIGN}, bands below: sampling error, 95 %; "
        "second \N{PLUS-MINUS SIGN}: model error)",
        fontsize=matplotlib.rcParams["axes.titlesize"],
    )


def _draw_entry(axes: Axes, outlet: xr.Dataset, size: float):
    """The volume fraction that the axis does not show, spheres/s, and what the law makes."""
    feed = outlet.attrs["given"] == "volume_fraction"
    other = outlet["feed_volume_fraction" if feed else "volume_fraction"].values

    def words(fraction, rate, variation, touching_share):
        if math.isnan(fraction):
            return ""
        enter = f"{rate_in_words(rate)}/s\n" if math.isfinite(rate) else ""
        return f"{100 * fraction:.3g} %\n{enter}CV {variation:.2f}\n{100 * touching_share:.1f} %"

    names = ("sphere_rate", "spacing_variation_injected", "touching_share_injected")
    own = (outlet[name].values for name in names)
    texts = np.vectorize(words, otypes=[object])(other, *own)
    _draw_grid(axes, np.full(other.shape, math.nan), texts, cmap="viridis", size=size)
    name = r"\phi_{feed}" if feed else r"\phi"
    axes.set_title(f"enter: ${name}$, per s, CV, touching")


def _in_words(outlet: xr.Dataset, name: str, decimals: int, factor: float) -> NDArray:
    """A statistic with both errors in words; empty where nothing was simulated."""
    given = outlet.attrs["given"]
    words = np.full((outlet.sizes["deborah"], outlet.sizes[given]), "", dtype=object)
    for row, column in np.argwhere(np.isfinite(outlet["mean_spacing"].values)):
        own = outlet.isel({"deborah": row, given: column})
        text = with_errors(own, name, decimals, factor, "\n\N{PLUS-MINUS SIGN}")
        words[row, column] = text
    return words


def _draw_grid(axes: Axes, values: NDArray, words: NDArray, *, cmap: str, size: float):
    """A cell per condition with its words, coloured from 0 to the largest value; else grey."""
    norm = Normalize(0, float(values[np.isfinite(values)].max(initial=0)) or 1)
    colours = matplotlib.colormaps[cmap]
    for (row, column), value in np.ndenumerate(values):
        if not words[row, column]:
            continue
        face = colours(norm(value)) if math.isfinite(value) else PALE_GREY
        corner = column - 0.48, row - BAND / 2
        axes.add_patch(Rectangle(corner, 0.96, BAND, facecolor=face, lw=0))
        brightness = np.dot(matplotlib.colors.to_rgb(face), (0.299, 0.587, 0.114))
        axes.text(
            column,
            row,
            words[row, column],
            ha="center",
            va="center",
            fontsize=size,
            linespacing=1.0,
            color="white" if brightness < DARK else "black",
        )
    axes.set(xlim=(-0.5, values.shape[1] - 0.5), ylim=(-0.5, values.shape[0] - 0.5))


# ----------------------------------------------------------------------------------------- curves


def _draw_curves(figure, panels: NDArray, dataset: xr.Dataset):
    given = dataset.attrs["given"]
    z, phi = dataset["station"].values, dataset[given].values
    cm = 100 * CENTIMETRES * float(dataset["channel_diameter"])
    colours = fraction_colour(phi)
    for column, De in enumerate(dataset["deborah"].values):
        for row, (name, label, factor) in enumerate(CURVES):
            axes = panels[row, column]
            for value, colour in zip(phi, colours, strict=True):
                own = dataset.sel({"deborah": De, given: value})
                y = factor * own[name].values
                axes.plot(z, y, color=colour, lw=1)
                half = factor * own[f"{name}_halfwidth"].values
                axes.fill_between(z, y - half, y + half, color=colour, alpha=0.2, lw=0)
                error = factor * float(own[f"{name}_model_error"][-1])
                bar = [[min(error, y[-1])], [error]]  # nothing is below 0
                axes.errorbar(z[-1], y[-1], bar, color=colour, lw=2, clip_on=False)
            if column == 0:
                axes.set_ylabel(label)
            axes.yaxis.set_major_locator(MaxNLocator(4))
        line = draw_ordered(panels[0, column], float(dataset["ordered_variation"]))
        title = marked_deborah(De, remark(dataset.sel(deborah=De)))
        panels[0, column].set_title(title, loc="left", pad=4)
        bottom = panels[-1, column]
        bottom.set_xlim(z[0], z[-1])
        bottom.set_xlabel(POSITION)
        bottom.xaxis.set_major_locator(MaxNLocator(4))
    for axes in panels[:, 0]:  # rows share their axes
        axes.set_ylim(bottom=0)
    words = f"over the length of the channel (100 $D$ = {cm:.3g} cm; bars at its end: model error)"
    figure.suptitle(words, fontsize=matplotlib.rcParams["axes.titlesize"])
    handles = [Line2D([], [], color=colour) for colour in colours]
    symbol = r"\phi" if given == "volume_fraction" else r"\phi_{feed}"
    labels = [f"${symbol}$ = {100 * value:g} %" for value in phi]
    handles.append(line)
    labels.append(str(line.get_label()))
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 7))
