r"""What signs, distances, errors, limits and conditions look like and are called in all figures.

A relative velocity is that of the sphere ahead minus that of the one behind: positive is repulsion
(the gap opens, red), negative attraction (the gap closes, blue). Distances s, centre to centre, in
d, are drawn on 1 - 1/s, the coordinate of the interpolant from contact (0) to infinity (1), with
ticks labelled by s; their mean is <s>. Holes of the table are crosses and are never painted over;
nodes that are not accurate, by the estimate of their error, are open. z is the position along the
channel and L its length, both in D.

| look | means |
|---|---|
| hatched | below the error: the sign is not known |
| grey | closer than the distances of the table |
| dotted area | unstable: equally spaced spheres drift apart |
| dash-dotted line | CV up to which a train counts as ordered |
| dashed line | length of the channel |
"""

import math
from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from viscotrain.drawing.style import GREY, PALE_GREY
from viscotrain.table.memory import remark as memory_remark
from viscotrain.trains.variables import (
    SPHERE_RATE,
    amounts_in_words,
    described,
    rate_in_words,
    unequal,
)

SIGNED = "RdBu_r"
REPULSION, ATTRACTION = ("repulsion", "gap opens"), ("attraction", "gap closes")
REPULSION_COLOUR, ATTRACTION_COLOUR = "#B2182B", "#2166AC"  # towards the ends of RdBu_r
DISTANCE_TICKS = (1, 1.2, 1.5, 2, 3, 5, 10, math.inf)
MARK = "\N{DAGGER}"  # of Deborah numbers with a remark
BECAUSE = "stress lags behind the spheres"  # beyond the quasi-steady range
INJECTIONS = {
    "uniform": "random (gaps uniformly distributed)",
    "poisson": "random (Poisson)",
    "even": "equally spaced",
}
ORDERING = "GnBu_r"  # colours of the ordering length over that of the channel: dark is short
ORDERING_LIMITS, ORDERING_TICKS = (0.1, 30), (0.1, 0.3, 1, 3, 10, 30)
MEAN_SPACING = r"\langle s\rangle"
POSITION = "position along the channel, $z$ [$D$]"
BELOW_ERROR = {"facecolor": "none", "edgecolor": GREY, "hatch": "////", "linewidth": 0}
CLOSER_THAN_TABLE = {"facecolor": PALE_GREY, "linewidth": 0}
UNSTABLE = {"facecolor": "white", "edgecolor": GREY, "hatch": "...", "linewidth": 0}
ORDERED = {"color": "black", "lw": 0.8, "ls": "-."}  # threshold of the CV
CHANNEL = {"color": "black", "lw": 0.8, "ls": "--"}  # its length
FRACTION_AXES = {
    "volume_fraction": r"volume fraction in the channel, $\phi$ [%]",
    "feed_volume_fraction": r"volume fraction in the feed, $\phi_{feed}$ [%]",
}
GRID = 241  # points per axis of a drawn interpolant


def distance_coordinate(distance: ArrayLike) -> NDArray:
    """Where a distance is drawn: contact at 0, infinity at 1."""
    return 1.0 - 1.0 / np.asarray(distance, dtype=float)


def all_distances() -> NDArray:
    """From contact to infinity, evenly on the drawn axis."""
    with np.errstate(divide="ignore"):
        return 1.0 / (1.0 - np.linspace(0.0, 1.0, GRID))


def distance_axis(axis: Axis):
    """Ticks of an axis on which distances are drawn."""
    axis.set_ticks(
        distance_coordinate(DISTANCE_TICKS),
        ["\N{INFINITY}" if math.isinf(s) else f"{s:g}" for s in DISTANCE_TICKS],
    )


def power_of_ten(limit: float) -> int:
    """Power of ten by which values up to `limit` are drawn."""
    return math.floor(math.log10(limit)) if limit > 0 else 0


def velocity_unit(power: int) -> str:
    """The unit of velocities drawn by this power of ten."""
    return r"[$\bar{U}$]" if power == 0 else rf"[$10^{{{power}}}\,\bar{{U}}$]"


def draw_closer_than_table(axes: Axes, smallest_distance: float, both: bool = True):
    """Grey out distances below the table's, on the horizontal axis or on both."""
    edge = float(distance_coordinate(smallest_distance))
    axes.axvspan(0, edge, **CLOSER_THAN_TABLE)
    if both:
        axes.fill_between([edge, 1], 0, edge, **CLOSER_THAN_TABLE)


def draw_ordered(axes: Axes, variation: float) -> Line2D:
    """The CV up to which a train counts as ordered, with its label for the legend."""
    words = f"counts as ordered: CV \N{LESS-THAN OR EQUAL TO} {variation:g}"
    return axes.axhline(variation, label=words, **ORDERED)


def scientific(value: float) -> str:
    """One digit times a power of ten."""
    digits, power = f"{value:.0e}".split("e")
    return rf"{digits}$\cdot$10$^{{{int(power)}}}$"


def conditions(deborah: float, confinement: float, *, remark: str = "") -> str:
    """The conditions of a flow in words; below them a remark."""
    return f"De = {deborah:g},  $d/D$ = {confinement:g}" + (f"\n{remark}" if remark else "")


def train_conditions(data: xr.Dataset) -> str:
    """The conditions of a train in words: of the flow, how much enters by which law, a remark."""
    flow = conditions(float(data["deborah"]), float(data["confinement"]))
    below = [amounts(data), *filter(None, [beyond(data)])]
    between = "\n" if unequal(data) else ",  "  # of a line as long as a column
    return f"{flow}{between}{injection_in_words(data)}\n" + "\n".join(below)


def injection_in_words(data: xr.Dataset) -> str:
    """At which intervals spheres enter, and how much their diameters vary."""
    return f"injection: {INJECTIONS[data.attrs['injection']]}{unequal(data)}"


def with_sphere_rate(train: xr.Dataset, units: xr.Dataset | None) -> xr.Dataset:
    """A train with `sphere_rate`, the spheres that enter in a second; NaN at De = 0.

    Args:
        train: With its `injection_rate`.
        units: Physical units of the study; None leaves the train as it is.
    """
    if units is None:
        return train
    seconds = float(units["time"].sel(deborah=float(train["deborah"])))
    rate = float(train["injection_rate"]) / seconds
    return train.assign(sphere_rate=described(rate, [], SPHERE_RATE, units="s-1"))


def amounts(data: xr.Dataset) -> str:
    """The volume fractions in the channel and in the feed, and spheres/s if known, in words."""
    phi, feed = amounts_in_words(data)
    rate = float(data.get("sphere_rate", math.nan))
    enter = f", {rate_in_words(rate)} spheres/s" if math.isfinite(rate) else ""
    return rf"$\phi$ = {phi} % in the channel, {feed} % in the feed{enter}"


def marked_deborah(deborah: float, remark: str) -> str:
    """De in words, with a mark if there is a remark, as where many De share a legend."""
    return f"De = {deborah:g}" + (f" {MARK}" if remark else "")


def beyond(dataset: xr.Dataset) -> str:
    """What to say if a condition is beyond the quasi-steady range, and why; else empty."""
    words = memory_remark(dataset)
    return words and f"{words}: {BECAUSE}"


def remarks(dataset: xr.Dataset) -> list[str]:
    """Of each Deborah number of a map or of a table: what `beyond` says."""
    return [beyond(dataset.sel(deborah=De)) for De in dataset["deborah"].values]


def mark_explained(remarks: Iterable[str]) -> str:
    """A line that says what the mark means, if one of the remarks is not empty."""
    words = next(filter(None, remarks), "")
    return f"\n{MARK} {words}" if words else ""
