r"""Design map: ordering length over (phi, De) and what was simulated, and CV along the channel.

**Map.** The ordering length l of equally spaced trains (`trains.order`) over the length L of the
channel, as colour, dark where it is short; a dashed line where l = L. It is a function of phi; of
De only those of the study are known, so each has a band of its own and nothing is interpolated
between them. Dotted where a train is unstable. Below a band stand the conditions that were
simulated, with the coefficient of variation at the inlet and at the outlet.

**Curves** are this coefficient along the channel, a panel for each De. All other measures, and all
errors in numbers, are in the data beside the figure.
"""

import math

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from viscotrain.drawing.conventions import (
    CHANNEL,
    FRACTION_AXES,
    MARK,
    ORDERING,
    ORDERING_LIMITS,
    ORDERING_TICKS,
    UNSTABLE,
    beyond,
    draw_ordered,
    injection_in_words,
    mark_explained,
    marked_deborah,
    remarks,
)
from viscotrain.drawing.style import PAGE, SMALL, Drawing, fraction_look, styled
from viscotrain.fluid.units import CENTIMETRES, MICROMETRES
from viscotrain.trains import design_map
from viscotrain.trains.variables import in_digits

FRACTION_TICKS = (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20)  # %
ROW, CURVE = 0.4, 1.35  # heights in inches: of a De in the map, of a row of panels
AROUND_MAP, AROUND_CURVES = 1.1, 0.9  # of titles, ticks and legends
BAND = -0.45, 0.08  # where a band of colour begins and ends in its row
NUMBERS = 0.29  # where numbers stand in their row
ASIDE = 0.02  # between error bars beside the outlet, over the length of the channel
PANELS = 6  # beside each other
SPARSE = 1.35  # fractions at least this ratio apart have both CV below the band,
NEAR = 1.12  # closer than this one the CV at the outlet one above the other


@styled
def draw_design_map(dataset: xr.Dataset, found: xr.Dataset, table: xr.Dataset) -> Drawing:
    """Ordering length and simulated conditions over (phi, De), CV along the channel as curves.

    Args:
        dataset: Result of `design_map.combine`.
        found: Result of `design_map.ordering`.
        table: Of velocities; says at which De it is beyond the quasi-steady range.
    """
    rows = dataset.sizes["deborah"]
    lines = math.ceil(rows / PANELS)
    heights = [rows * ROW + AROUND_MAP, lines * CURVE + AROUND_CURVES]
    figure = Figure(figsize=(PAGE, sum(heights)), layout="constrained")
    figure.get_layout_engine().set(hspace=0.03, h_pad=0.03)
    upper, lower = figure.subfigures(2, 1, height_ratios=heights)
    marks = remarks(table.sel(deborah=dataset["deborah"].values))
    _draw_map(upper.subplots(), dataset, found, marks)
    look = {"sharex": True, "sharey": True, "squeeze": False}
    panels = lower.subplots(lines, min(rows, PANELS), **look).flatten()
    _draw_curves(lower, panels, dataset, marks)
    length = float(dataset["station"][-1])
    beside = [beyond(own) for own in design_map.conditions(dataset)]
    figure.suptitle(
        f"$d/D$ = {float(dataset['confinement']):g},  "
        f"$D$ = {MICROMETRES * float(dataset['channel_diameter']):g} \N{MICRO SIGN}m,  "
        f"channel of $L$ = {length:g} $D$ = {float(dataset['length'][-1]):.3g} cm,  "
        f"{injection_in_words(dataset)}" + mark_explained([*marks, *beside]),
        fontsize=matplotlib.rcParams["axes.titlesize"],
    )
    return Drawing(figure, design_map.table(dataset))


# -------------------------------------------------------------------------------------------- map


def _draw_map(axes: Axes, dataset: xr.Dataset, found: xr.Dataset, marks: list[str]):
    """A band of ordering lengths for each De, and the conditions that were simulated."""
    given, length = dataset.attrs["given"], float(dataset["station"][-1])
    share = found["ordering_length"].transpose("deborah", ...).values / length
    look = {"cmap": ORDERING, "norm": LogNorm(*ORDERING_LIMITS), "rasterized": True}
    dashed = False
    for row, De in enumerate(dataset["deborah"].values):
        own = found.sel(deborah=De)
        phi, stable = 100 * own[given].values, own["stability"].values >= 0
        unstable = own["stability"].values < 0  # else, neither, it is not known
        bottom, top = row + BAND[0], row + BAND[1]
        colours = np.ma.masked_where(~stable, np.minimum(share[row], 2 * ORDERING_LIMITS[1]))
        drawn = axes.pcolormesh(_edges(phi), [bottom, top], colours[None], **look)
        axes.fill_between(
            _edges(phi), bottom, top, where=_beside(unstable), step="post", **UNSTABLE
        )
        crossings = _crossings(phi, share[row], stable)
        dashed |= crossings.size > 0
        axes.vlines(crossings, bottom, top, **CHANNEL)
        _draw_conditions(axes, dataset.sel(deborah=De), row, bool(marks[row]))
    bar = axes.figure.colorbar(drawn, ax=axes, extend="both", pad=0.01, aspect=16)
    bar.set_ticks(ORDERING_TICKS, labels=[f"{tick:g}" for tick in ORDERING_TICKS])
    bar.minorticks_off()
    bar.ax.axhline(1, **CHANNEL)
    bar.set_label("$l/L$")
    axes.set_title(
        "colour: length $l$ along which an almost even train evens out by a factor e, over $L$\n"
        + _explained(share[found["stability"].transpose("deborah", ...).values >= 0], dashed)
        + "numbers: CV of the spacing, inlet $\\rightarrow$ outlet, simulated "
        "(bold: counts as ordered)" + _less_even(dataset),
        loc="left",
        pad=4,
    )
    phi = 100 * found[given].values
    axes.set(xscale="log", xlabel=FRACTION_AXES[given], xlim=(phi.min(), phi.max()))
    axes.set_xticks([tick for tick in FRACTION_TICKS if phi.min() < tick < phi.max()])
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(dataset.sizes["deborah"] - 0.5, -0.5)  # as the panels: De ascends
    axes.set_yticks(range(dataset.sizes["deborah"]), _condition_names(dataset, marks))
    axes.tick_params(axis="y", length=0)
    axes.spines[:].set_visible(False)


def _explained(share: NDArray, dashed: bool) -> str:
    """A line about l over L, of stable trains, and about unstable ones."""
    words = "dashed: $l$ = $L$; "
    if not dashed:
        words = "$l$ > $L$ everywhere; " if (share > 1).all() and share.size else ""
    return f"({words}dotted area: unstable, spheres drift together)\n"


def _less_even(dataset: xr.Dataset) -> str:
    """A remark if some train has got less even by more than its error."""
    cv = dataset["spacing_variation"]
    error = dataset["spacing_variation_halfwidth"].fillna(0.0).isel(station=-1)
    worse = cv.isel(station=-1) - error > cv.isel(station=0)
    return "\nrandom trains may get less even: close pairs" if worse.any() else ""


def _edges(values: NDArray) -> NDArray:
    """Where cells around values, even on a logarithmic axis, begin and end."""
    middles = np.sqrt(values[1:] * values[:-1])
    return np.concatenate([values[:1], middles, values[-1:]])


def _beside(cells: NDArray) -> NDArray:
    """Of edges: whether the cell that begins there, or else ends there, is one of these."""
    return np.append(cells, False) | np.append(False, cells)


def _crossings(phi: NDArray, share: NDArray, stable: NDArray) -> NDArray:
    """Where the ordering length is that of the channel, between stable trains."""
    longer = share > 1
    return _edges(phi)[1:-1][(longer[1:] != longer[:-1]) & stable[1:] & stable[:-1]]


def _draw_conditions(axes: Axes, own: xr.Dataset, row: int, marked: bool):
    """CV at the inlet and at the outlet where trains of a De, marked or not, were simulated."""
    given = own.attrs["given"]
    phi = 100 * own[given].values
    apart = float((phi[1:] / phi[:-1]).min()) if phi.size > 1 else math.inf
    for n, x in enumerate(phi):
        condition = own.isel({given: n})
        inlet, outlet = (float(condition["spacing_variation"][end]) for end in (0, -1))
        if not math.isfinite(outlet):
            continue
        words = rf"{inlet:.2f}$\rightarrow${outlet:.2f}" if apart >= SPARSE else f"{outlet:.2f}"
        axes.plot(x, row + BAND[1], "^", color="black", ms=3, mew=0)
        axes.text(
            x,
            row + NUMBERS + (apart < NEAR) * 0.09 * (-1) ** n,
            words + (MARK if beyond(condition) and not marked else ""),
            ha="center",
            va="center",
            fontsize=SMALL,
            weight="bold" if outlet <= float(own["ordered_variation"]) else "normal",
        )


def _condition_names(dataset: xr.Dataset, marks: list[str]) -> list[str]:
    """A Deborah number with its flow rate and the pressure drop of the whole channel."""
    names = []
    for De, mark in zip(dataset["deborah"].values, marks, strict=True):
        own = dataset.sel(deborah=De)
        Q, drop = float(own["flow_rate"]), float(own["pressure_drop"][-1])
        bench = f"\n{in_digits(Q)} \N{MICRO SIGN}L/min, {in_digits(drop)} bar"
        names.append(marked_deborah(De, mark) + bench * math.isfinite(Q))
    return names


# ----------------------------------------------------------------------------------------- curves


def _draw_curves(figure: SubFigure, panels: NDArray, dataset: xr.Dataset, marks: list[str]):
    """CV along the channel, and its errors, at each De."""
    given = dataset.attrs["given"]
    cm = 100 * CENTIMETRES * float(dataset["channel_diameter"])
    looks = [fraction_look(phi) for phi in dataset[given].values]
    deborah = dataset["deborah"].values
    for axes in panels[deborah.size :]:
        axes.set_axis_off()
    for axes, De, mark in zip(panels, deborah, marks, strict=False):
        for n, look in enumerate(looks):
            _draw_curve(axes, dataset.sel(deborah=De).isel({given: n}), look, n)
        line = draw_ordered(axes, float(dataset["ordered_variation"]))
        axes.set_title(marked_deborah(De, mark), loc="left", pad=4)
        axes.set_xlim(0, float(dataset["station"][-1]))
        axes.xaxis.set_major_locator(MaxNLocator(4))
        axes.set_xlabel("$z$ [$D$]")
    panels[0].set_ylim(bottom=0)
    panels[0].set_ylabel("CV of the spacing")
    figure.suptitle(
        f"along the channel (100 $D$ = {cm:.3g} cm; bands: sampling error, "
        "95 %; bars beside the outlet: model error)",
        fontsize=matplotlib.rcParams["axes.titlesize"],
    )
    symbol = r"\phi" if given == "volume_fraction" else r"\phi_{feed}"
    handles = [Line2D([], [], lw=1, **look) for look in looks]
    labels = [f"${symbol}$ = {100 * phi:.3g} %" for phi in dataset[given].values]
    figure.legend(
        [*handles, line],
        [*labels, str(line.get_label())],
        loc="outside lower center",
        ncols=7,
        columnspacing=1.2,
        handlelength=1.8,
    )


def _draw_curve(axes: Axes, own: xr.Dataset, look: dict, n: int):
    """One condition, with its sampling error along the channel and its model error at the end."""
    z, y = own["station"].values, own["spacing_variation"].values
    half = own["spacing_variation_halfwidth"].values
    axes.plot(z, y, lw=1, markevery=max(1, z.size // 4), **look | {"ms": 3})
    axes.fill_between(z, y - half, y + half, color=look["color"], alpha=0.2, lw=0)
    error = float(own["spacing_variation_model_error"][-1])
    bar = [[min(error, y[-1])], [error]]  # nothing is below 0
    place = (1 - (n + 1) * ASIDE) * z[-1]  # the bars of a panel stand side by side
    axes.errorbar(place, y[-1], bar, color=look["color"], lw=2, clip_on=False)
