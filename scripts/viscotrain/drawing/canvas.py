r"""Pictures of the channel for movies: spheres, walls, words and marks, by matplotlib's Agg.

Lengths are true: a point z of a window that begins at z_0 and is w wide is at pixel W (z - z_0)/w
of a frame W pixels wide, the channel is W/w pixels high, a sphere d/D times that. Spheres closer
than `TOUCHING` to a neighbour have a colour of their own.

What stands still is drawn once; of a frame only spheres and a few words are. With about 45 spheres
a frame of 1280 x 792 takes 3.8 ms of CPU so, a station's (1280 x 276) 1.7 ms; if all of it is drawn
each time, some 27 ms. Discs and words painted into arrays of their own with numpy and Pillow took
3.8 and 0.8 ms. Of the former the discs were 1.6 ms; they take 4.3 with Pillow's discs at four times
the size, 0.8 with Skia, 0.5 with OpenCV: less than the encoding, for one more dependency.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Text
from numpy.typing import ArrayLike, NDArray

from viscotrain.drawing.style import BLUE, STYLE, VERMILLION
from viscotrain.trains.sizes import contact
from viscotrain.trains.statistics import touching

REFERENCE_WIDTH = 1280  # pixels, for which all sizes and places are
DPI = 100  # of a picture as wide as this
POINT = 72 / DPI  # of a pixel of it
TEXT, SMALL_TEXT = 24, 19  # pixels
THICK = 3  # of walls and arrows
WATER, WALL, GREY_TEXT, SHADOW = "#EAF1F6", "#3C3C3C", "#6E6E6E", "#96AAB9"
SLIVER = 1e-3  # pixels: matplotlib cuts sizes, which are inches, to whole pixels


class View(NamedTuple):
    """A piece of the channel in a frame: where it begins, its scale, where its axis is.

    Attributes:
        start: z of the left edge, in D.
        scale: Pixels per D.
        axis: Row of the channel's axis, in pixels from the top of the frame.
    """

    start: float
    scale: float
    axis: float

    def column(self, z: ArrayLike) -> NDArray:
        """Where z, in D, is, in pixels from the left of the frame."""
        return (np.asarray(z) - self.start) * self.scale


class Canvas:
    """A picture; places and sizes are those of one `REFERENCE_WIDTH` wide, from its upper left.

    Args:
        width: Of the frames, in pixels.
        height: As all places.
    """

    def __init__(self, width: int, height: float):
        self.unit = width / REFERENCE_WIDTH
        # yuv420p keeps colours for squares of two by two pixels
        pixels = np.array([width, 2 * math.ceil(height * self.unit / 2)])
        dpi = DPI * self.unit
        figure = Figure(figsize=tuple((pixels + SLIVER) / dpi), dpi=dpi, facecolor="white")
        self.agg = FigureCanvasAgg(figure)
        self.axes = figure.add_axes((0, 0, 1, 1))
        self.axes.set(xlim=(0, REFERENCE_WIDTH), ylim=(pixels[1] / self.unit, 0))
        self.axes.axis("off")

    def text(self, x: float, y: float, words: str, ha="left", size=TEXT, **more: Any) -> Text:
        """Words at a place, beside or above which they begin, end or have their middle."""
        look = {"ha": ha, "va": "center", "size": size * POINT, "family": STYLE["font.family"]}
        return self.axes.text(x, y, words, parse_math=False, **look | more)

    def box(self, left: float, top: float, right: float, bottom: float, colour: str) -> Rectangle:
        """A filled rectangle."""
        box = Rectangle((left, top), right - left, bottom - top, facecolor=colour, lw=0)
        return self.axes.add_patch(box)

    def mark(self, x: float, y: float, marker: str, colour: str, **more: Any):
        """A mark of the legend or of the scale, in matplotlib's words."""
        look = {"color": colour, "ms": 18 * POINT, "mew": 0, "clip_on": False}
        self.axes.plot(x, y, marker, **look | more)

    def channel(self, view: View):
        """Fluid between walls, over the whole width."""
        half, axis = view.scale / 2 / self.unit, view.axis / self.unit
        self.box(0, axis - half - THICK, REFERENCE_WIDTH, axis + half + THICK, WALL)
        self.box(0, axis - half, REFERENCE_WIDTH, axis + half, WATER)

    def arrow(self, x: float, y: float):
        """The direction of the flow."""
        look = {"arrowstyle": "-|>", "lw": THICK * POINT, "color": "black", "mutation_scale": 16}
        self.axes.annotate("", (x + 76, y), (x, y), arrowprops=look)

    def spheres(self, **look: Any) -> EllipseCollection:
        """None yet; `place` puts them somewhere, and gives them colours if they have none."""
        none = EllipseCollection([], [], 0, units="xy", offset_transform=self.axes.transData)
        none.set(**look or {"lw": 0})
        return self.axes.add_collection(none, autolim=False)

    def place(
        self,
        spheres: EllipseCollection,
        views: Sequence[View],
        z: NDArray,
        diameter: NDArray,
        confinement: float,
    ):
        """Put spheres where they are in all views.

        Args:
            spheres: From `spheres`.
            views: Pieces of the channel.
            z: Positions in D, ascending, NaN where there is none, shape (sphere,).
            diameter: Of the spheres over their mean, same shape.
            confinement: d/D, of the mean diameter.
        """
        there = np.isfinite(z)
        z, ratio = z[there], diameter[there]
        places = [(column, view.axis) for view in views for column in view.column(z)]
        sizes = [confinement * view.scale / self.unit * ratio for view in views]
        spheres.set(
            offsets=np.reshape(places, (-1, 2)) / self.unit,
            widths=np.concatenate(sizes),
            heights=np.concatenate(sizes),
        )
        if not spheres.get_linewidth()[0]:
            near = touching(z, confinement, contact(ratio - 1))
            spheres.set_facecolor(np.tile(np.where(near, VERMILLION, BLUE), len(views)))

    def frames(
        self, count: int, moving: Sequence[Artist], update: Callable[[int], None]
    ) -> Iterator[NDArray]:
        """Pictures as arrays of bytes, shape (height, width, 3).

        Args:
            count: Of the frames.
            moving: What is not the same in all of them.
            update: Changes that for the frame of a number.
        """
        for artist in moving:
            artist.set_animated(True)
        self.agg.draw()
        still = self.agg.copy_from_bbox(self.axes.bbox)
        for n in range(count):
            update(n)
            self.agg.restore_region(still)
            for artist in moving:
                self.axes.draw_artist(artist)
            yield np.array(self.agg.buffer_rgba())[..., :3]
