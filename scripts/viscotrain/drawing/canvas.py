"""Pictures of the channel: spheres, walls, words and marks in a frame of bytes.

Lengths are true: a point z of a window that begins at z_0 and is w wide is at pixel W (z - z_0)/w
of a frame W pixels wide, the channel is W/w pixels high, a sphere d/D times that. Spheres closer
than `TOUCHING` to a neighbour have a colour of their own.
"""

import functools
import math
from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageColor, ImageDraw, ImageFont

from viscotrain.drawing.style import BLUE, VERMILLION
from viscotrain.trains.sizes import contact
from viscotrain.trains.statistics import touching

REFERENCE_WIDTH = 1280  # pixels, for which the sizes of text and margins below are
TEXT, SMALL_TEXT = 24, 19  # pixels
THICK = 3  # of walls and arrows
WHITE, BLACK = (255, 255, 255), (0, 0, 0)
WATER, WALL, GREY_TEXT = (234, 241, 246), (60, 60, 60), (110, 110, 110)
SHADOW = (150, 170, 185)
SPHERE_COLOUR, TOUCHING_COLOUR = (np.array(ImageColor.getrgb(name)) for name in (BLUE, VERMILLION))


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

    def column(self, z) -> NDArray:
        """Where z, in D, is, in pixels from the left of the frame."""
        return (np.asarray(z) - self.start) * self.scale


def draw_spheres(frame: NDArray, view: View, z: NDArray, diameter: NDArray, confinement: float):
    """Paint spheres with smooth edges into a frame, shape (height, width, 3), of bytes.

    Args:
        frame: Changed in place.
        view: Where the channel is in it.
        z: Positions in D, ascending, without NaN.
        diameter: Of the spheres over their mean.
        confinement: d/D, of the mean diameter.
    """
    radii = confinement * diameter * view.scale / 2
    height, width = frame.shape[:2]
    near_ones = touching(z, confinement, contact(diameter - 1))
    for column, radius, near in zip(view.column(z), radii, near_ones, strict=True):
        left, right = max(math.floor(column - radius), 0), min(math.ceil(column + radius), width)
        top = max(math.floor(view.axis - radius), 0)
        bottom = min(math.ceil(view.axis + radius), height)
        if left >= right:
            continue
        x = np.arange(left, right) + 0.5 - column
        y = np.arange(top, bottom)[:, None] + 0.5 - view.axis
        covered = np.clip(radius + 0.5 - np.hypot(x, y), 0, 1)[..., None]  # of each pixel
        colour = TOUCHING_COLOUR if near else SPHERE_COLOUR
        patch = frame[top:bottom, left:right]
        patch[:] = np.rint(patch + covered * (colour - patch.astype(float))).astype(np.uint8)


class Canvas:
    """A picture under construction; places and sizes are those of one `REFERENCE_WIDTH` wide."""

    def __init__(self, image: Image.Image):
        self.image, self.unit = image, image.width / REFERENCE_WIDTH
        self.draw = ImageDraw.Draw(image)

    @classmethod
    def blank(cls, width: int, height: float) -> "Canvas":
        """A white one, `width` pixels wide."""
        return cls(Image.new("RGB", (width, _even(height * width / REFERENCE_WIDTH)), WHITE))

    def copy(self) -> "Canvas":
        """One that can be painted on while this one stays as it is."""
        return Canvas(self.image.copy())

    def text(self, x: float, y: float, words: str, anchor="lm", size=TEXT, fill=BLACK):
        """Words at a place; the anchor is that of Pillow: l, m, r and t, m, b."""
        self.draw.text((x * self.unit, y * self.unit), words, fill, _font(size * self.unit), anchor)

    def box(self, left: float, top: float, right: float, bottom: float, fill):
        """A filled rectangle, without its right and lower edge, at least a pixel thick."""
        left, top = round(left * self.unit), round(top * self.unit)
        right = max(left, round(right * self.unit) - 1)
        self.draw.rectangle((left, top, right, max(top, round(bottom * self.unit) - 1)), fill)

    def channel(self, view: View):
        """Fluid between walls, over the whole width; the view is in pixels."""
        half, axis = view.scale / 2 / self.unit, view.axis / self.unit
        self.box(0, axis - half - THICK, REFERENCE_WIDTH, axis + half + THICK, WALL)
        self.box(0, axis - half, REFERENCE_WIDTH, axis + half, WATER)

    def arrow(self, x: float, y: float):
        """The direction of the flow."""
        self.box(x, y - THICK / 2, x + 60, y + THICK / 2, BLACK)
        head = [(x + 56, y - 8), (x + 76, y), (x + 56, y + 8)]
        self.draw.polygon([(a * self.unit, b * self.unit) for a, b in head], BLACK)

    def pointer(self, x: float, y: float):
        """A triangle whose upper corner is at a place: the mark of a station."""
        corners = [(x, y), (x - 9, y + 14), (x + 9, y + 14)]
        self.draw.polygon([(a * self.unit, b * self.unit) for a, b in corners], WALL)

    def ring(self, column: float, row: float, radius: float):
        """A circle around a point, in pixels: where a sphere was."""
        box = (column - radius, row - radius, column + radius, row + radius)
        self.draw.ellipse(box, outline=SHADOW, width=max(1, round(2 * self.unit)))

    def disc(self, x: float, y: float, colour: str):
        """A mark of the legend."""
        box = [self.unit * place for place in (x - 9, y - 9, x + 9, y + 9)]
        self.draw.ellipse(box, ImageColor.getrgb(colour))


def _even(pixels: float) -> int:
    """yuv420p keeps colours for squares of two by two pixels."""
    return 2 * math.ceil(pixels / 2)


@functools.cache
def _font(size: float) -> ImageFont.FreeTypeFont:
    """The font of the figures, which comes with matplotlib."""
    path = Path(matplotlib.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")
    return ImageFont.truetype(path, size)
