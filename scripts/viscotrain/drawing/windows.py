"""Windows on the channel, to scale, for figures and movies: walls, spheres, a scale, and words.

Axes are in D in both directions, so that spheres, walls and scale bar need no conversion: a sphere
is a disc as wide as d/D. Spheres closer than `TOUCHING` to a neighbour have a colour of their own.

A movie is such a figure, of which only the spheres and a few words are drawn for each frame: with
47 spheres one of 1280 x 950 takes 5 ms of CPU so, a station's (1280 x 354) 2 ms; if all of it is
drawn each time, as matplotlib's own animations do to write a file, 37 and 19 ms.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from viscotrain.drawing.style import BLUE, PAGE, VERMILLION
from viscotrain.fluid.parameters import CHANNEL_RADIUS
from viscotrain.fluid.units import MICROMETRES
from viscotrain.trains.sizes import contact
from viscotrain.trains.statistics import TOUCHING, touching

WATER, WALL, SHADOW = "#EAF1F6", "#3C3C3C", "#96AAB9"
SPHERE, MARK = 5, 5  # sizes in legends, points
BESIDE = 1.0  # inches left and right of a window: words and margins
BETWEEN = 0.3  # the same above and below a window, together
MARGIN = 2.0  # d beyond a window: enough to see whether a sphere at its edge touches another
NICE = (1, 2, 5)  # leading digits of a scale bar's length
ABOVE = 0.1  # the wall, in inches: scale bar and direction of the flow
PAD = 0.06  # inches above and below what is in a figure
SLIVER = 1e-3  # pixels: matplotlib cuts sizes, which are inches, to whole pixels


def figure_of_windows(
    count: int, length: float, around: float, below: float | None = None
) -> tuple[Figure, NDArray]:
    """A figure of windows, all as long, one under the other, which are axes; shape (count,).

    Args:
        count: Of windows.
        length: Of a window in D.
        around: Height of words above and below all of them, in inches.
        below: That of one more panel; None: there is none.
    """
    heights = [(PAGE - BESIDE) / length] * count + ([] if below is None else [below])
    height = around + sum(heights) + BETWEEN * len(heights)
    figure = Figure(figsize=(PAGE, height), layout="constrained")
    figure.get_layout_engine().set(h_pad=PAD)
    return figure, figure.subplots(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]


def draw_window(axes: Axes, start: float, length: float) -> EllipseCollection:
    """Fluid between walls from a position in D on, and the spheres that are there, none yet."""
    half = CHANNEL_RADIUS
    axes.set(aspect="equal", xlim=(start, start + length), ylim=(-half, half), yticks=[])
    axes.set_facecolor(WATER)
    axes.spines[["left", "right"]].set_visible(False)
    axes.spines[["top", "bottom"]].set(linewidth=1.2, color=WALL)
    axes.xaxis.set_major_locator(MaxNLocator(6))
    return spheres(axes)


def spheres(axes: Axes, **look: Any) -> EllipseCollection:
    """None yet; `place` puts them somewhere, and gives them colours if they have no look."""
    none = EllipseCollection([], [], 0, units="xy", offset_transform=axes.transData)
    none.set(**look or {"lw": 0})
    return axes.add_collection(none, autolim=False)


def place(spheres: EllipseCollection, z: NDArray, diameter: NDArray, confinement: float):
    """Put spheres where they are.

    Args:
        spheres: From `draw_window` or `spheres`.
        z: Positions in D, ascending, NaN where there is none, shape (sphere,).
        diameter: Of the spheres over their mean, same shape.
        confinement: d/D, of the mean diameter.
    """
    low, high = spheres.axes.get_xlim()
    there = (z > low - MARGIN * confinement) & (z < high + MARGIN * confinement)
    z, ratio = z[there], diameter[there]
    size = confinement * ratio
    spheres.set(offsets=np.column_stack([z, np.zeros(z.size)]), widths=size, heights=size)
    if not spheres.get_linewidth()[0]:
        near = touching(z, confinement, contact(ratio - 1))
        spheres.set_facecolor(np.where(near, VERMILLION, BLUE))


def draw_scale(axes: Axes, channel_diameter: float):
    """Above a window: a scale bar, its length, and the direction of the flow.

    Args:
        axes: From `draw_window`.
        channel_diameter: In mm.
    """
    start, end = axes.get_xlim()
    length, name = scale_bar(end - start, channel_diameter)
    above = CHANNEL_RADIUS + ABOVE * (end - start) / (PAGE - BESIDE)
    axes.plot([start, start + length], [above] * 2, color="black", lw=2.5, clip_on=False)
    middle = {"va": "center", "clip_on": False}
    axes.text(start + 1.1 * length, above, name, **middle)
    axes.text(end, above, r"flow $\longrightarrow$", ha="right", **middle)


def scale_bar(field_of_view: float, channel_diameter: float) -> tuple[float, str]:
    """Length of a scale bar in D, a round one of about a tenth of the window, and its name.

    Args:
        field_of_view: In D.
        channel_diameter: In mm.
    """
    largest = field_of_view / 8 * channel_diameter * MICROMETRES
    power = 10.0 ** math.floor(math.log10(largest))
    length = max(digit * power for digit in NICE if digit * power <= largest)
    name = f"{length / 1e3:g} mm" if length >= 1e3 else f"{length:g} \N{MICRO SIGN}m"
    return length / 1e3 / channel_diameter, name


def draw_station(axes: Axes, station: float):
    """A mark at the wall."""
    axes.plot([station], [-CHANNEL_RADIUS], "^", color="black", ms=MARK, clip_on=False, zorder=5)


def draw_legend(figure: Figure, touching: bool, **others: Line2D):
    """Spheres, those that touch if there are any, and other marks by their words."""
    dot = {"ls": "", "marker": "o", "ms": SPHERE}
    marks = {"sphere": Line2D([], [], color=BLUE, **dot)}
    if touching:
        marks[f"touching ($s$ < {TOUCHING:g} $d$)"] = Line2D([], [], color=VERMILLION, **dot)
    marks |= others
    figure.legend(list(marks.values()), list(marks), loc="outside lower center", ncols=len(marks))


def frames(
    figure: Figure, width: int, count: int, moving: Sequence[Artist], update: Callable[[int], None]
) -> Iterator[NDArray]:
    """Pictures of a figure as arrays of bytes, shape (height, width, 4): opaque RGBA.

    Args:
        figure: As `figure_of_windows` makes it.
        width: Of the pictures, in pixels; they have an even number of rows, as movies need.
        count: Of the frames.
        moving: What is not the same in all of them.
        update: Changes that for the frame of a number.
    """
    inches = figure.get_size_inches()
    dpi = width / inches[0]
    rows = 2 * math.ceil(inches[1] * dpi / 2)
    figure.set_size_inches((width + SLIVER) / dpi, (rows + SLIVER) / dpi)
    figure.set_dpi(dpi)
    agg = FigureCanvasAgg(figure)
    update(0)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # found once, with the words of a frame
    for artist in moving:
        artist.set_animated(True)
    agg.draw()
    still = agg.copy_from_bbox(figure.bbox)
    for n in range(count):
        update(n)
        agg.restore_region(still)
        for artist in moving:
            figure.draw_artist(artist)
        yield np.array(agg.buffer_rgba())
