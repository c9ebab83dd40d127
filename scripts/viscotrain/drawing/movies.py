"""Movies of a flowing train: what the cameras of a film see, with words and marks around it.

Cameras fixed at the stations, and one that moves along (`trains.films`); `canvas` draws to scale.
Words in a frame are physical where De > 0; `labelled` gives a film what they need.
"""

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.patches import Rectangle
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from viscotrain.drawing.canvas import (
    GREY_TEXT,
    POINT,
    REFERENCE_WIDTH,
    SHADOW,
    SMALL_TEXT,
    THICK,
    WALL,
    Canvas,
    View,
)
from viscotrain.drawing.encoding import write
from viscotrain.drawing.scale_bar import scale_bar
from viscotrain.drawing.style import BLUE, VERMILLION
from viscotrain.table.memory import remark
from viscotrain.trains.statistics import TOUCHING
from viscotrain.trains.variables import rate_in_words, unequal

BAR_START = 190  # of the scale bar
HEADER, TICKS, FOOT = 60, 42, 46  # heights above the channel, below it, and below that
ROW_GAP = 34  # between the rows of the moving window
HEAD = 705  # middle of what the header says
ENDS = 120  # beside the line that stands for the channel
RING = 2 * POINT  # around a sphere of the first frame


def _conditions(data: xr.Dataset) -> str:
    phi, feed = (100 * float(data[name]) for name in ("volume_fraction", "feed_volume_fraction"))
    words = remark(data)
    return (
        f"De = {float(data['deborah']):g}   d/D = {float(data['confinement']):g}   "
        f"\N{GREEK SMALL LETTER PHI} = {phi:.3g} %, feed {feed:.3g} %"
        + (f"   {words}" if words else "")
    )


def _entry(data: xr.Dataset) -> str:
    """How many spheres enter, by which law."""
    rate = float(data["injection_rate"]) / float(data["time_scale"])
    enter = f"{rate_in_words(rate)} spheres/s, " if math.isfinite(rate) else ""
    return f"{enter}{data.attrs['injection']} injection{unequal(data)}"


def _place(z: float, data: xr.Dataset) -> str:
    """A position in D and in cm."""
    return f"L/D = {z:.4g} ({z * float(data['channel_diameter']) / 10:.3g} cm)"


def _clock(data: xr.Dataset, times: NDArray, frame_rate: float) -> tuple[Callable, str]:
    """How to write the time of a frame, and how much slower than the flow the movie is."""
    scale = float(data["time_scale"])
    if not math.isfinite(scale):  # De = 0: any small flow rate
        return lambda n: f"t = {times[n]:.2f} D/U\u0304", "U\u0304: mean velocity of the flow"
    seconds = times * scale
    slower = (times.size - 1) / frame_rate / seconds[-1]
    words = f"{slower:.3g}\N{MULTIPLICATION SIGN} slower than real"
    if slower < 1:
        words = f"{1 / slower:.3g}\N{MULTIPLICATION SIGN} faster than real"
    shown, unit = (1e3 * seconds, "ms") if seconds[-1] < 1 else (seconds, "s")
    decimals = max(0, math.ceil(-math.log10(shown[1] - shown[0])))  # every frame has its own
    return lambda n: f"t = {shown[n]:.{decimals}f} {unit}", words


def labelled(film: xr.Dataset, units: xr.Dataset) -> xr.Dataset:
    """A film with its physical units: the channel's diameter in mm, and D/Ubar in s.

    Args:
        film: Result of `films.film`.
        units: Result of `units.physical_units`.
    """
    own = units.sel(deborah=float(film["deborah"]))
    return film.assign(
        channel_diameter=own["channel_diameter"].variable, time_scale=own["time"].variable
    )


def station_view(data: xr.Dataset, station: int, width: int) -> View:
    """Where the channel is in the frames of the camera at a station (its number)."""
    scale = width / float(data["field_of_view"])
    header = HEADER * width / REFERENCE_WIDTH
    return View(float(data["window_start"][station]), scale, header + scale / 2)


def station_frames(
    data: xr.Dataset, station: int, *, width: int, frame_rate: float
) -> Iterator[NDArray]:
    """Frames of the camera at a station (its number), shape (height, width, 3), of bytes.

    Args:
        data: Result of `labelled`.
        station: Its number.
        width: Pixels.
        frame_rate: Frames per second of the movie, which decides how slow it is.
    """
    view = station_view(data, station, width)
    below = HEADER + view.scale * REFERENCE_WIDTH / width
    canvas = Canvas(width, below + TICKS + FOOT)
    time, speed = _clock(data, data["time"].values, frame_rate)
    now = _head(canvas, _place(float(data["station"][station]), data), data)
    canvas.channel(view)
    _ticks(canvas, view, below, float(data["station"][station]))
    _foot(canvas, below + TICKS + FOOT / 2, data, speed)
    canvas.mark(840, below + TICKS + FOOT / 2, "^", WALL)
    canvas.text(857, below + TICKS + FOOT / 2, "station", size=SMALL_TEXT)
    positions, diameters = (data[name].values[station] for name in ("position", "diameter"))
    spheres = canvas.spheres()

    def update(n: int):
        now.set_text(time(n))
        canvas.place(spheres, [view], positions[n], diameters[n], float(data["confinement"]))

    yield from canvas.frames(len(positions), [spheres, now], update)


def moving_views(data: xr.Dataset, n: int, width: int) -> list[View]:
    """The rows of frame n of the camera that moves along, the leading piece first."""
    rows, end = int(data["moving_rows"]), float(data["moving_window_end"][n])
    length = float(data["moving_length"]) / rows
    scale, unit = width / length, width / REFERENCE_WIDTH
    return [
        View(
            end - (row + 1) * length,
            scale,
            HEADER * unit + row * (scale + ROW_GAP * unit) + scale / 2,
        )
        for row in range(rows)
    ]


def moving_frames(data: xr.Dataset, *, width: int, frame_rate: float) -> Iterator[NDArray]:
    """Frames of the camera that moves along, with its place in the channel below.

    Args:
        data: Result of `labelled`.
        width: Pixels.
        frame_rate: Frames per second of the movie.
    """
    views, beta = moving_views(data, 0, width), float(data["confinement"])
    below = (views[-1].axis + views[-1].scale / 2) * REFERENCE_WIDTH / width + 10
    canvas = Canvas(width, below + 2 * FOOT + 16)
    time, speed = _clock(data, data["moving_time"].values, frame_rate)
    now = _head(canvas, f"moving along at {float(data['moving_velocity']):.3f} U\u0304", data)
    for view in views:
        canvas.channel(view)
        if view is not views[-1]:
            y = (view.axis + view.scale / 2) * REFERENCE_WIDTH / width + ROW_GAP / 2
            words = "\u2199 goes on below, on the right"
            canvas.text(16, y, words, size=SMALL_TEXT, color=GREY_TEXT)
    y = below + FOOT / 2 + 4
    _foot(canvas, y, data, speed)
    canvas.mark(840, y, "o", "none", mec=SHADOW, mew=RING)
    canvas.text(857, y, "in the first frame", size=SMALL_TEXT)
    window = _progress(canvas, below + FOOT + 14, data)
    starts = window.get_x() + _along(data)
    positions, diameters = data["moving_position"].values, data["moving_diameter"].values
    first = canvas.spheres(facecolor="none", edgecolor=SHADOW, linewidth=RING)
    canvas.place(first, views, positions[0], diameters[0], beta)
    spheres = canvas.spheres()

    def update(n: int):
        now.set_text(f"{time(n)}\nCV {variation_in_view(data, n):.2f}")
        window.set_x(starts[n])
        canvas.place(spheres, moving_views(data, n, width), positions[n], diameters[n], beta)

    yield from canvas.frames(len(positions), [spheres, now, window], update)


def variation_in_view(data: xr.Dataset, n: int) -> float:
    """Coefficient of variation of the spacings that frame n of the moving camera shows."""
    z, end = data["moving_position"].values[n], float(data["moving_window_end"][n])
    spacing = np.diff(z[(z >= end - float(data["moving_length"])) & (z <= end)])
    return float(spacing.std() / spacing.mean()) if spacing.size else math.nan


def _head(canvas: Canvas, place: str, data: xr.Dataset) -> Text:
    """Place, conditions, and words about the time that are to be filled in."""
    canvas.text(16, HEADER / 2, place)
    lines = list(filter(None, [_conditions(data), _entry(data), data.attrs.get("channel")]))
    size = min(SMALL_TEXT, 0.85 * HEADER / len(lines))
    for n, words in enumerate(lines):
        canvas.text(HEAD, (n + 0.5) / len(lines) * HEADER, words, "center", size)
    return canvas.text(REFERENCE_WIDTH - 16, HEADER / 2, "", "right")


def _ticks(canvas: Canvas, view: View, below: float, station: float):
    """Positions in D below the channel, and a mark at the station."""
    end = view.start + REFERENCE_WIDTH * canvas.unit / view.scale
    for z in MaxNLocator(8, steps=[1, 2, 5, 10]).tick_values(view.start, end):
        x = float(view.column(z)) / canvas.unit
        canvas.box(x - 1, below + THICK, x + 1, below + THICK + 9, WALL)
        if 30 < x < REFERENCE_WIDTH - 30:
            canvas.text(x, below + 30, f"{z:g} D", "center", SMALL_TEXT)
    x = np.clip(float(view.column(station)) / canvas.unit, 10, REFERENCE_WIDTH - 10)
    canvas.mark(x, below + THICK + 7, "^", WALL, ms=14 * POINT)


def _foot(canvas: Canvas, y: float, data: xr.Dataset, speed: str):
    """Flow, scale bar, legend and speed of the movie."""
    canvas.text(16, y, "flow", size=SMALL_TEXT)
    canvas.arrow(66, y)
    length, name = scale_bar(float(data["field_of_view"]), float(data["channel_diameter"]))
    start, end = bar_columns(length, float(data["field_of_view"]))
    canvas.box(start, y - 2.5, end, y + 2.5, "black")
    canvas.text(end + 12, y, name, size=SMALL_TEXT)
    canvas.mark(455, y, "o", BLUE)
    canvas.text(472, y, "sphere", size=SMALL_TEXT)
    canvas.mark(575, y, "o", VERMILLION)
    canvas.text(592, y, f"touching (s* < {TOUCHING:g} d)", size=SMALL_TEXT)
    canvas.text(REFERENCE_WIDTH - 16, y, speed, "right", SMALL_TEXT)


def bar_columns(length: float, field_of_view: float) -> tuple[float, float]:
    """Ends of a scale bar, given in D as the window is, for a frame `REFERENCE_WIDTH` wide."""
    return BAR_START, BAR_START + length / field_of_view * REFERENCE_WIDTH


def _along(data: xr.Dataset) -> NDArray:
    """How far the window has come in each frame, on the line that stands for the channel."""
    start = data["moving_window_end"].values - float(data["moving_length"])
    return start / float(data["channel_length"]) * (REFERENCE_WIDTH - 2 * ENDS)


def _progress(canvas: Canvas, y: float, data: xr.Dataset) -> Rectangle:
    """The whole channel as a line, with its stations, and the window, as long as it is."""
    left, right = ENDS, REFERENCE_WIDTH - ENDS
    canvas.text(left - 16, y, "inlet", "right", SMALL_TEXT)
    canvas.text(right + 16, y, "outlet", size=SMALL_TEXT)
    canvas.box(left, y - THICK / 2, right, y + THICK / 2, WALL)
    per_length = (right - left) / float(data["channel_length"])
    for z in data["station"].values:
        x = left + per_length * z
        canvas.box(x - 1, y - 8, x + 1, y + 8, WALL)
        canvas.text(x, y + 24, f"{z:g} D", "center", SMALL_TEXT)
    width = max(per_length * float(data["moving_length"]), 4)
    return canvas.box(left, y - 8, left + width, y + 8, BLUE)


def make(
    film: xr.Dataset, units: xr.Dataset, folder: str | Path, *, width: int, frame_rate: float
) -> list[Path]:
    """Write the movies of all stations, `station_<L/D>`, and `moving_frame`; their paths.

    Args:
        film: Result of `films.film`.
        units: Result of `units.physical_units`.
        folder: Made if needed.
        width: Pixels of a frame.
        frame_rate: Frames per second.
    """
    data, folder = labelled(film, units), Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    look: dict[str, Any] = {"width": width, "frame_rate": frame_rate}
    paths = [
        write(station_frames(data, n, **look), folder / f"station_{z:g}", frame_rate=frame_rate)
        for n, z in enumerate(data["station"].values)
    ]
    moving = moving_frames(data, **look)
    return [*paths, write(moving, folder / "moving_frame", frame_rate=frame_rate)]
