r"""Figure of the ordering length: where trains order, and what random injection makes of it.

Left: l against the volume fraction phi of an equally spaced train, (2/3) beta^2/s in a tube, with
the length of the channel. Right: CV at the outlet over CV at the inlet, by the linear theory of
small scatter and simulated. A strip above each has a bar where equally spaced trains are unstable.
"""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from viscotrain.drawing.conventions import (
    CHANNEL,
    injection_in_words,
    mark_explained,
    marked_deborah,
    remarks,
)
from viscotrain.drawing.style import GREY, PAGE, Drawing, deborah_look, styled
from viscotrain.fluid.units import CENTIMETRES
from viscotrain.trains.design_map import ERRORS
from viscotrain.trains.order import remaining_variation

SHORTEST, LONGEST = 0.5, 30.0  # drawn, over the shortest length and the channel's
EVEN = 1e-6  # CV of spheres that enter evenly, to which nothing is compared
HEIGHT, AROUND = 3.3, 0.9  # of the figure without the strip of bars; of titles and legend; inches
BAR = 0.055  # height of a De's bar, in inches
IN_A_ROW = 6  # entries of the legend
ROOM = 0.06  # beyond the smallest and the largest ratio of CV, over their difference
GROWS = {"ls": ":", "lw": 0.8}  # lines where trains are unstable
INLET = {"color": GREY, "lw": 0.6}  # the line at 1
TICKS = (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10)  # %
WIDER = 1.15  # than the volume fractions of lengths and trains


@styled
def draw_order(
    found: xr.Dataset,
    length: float,
    units: xr.Dataset,
    table: xr.Dataset,
    simulated: xr.Dataset | None = None,
) -> Drawing:
    """Ordering length and remaining scatter against the volume fraction.

    Args:
        found: Of `order.orders`.
        length: Of the channel, in D.
        units: Physical units of the study.
        table: Of velocities; says at which De it is beyond the quasi-steady range.
        simulated: Design map; None for a figure of the theory alone.
    """
    data = _data(found, length, simulated)
    deborah = [float(De) for De in found["deborah"].values if De > 0]
    strip = BAR * (len(deborah) + 1)
    figure = Figure(figsize=(PAGE, HEIGHT + strip), layout="constrained")
    figure.get_layout_engine().set(wspace=0.06, h_pad=0.04)
    heights = {"height_ratios": [strip, HEIGHT - AROUND]}
    (bars, above), (left, right) = figure.subplots(2, 2, sharex=True, gridspec_kw=heights)
    for n, De in enumerate(deborah):
        _draw_one(left, right, data.sel(deborah=De))
        _draw_unstable(bars, data.sel(deborah=De), n)
    _finish_left(left, data, length, float(units["channel_diameter"]))
    _finish_right(right, data, length)
    _finish_strip(bars, len(deborah))
    bars.set_title("length $l$ for a decay by e: fastest mode (neighbours alternate)", loc="left")
    above.set_title("what the channel leaves of the scatter: all modes", loc="left")
    above.set_axis_off()
    _finish_fractions(left, right, data)
    marks = remarks(table.sel(deborah=deborah))
    words = _words(found["spacing"].values, simulated) + mark_explained(marks)
    _legend(figure, deborah, marks, length, words)
    return Drawing(figure, data)


def _draw_one(left: Axes, right: Axes, own: xr.Dataset):
    """Curves and symbols of one Deborah number."""
    phi, look = 100 * own["volume_fraction"], deborah_look(float(own["deborah"]))
    stable, unstable = own["stability"] >= 0, own["stability"] < 0
    left.plot(phi, own["ordering_length"].where(stable), color=look["color"])
    right.plot(phi, own["remaining_variation"].where(stable), color=look["color"])
    right.plot(phi, own["remaining_variation"].where(unstable), color=look["color"], **GROWS)
    if "simulated_volume_fraction" in own:
        at, known = 100 * own["simulated_volume_fraction"], own["simulated_variation"].notnull()
        bars = {"ls": "", "zorder": 3, "elinewidth": 0.8, "capsize": 2}
        ratio, error = own["simulated_variation"], own["simulated_variation_error"]
        right.errorbar(at[known], ratio[known], error[known], **look, **bars)


def _draw_unstable(bars: Axes, own: xr.Dataset, n: int):
    """A bar where trains are unstable, the n-th from above."""
    phi, unstable = 100 * own["volume_fraction"], own["stability"] < 0
    colour = deborah_look(float(own["deborah"]))["color"]
    bars.plot(phi, (0 * phi + n).where(unstable), color=colour, lw=3, solid_capstyle="butt")


def _finish_strip(bars: Axes, count: int):
    bars.set(ylim=(count - 0.5, -0.7), yticks=[(count - 1) / 2])
    bars.set_yticklabels(["unstable"])
    bars.tick_params(which="both", length=0)
    bars.spines[:].set_visible(False)


def _finish_left(axes: Axes, data: xr.Dataset, length: float, diameter: float):
    """Axes of the ordering length, in D and in cm, with the length of the channel."""
    lengths = data["ordering_length"].where(data["deborah"] > 0)
    finite = lengths.values[np.isfinite(lengths)]
    low = min(finite.min(initial=length), length)
    axes.set(yscale="log", ylim=(SHORTEST * low, LONGEST * length))
    axes.axhline(length, **CHANNEL)
    axes.set_ylabel("ordering length, $l$ [$D$]")
    centimetres = diameter * CENTIMETRES
    other = axes.secondary_yaxis(
        "right", functions=(lambda D: D * centimetres, lambda cm: cm / centimetres)
    )
    other.set_ylabel("$l$ [cm]", labelpad=0)
    for axis in (axes.yaxis, other.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _finish_right(axes: Axes, data: xr.Dataset, length: float):
    """The axis holds all symbols, and lines of trains that are stable."""
    stable = (data["stability"] >= 0) & (data["deborah"] > 0)
    values = np.append(data["remaining_variation"].where(stable).values, 1.0)
    if "simulated_variation" in data:
        ratio, error = data["simulated_variation"], data["simulated_variation_error"]
        values = np.concatenate([values, *(ratio - error).values, *(ratio + error).values])
    low, high = np.nanmin(values), np.nanmax(values)
    room = ROOM * (high - low) or 0.5
    axes.set(ylim=(max(low - room, 0), high + room))
    axes.set_ylabel(f"CV at $z$ = {length:g} $D$ over CV at the inlet")
    axes.axhline(1, **INLET)


def _finish_fractions(left: Axes, right: Axes, data: xr.Dataset):
    """The same volume fractions in both panels."""
    phi = 100 * data["volume_fraction"].values
    if "simulated_volume_fraction" in data:
        phi = np.append(phi, 100 * data["simulated_volume_fraction"].values)
    low, high = np.nanmin(phi) / WIDER, np.nanmax(phi) * WIDER
    for axes in (left, right):
        axes.set(xscale="log", xlim=(low, high), xlabel=r"volume fraction, $\phi$ [%]")
        axes.set_xticks([tick for tick in TICKS if low < tick < high])
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())


def _legend(
    figure: Figure,
    deborah: list[float],
    marks: list[str],
    length: float,
    words: str,
):
    """Lines and symbols; what they are of stands above them."""
    entries = [
        (Line2D([], [], **deborah_look(De)), marked_deborah(De, mark))
        for De, mark in zip(deborah, marks, strict=True)
    ]
    entries.append((Line2D([], [], **CHANNEL), f"channel, $L$ = {length:g} $D$"))
    entries.append((Line2D([], [], color=GREY, **GROWS), "theory, unstable"))
    entries.append((Line2D([], [], **INLET), "above: less even than at the inlet"))
    figure.legend(
        *zip(*entries, strict=True),
        title=words,
        loc="outside lower center",
        ncols=4 if len(entries) > IN_A_ROW else len(entries),
        columnspacing=1.2,
        handlelength=1.8,
    )


def _words(spacing: np.ndarray, simulated: xr.Dataset | None) -> str:
    """What lines and symbols are of."""
    words = f"lines: theory of small scatter, for distances of {spacing.min():g} to "
    words += f"{spacing.max():g} $d$: not computed beyond, where lines and strips end"
    if simulated is None:
        return words
    injected = injection_in_words(simulated)
    return f"{words}\nsymbols: simulated, {injected}; error bars: sampling (95 %) plus model"


def _data(found: xr.Dataset, length: float, simulated: xr.Dataset | None) -> xr.Dataset:
    """What is drawn."""
    kept = found[["ordering_length", "stability", "velocity", "confinement"]]
    kept["remaining_variation"] = (
        ("deborah", "spacing"),
        remaining_variation(found["growth_rate"].values, found["velocity"].values, length),
        {"long_name": f"CV at the outlet, {length:g} D, over CV at the inlet", "units": "1"},
    )
    if simulated is None:
        return kept
    variation = simulated["spacing_variation"]
    entered = variation.isel(station=0)
    ratio = variation.isel(station=-1) / entered.where(entered > EVEN)
    phi = simulated["volume_fraction"].broadcast_like(ratio).transpose(*ratio.dims)
    known = [name for end in ERRORS if (name := f"spacing_variation{end}") in simulated]
    errors = [simulated[name].isel(station=-1).fillna(0) / entered for name in known]
    error = sum(errors, 0 * ratio).transpose(*ratio.dims)
    dims = {"deborah": simulated["deborah"].values}
    shown = xr.Dataset(
        {
            "simulated_variation": (
                ("deborah", "condition"),
                ratio.values,
                {"long_name": "the same of simulated trains", "units": "1"},
            ),
            "simulated_variation_error": (
                ("deborah", "condition"),
                error.values,
                {"long_name": "error of that, of the CV at the outlet", "units": "1"},
            ),
            "simulated_volume_fraction": (
                ("deborah", "condition"),
                phi.values,
                {"long_name": "their volume fraction in the channel", "units": "1"},
            ),
        },
        coords=dims,
    )
    return kept.merge(shown.reindex(deborah=found["deborah"].values))
