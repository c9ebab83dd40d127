r"""Figure of beads in droplets: against the droplet frequency, and over all conditions.

Left: P(0), P(1) and P(2+) of the best condition against the droplet frequency over the rate of the
beads, with those of beads at random times. Right: P(1) of all conditions against what is poured in,
an arrow from what it is as beads enter to what it is at the end of the channel.
"""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

from viscotrain.drawing.style import (
    BLUE,
    GREY,
    MARKER_SIZE,
    PAGE,
    VERMILLION,
    Drawing,
    deborah_look,
    styled,
)
from viscotrain.trains.encapsulation import best_condition
from viscotrain.trains.occupancy import RANDOM_BEST, TOLERANCE, poisson
from viscotrain.trains.variables import rate_in_words

COLOURS = (GREY, BLUE, VERMILLION)  # of 0, 1, 2+ beads
IN_WORDS = ("no bead", "one bead", "two or more")
TICKS = (0.25, 0.5, 1, 2, 4)
RANDOM = (0, (1, 1))  # dashes of beads at random times
FRACTION_TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50)  # %
TOLERATED = {"facecolor": BLUE, "alpha": 0.13, "lw": 0}  # droplet frequencies
ARROW = {"arrowstyle": "->", "lw": 0.8, "shrinkA": 2, "shrinkB": 2, "mutation_scale": 7}
FULL = {"ms": MARKER_SIZE}
SHORT = 0.07  # of the height of the panel: no arrow between symbols that touch or nearly so
RING = {"mfc": "none", "ms": MARKER_SIZE + 3, "mew": 0.8}  # open symbols, about full ones
ROUND = np.outer(10.0 ** np.arange(-3, 7), (1, 2, 5)).ravel()  # droplets per second
STEP = 10.0  # of the limits of shares, %
WIDER = 1.35  # than the volume fractions of the conditions, on either side


@styled
def draw_encapsulation(found: xr.Dataset) -> Drawing:
    """Occupancy against the droplet frequency, and the share of single beads at all conditions.

    Args:
        found: Of `encapsulation.combine`.
    """
    figure = Figure(figsize=(PAGE, 3.5), layout="constrained")
    figure.get_layout_engine().set(wspace=0.06)
    left, right = figure.subplots(1, 2)
    own = best_condition(found)
    _draw_frequencies(left, own)
    _draw_inlet(left, found, own)
    _draw_conditions(right, found)
    for axes in (left, right):
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
    left.set(ylabel="share of droplets [%]", ylim=(0, 100))
    right.set_ylabel("droplets with one bead [%]")
    handles, labels = left.get_legend_handles_labels()
    tolerance = f"one bead within {100 * TOLERANCE:g} % of its best"
    sampling = Patch(facecolor=GREY, alpha=0.3, lw=0)
    handles += [Line2D([], [], color="black", lw=0.8, ls=RANDOM), Patch(**TOLERATED), sampling]
    labels += ["beads at random times (Poisson)", tolerance, "sampling, 95 % (right: bars)"]
    figure.legend(handles, labels, loc="outside lower left", ncols=2)
    figure.legend(loc="outside lower right", ncols=2, **_keys(right))
    return Drawing(figure, found)


def _keys(axes: Axes) -> dict:
    """Legend of the conditions: Deborah numbers at the end, and open as they enter."""
    handles, labels = axes.get_legend_handles_labels()
    both = [Line2D([], [], color=GREY, marker="o", ls="", **look) for look in (RING, FULL)]
    words = ["open: as beads enter", "full: at the end"]
    return {"handles": [*handles, *both], "labels": [*labels, *words]}


def _draw_frequencies(axes: Axes, own: xr.Dataset):
    """One condition against the droplet frequency, with the one asked for, or the best."""
    ratio = own["frequency_ratio"].values
    low, high = (float(own[f"{name}_frequency_ratio"]) for name in ("lowest", "highest"))
    axes.axvspan(np.nan_to_num(low, nan=ratio[0]), np.nan_to_num(high, nan=ratio[-1]), **TOLERATED)
    per_bead = float(own["mean_count"] * own["droplet_frequency_ratio"])
    random = poisson(np.nan_to_num(per_bead, nan=1.0) / ratio)
    for n, (colour, words) in enumerate(zip(COLOURS, IN_WORDS, strict=True)):
        share = 100 * own["occupancy_curve"].values[n]
        error = 100 * np.nan_to_num(own["occupancy_curve_halfwidth"].values[n])
        axes.fill_between(ratio, share - error, share + error, color=colour, alpha=0.3, lw=0)
        axes.plot(ratio, share, color=colour, label=words)
        axes.plot(ratio, 100 * random[n], color=colour, lw=0.8, ls=RANDOM)
    chosen = float(own["droplet_frequency_ratio"])
    rate = float(own["bead_rate"])
    if math.isfinite(chosen):
        best = np.isclose(own["occupancy"].values[1], own["best_single"])
        look = {"color": "black", "marker": "o", "ms": 3, "lw": 0.6}
        words = "the best droplet frequency" if best else "the droplet frequency asked for"
        axes.plot([chosen] * 3, 100 * own["occupancy"], label=words, **look)
        axes.axvline(chosen, color="black", lw=0.6)
    axes.set(xscale="log", xlim=(ratio[0], ratio[-1]))
    axes.set_xlabel("droplet frequency over rate of beads")
    axes.set_xticks(TICKS)
    axes.xaxis.set_minor_locator(NullLocator())
    if math.isfinite(rate):
        other = axes.secondary_xaxis("top", functions=(lambda x: x * rate, lambda F: F / rate))
        first, last = np.searchsorted(ROUND, rate * ratio[[0, -1]])
        other.set_xticks(ROUND[first:last], [f"{value:g}" for value in ROUND[first:last]])
        other.xaxis.set_minor_locator(NullLocator())
        other.set_xlabel("droplets per second")
    phi = 100 * float(own["volume_fraction"])
    where = f"$\\phi$ = {phi:.3g} %,  $z$ = {float(own['station']):g} $D$"
    axes.set_title(f"the best condition: De = {float(own['deborah']):g},  {where}")


def _draw_inlet(axes: Axes, found: xr.Dataset, own: xr.Dataset):
    """Droplets with one bead of the same condition as beads enter."""
    same = [found[name] == own[name] for name in ("deborah", "feed_volume_fraction")]
    inlet = np.flatnonzero((found["station"] == 0) & same[0] & same[1])
    if inlet.size and float(own["station"]) > 0:
        share = 100 * found["occupancy_curve"].values[inlet[0], 1]
        words = f"{IN_WORDS[1]}, as beads enter"
        axes.plot(found["frequency_ratio"], share, color=COLOURS[1], lw=0.8, ls="--", label=words)


def _draw_conditions(axes: Axes, found: xr.Dataset):
    """Share of droplets with one bead of all conditions, at the last station and at the inlet."""
    deborah = np.unique(found["deborah"].values)
    fraction = 100 * found["feed_volume_fraction"].values
    asked = np.isfinite(found["occupancy"].values).all()
    single = found["occupancy"].values[:, 1] if asked else found["best_single"].values
    error = found["occupancy_halfwidth"].values[:, 1]
    error = error if asked else found["best_single_halfwidth"].values
    last, inlet = found["last_station"].values == 1, found["station"].values == 0
    for De in deborah:
        style = deborah_look(De) | {"ls": ""}
        own = found["deborah"].values == De
        axes.plot(fraction[own & inlet], 100 * single[own & inlet], **style | RING)
        at = own & last
        bars = 100 * np.nan_to_num(error[at])
        axes.errorbar(fraction[at], 100 * single[at], bars, lw=0.8, label=f"De = {De:g}", **style)
    axes.axhline(100 * RANDOM_BEST, color="black", lw=0.8, ls=RANDOM)
    limits = fraction.min() / WIDER, fraction.max() * WIDER
    axes.set(xscale="log", xlim=limits, xlabel=r"volume fraction in the feed, $\phi_{feed}$ [%]")
    ticks = [tick for tick in FRACTION_TICKS if limits[0] <= tick <= limits[1]]
    axes.set_xticks(ticks)
    some = 100 * np.array([RANDOM_BEST, *single[np.isfinite(single) & (last | inlet)]])
    axes.set_ylim(STEP * np.floor(some.min() / STEP), STEP * np.ceil(some.max() / STEP + 0.2))
    _draw_arrows(axes, found, 100 * single)
    axes.set_title(_frequency_in_words(found), pad=6)


def _draw_arrows(axes: Axes, found: xr.Dataset, single: np.ndarray):
    """From the inlet to the last station, unless both symbols nearly agree."""
    deborah, fraction = found["deborah"].values, found["feed_volume_fraction"].values
    inlet = found["station"].values == 0
    shortest = SHORT * np.ptp(axes.get_ylim())
    for end in np.flatnonzero(found["last_station"].values == 1):
        same = inlet & (deborah == deborah[end]) & (fraction == fraction[end])
        for start in np.flatnonzero(same & (np.abs(single - single[end]) > shortest)):
            places = ((100 * fraction[n], single[n]) for n in (end, start))
            colour = {"color": deborah_look(float(deborah[end]))["color"]}
            axes.annotate("", *places, arrowprops=ARROW | colour)


def _frequency_in_words(found: xr.Dataset) -> str:
    """Whether all conditions have the droplet frequency that was asked for."""
    asked = found["droplet_frequency_ratio"].values * found["bead_rate"].values
    same = np.isfinite(asked).all() and np.ptp(asked) <= 1e-9 * asked.max()
    if same and found.sizes["condition"] > 1:
        return f"all at {rate_in_words(float(asked[0]))} droplets per second"
    return "each condition at its best frequency"
