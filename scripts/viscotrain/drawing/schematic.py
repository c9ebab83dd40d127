"""Schematic: the triplet and the train, to scale, from the geometry code and the config.

Triplet: `geometry.Geometry` of one geometry of the table, in the tube that is simulated. Train:
spheres at the inlet at random distances, an example, and an ideal outlet, where all distances are
the mean one, whether trains of the study order or not: a drawing knows only of the mean, and says
so. Diameters and distances are in proportion; the channel between inlet and outlet is left out. The
section of a duct, whose smaller side is D, stands beside the train, with the inscribed tube.

Distances s_p, s_f and their mean <s> are lengths, given in d.
"""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from viscotrain.config.device_settings import (
    SchematicSettings,
)
from viscotrain.drawing.conventions import MEAN_SPACING
from viscotrain.drawing.style import GREY, PAGE, SMALL, STYLE, Drawing, styled
from viscotrain.flow.geometry import Geometry
from viscotrain.fluid.parameters import CHANNEL_RADIUS
from viscotrain.words import PARTICLES

FLUID, SPHERE = "#EAF1F6", "#DDDDDD"
ENTERING = (0.55, 1.5, 0.75, 1.3)  # distances at the inlet over the mean one, an example
OMITTED = 1.6  # from the last sphere near the inlet to the first near the outlet, as drawn
BOTTOM, TOP = -0.56, 0.56  # of what is drawn of the triplet, in D
LINE = 0.15  # height of a line of text in inches
LEAVING = 3  # spheres that are drawn at the outlet
SECTION_GAP = (
    0.35  # from what is drawn of the flow behind the outlet to the section of a duct, in D
)
ARROW = {
    "arrowstyle": "<|-|>",
    "lw": 0.7,
    "color": "black",
    "shrinkA": 0,
    "shrinkB": 0,
    "mutation_scale": 6,
}
FLOW = {"arrowstyle": "-|>", "lw": 1.2, "color": "black"}


def geometry(study: SchematicSettings, velocity: float) -> xr.Dataset:
    """Positions of the spheres that are drawn, in D; the middle sphere of the triplet is at 0.

    Args:
        study: What is drawn.
        velocity: Of spheres in Ubar, at the De of `study`, about that on the axis.
    """
    sp, sf = (_typical(nodes, part) for nodes, part in ((study.sp, 3), (study.sf, 2)))
    triplet = Geometry.triplet(study.confinement, sp, sf, study.margin)
    middle = triplet.positions[triplet.spheres.index("middle")]
    phi = study.volume_fraction / (velocity if study.feed else 1.0)
    spacing = study.section.mean_spacing(study.confinement, phi) * study.confinement
    shares = np.maximum(np.array(ENTERING) * spacing, 1.05 * study.confinement)
    leaving = study.channel_length - spacing * (0.4 + np.arange(LEAVING))[::-1]
    values = {
        "triplet_position": (("sphere",), np.array(triplet.positions) - middle),
        "entering_position": (("entering",), np.concatenate([[0.0], np.cumsum(shares)])),
        "leaving_position": (("leaving",), leaving),
        "box_start": ((), -middle),
        "box_end": ((), triplet.length - middle),
        "confinement": ((), study.confinement),
        "sp": ((), sp),
        "sf": ((), sf),
        "mean_spacing": ((), spacing),
        "volume_fraction": ((), phi),
        "feed_volume_fraction": ((), phi * velocity),
        "deborah": ((), study.deborah),
        "channel_length": ((), study.channel_length),
        "inscribed_share": ((), study.section.inscribed_share),
        "section_width": ((), study.section.aspect_ratio),
    }
    texts = {
        "triplet_position": "positions over channel diameter, from the middle sphere",
        "entering_position": "positions over channel diameter, from the inlet",
        "leaving_position": "positions over channel diameter, from the inlet",
        "box_start": "upstream end of the periodic box over channel diameter",
        "box_end": "downstream end of the periodic box over channel diameter",
        "confinement": "sphere over channel diameter",
        "sp": "distance of middle to trailing sphere over sphere diameter",
        "sf": "distance of leading to middle sphere over sphere diameter",
        "mean_spacing": "mean distance in the train over channel diameter",
        "volume_fraction": "volume fraction of spheres in the channel",
        "feed_volume_fraction": "volume fraction of spheres in what is poured in, about: those on "
        "the axis are 1 to 3 % slower than the flow there, if they are small",
        "deborah": "Deborah number, as the study defines it",
        "channel_length": "length of the channel over its diameter",
        "inscribed_share": "area of the tube that fits the channel over that of the channel",
        "section_width": "larger side of the section over the channel diameter",
    }
    data = xr.Dataset(
        values, coords={"sphere": list(triplet.spheres)}, attrs=study.section.attributes
    )
    for name, text in texts.items():
        data[name].attrs = {"long_name": text, "units": "1"}
    data["sphere"].attrs["long_name"] = "sphere of the triplet"
    return data


def _typical(nodes, part: int) -> float:
    """A finite distance of the table that can be seen, some way from the smallest."""
    finite = [s for s in nodes if math.isfinite(s)]
    return finite[len(finite) // part]


@styled
def draw(data: xr.Dataset) -> Drawing:
    """The triplet in its periodic box above, the train in the channel below."""
    figure = Figure(layout="constrained")
    figure.get_layout_engine().set(hspace=0.05)
    widths = _triplet_width(data), _train_width(data)
    bottom, top = _train_limits(data)
    spans = TOP - BOTTOM, top - bottom
    heights = [PAGE * span / width for span, width in zip(spans, widths, strict=True)]  # to scale
    figure.set_size_inches(PAGE, sum(heights) + 0.6)
    upper, lower = figure.subplots(2, 1, height_ratios=heights)
    _draw_triplet(upper, data)
    _draw_train(lower, data)
    return Drawing(figure, data)


def _triplet_width(data: xr.Dataset) -> float:
    return float(data["box_end"] - data["box_start"]) + 0.2


def _train_width(data: xr.Dataset) -> float:
    section = SECTION_GAP + float(data["section_width"]) if "channel" in data.attrs else 0.0
    return _outlet(data) + 1.55 + section


def _line(data: xr.Dataset) -> float:
    """Height of a line of text beside the train, in D."""
    return LINE * _train_width(data) / PAGE


def _train_limits(data: xr.Dataset) -> tuple[float, float]:
    """Bottom and top of what is drawn of the train in D: text stands outside of the channel."""
    return -0.5 - 2.3 * _line(data), 0.5 + 2 * _line(data)


def _outlet(data: xr.Dataset) -> float:
    """Where the outlet is drawn, behind the part of the channel that is left out."""
    before, after = data["entering_position"].values[-1], data["leaving_position"].values[0]
    return float(before + OMITTED + data["channel_length"] - after)


def _draw_triplet(axes: Axes, data: xr.Dataset):
    z, beta = data["triplet_position"].values, float(data["confinement"])
    start, end = float(data["box_start"]), float(data["box_end"])
    _draw_channel(axes, start, end)
    for position, name in zip(z, data["sphere"].values, strict=True):
        _draw_sphere(axes, position, beta)
        words = f"{PARTICLES.index(name) + 1}\n{name}"
        axes.annotate(
            words,
            (position, -beta / 2),
            (position + {"trailing": -0.25, "middle": 0, "leading": 0.25}[name], -0.37),
            ha="center",
            va="center",
            fontsize=SMALL,
            arrowprops={"arrowstyle": "-", "lw": 0.4, "color": GREY, "shrinkB": 0},
        )
    for left, right, name in zip(z[:-1], z[1:], ("$s_p$", "$s_f$"), strict=True):
        _measure(axes, (left, 0.2), (right, 0.2), name, (0, 0.09))
        for place in (left, right):
            axes.plot([place, place], [0, 0.23], color=GREY, lw=0.4)
    leading = z[-1] + beta / 2 + 0.12
    _measure(axes, (leading, -beta / 2), (leading, beta / 2), "$d$", (0.07, 0))
    _measure(axes, (start + 0.55, -0.5), (start + 0.55, 0.5), "$D$", (0.09, 0.25))
    axes.annotate("", (start + 1.25, 0), (start + 0.8, 0), arrowprops=FLOW)
    axes.text(start + 1.02, 0.1, "mean velocity $\\bar{U}$", ha="center", fontsize=SMALL)
    axes.plot([start, end], [0, 0], color=GREY, lw=0.5, ls=(0, (6, 3, 1, 3)), zorder=1)
    for place in (start, end):
        axes.plot([place, place], [-0.5, 0.5], color=GREY, lw=1, ls="--")
    words = "dashed ends: periodic, up to the pressure drop"
    axes.text(end - 0.05, 0.38, words, ha="right", fontsize=SMALL)
    inside = ", in the inscribed tube" if "channel" in data.attrs else ""
    title = (
        f"triplet of the simulation{inside}: "
        f"$s_p$ = {float(data['sp']):g} $d$, $s_f$ = {float(data['sf']):g} $d$, "
        f"$\\beta$ = $d/D$ = {beta:g} (to scale)"
    )
    axes.set_title(title, loc="left")
    axes.set(xlim=(start - 0.1, start - 0.1 + _triplet_width(data)))


def _draw_train(axes: Axes, data: xr.Dataset):
    beta, length = float(data["confinement"]), float(data["channel_length"])
    entering, leaving = data["entering_position"].values, data["leaving_position"].values
    end = _outlet(data)
    shift = end - length
    _draw_channel(axes, 0.0, end)
    for z in (*entering, *(leaving + shift)):
        _draw_sphere(axes, z, beta)
    middle = entering[-1] + OMITTED / 2
    axes.add_patch(Rectangle((middle - 0.18, -0.6), 0.36, 1.2, facecolor="white", lw=0, zorder=4))
    for side in (-0.18, 0.18):
        axes.plot(
            [middle + side - 0.06, middle + side + 0.06],
            [-0.56, 0.56],
            color=GREY,
            lw=0.8,
            zorder=5,
        )
    n, line = 2, _line(data)  # the sphere whose distances are named
    above, below = 0.5 + line / 2, -0.5 - 0.7 * line
    last = leaving + shift
    for left, right, name in (
        (*entering[n - 1 : n + 1], "$s_p$"),
        (*entering[n : n + 2], "$s_f$"),
        (*last[-2:], f"${MEAN_SPACING}$"),
    ):
        _measure(axes, (left, above), (right, above), name, (0, line * 0.8))
    for place in (*entering[n - 1 : n + 2], *last[-2:]):
        axes.plot([place, place], [0, above], color=GREY, lw=0.4)
    for place, name in zip(entering[n - 1 : n + 2], ("$i-1$", "$i$", "$i+1$"), strict=True):
        axes.text(place, -beta / 2 - line / 4, name, ha="center", va="top", fontsize=SMALL)
    for place, row, name in (
        (0.0, below, "inlet, $z$ = 0"),
        (end, below, f"outlet, $z$ = {length:g} $D$"),
        (entering[1:].mean(), below - line, "enters at random distances"),
        (last.mean(), below - line, "ideal: equally spaced (not computed)"),
    ):
        axes.text(place, row, name, ha="center", va="center", fontsize=SMALL)
    for place in (0.0, end):
        axes.plot([place, place], [-0.5, 0.5], color=GREY, lw=0.6)
    axes.annotate("", (-0.1, 0), (-0.55, 0), arrowprops=FLOW)
    axes.annotate("", (end + 0.6, 0), (end + 0.15, 0), arrowprops=FLOW)
    phi = 100 * float(data["volume_fraction"])
    spacing = float(data["mean_spacing"]) / beta
    title = (
        f"train: $\\phi$ = {phi:.3g} % in the channel (more in the feed), "
        f"mean spacing ${MEAN_SPACING}$ = ${_law(data)}\\,d\\,\\beta^2/\\phi$ = {spacing:.3g} $d$"
    )
    if "channel" in data.attrs:
        _draw_section(axes, data, _train_width(data) - 0.85)
    axes.set_title(title, loc="left")
    axes.set(xlim=(-0.75, _train_width(data) - 0.75), ylim=_train_limits(data))


def _law(data: xr.Dataset) -> str:
    """The factor of the spacing law of the channel."""
    if "channel" not in data.attrs:
        return "\\frac{2}{3}"
    return f"{2 / 3 * float(data['inscribed_share']):.3f}"


def _draw_section(axes: Axes, data: xr.Dataset, end: float):
    """Section of a duct, which ends at some place of the axes, with sphere and inscribed tube."""
    width, R = float(data["section_width"]), CHANNEL_RADIUS
    middle = end - width / 2
    walls = Rectangle((end - width, -R), width, 2 * R, facecolor=FLUID, edgecolor="black", lw=1.5)
    axes.add_patch(walls)
    axes.add_patch(Circle((middle, 0), R, facecolor="none", edgecolor=GREY, ls="--", lw=0.8))
    _draw_sphere(axes, middle, float(data["confinement"]))
    _measure(axes, (middle, -R), (middle, R), "", (0, 0))
    axes.text(middle + 0.06, 0.3, "$D$", fontsize=STYLE["font.size"], va="center")
    words = f"{data.attrs['channel'].partition(':')[0]}\n(dashed: simulated)"
    axes.text(middle, -0.5 - _line(data), words, ha="center", va="center", fontsize=SMALL)


def _draw_channel(axes: Axes, start: float, end: float):
    """Fluid between two walls."""
    R = CHANNEL_RADIUS
    axes.add_patch(Rectangle((start, -R), end - start, 2 * R, facecolor=FLUID, lw=0, zorder=0))
    for wall in (-R, R):
        axes.plot([start, end], [wall, wall], color="black", lw=1.5, solid_capstyle="butt")
    axes.set(aspect="equal", ylim=(BOTTOM, TOP))
    axes.axis("off")


def _draw_sphere(axes: Axes, z: float, beta: float):
    sphere = Circle((z, 0), beta / 2, facecolor=SPHERE, edgecolor="black", lw=0.7, zorder=3)
    axes.add_patch(sphere)


def _measure(axes: Axes, start, end, name: str, aside):
    """An arrow with two heads between two points, and the name of the distance beside it."""
    axes.annotate("", end, start, arrowprops=ARROW, zorder=4)
    middle = np.add(start, end) / 2 + aside
    axes.text(*middle, name, ha="center", va="center", fontsize=STYLE["font.size"], zorder=5)
