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
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from viscotrain.drawing.canvas import (
    BLACK,
    GREY_TEXT,
    REFERENCE_WIDTH,
    SMALL_TEXT,
    THICK,
    WALL,
    Canvas,
    View,
    draw_spheres,
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
    duct = f"   {data.attrs['channel']}" if "channel" in data.attrs else ""
    return f"{enter}{data.attrs['injection']} injection{unequal(data)}{duct}"


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
    canvas = Canvas.blank(width, below + TICKS + FOOT)
    time, speed = _clock(data, data["time"].values, frame_rate)
    _head(canvas, _place(float(data["station"][station]), data), data)
    canvas.channel(view)
    _ticks(canvas, view, below, float(data["station"][station]))
    _foot(canvas, below + TICKS + FOOT / 2, data, speed)
    canvas.pointer(840, below + TICKS + FOOT / 2 - 7)
    canvas.text(857, below + TICKS + FOOT / 2, "station", size=SMALL_TEXT)
    positions, diameters = (data[name].values[station] for name in ("position", "diameter"))
    for n, (z, diameter) in enumerate(zip(positions, diameters, strict=True)):
        frame, there = _timed(canvas, time(n)), np.isfinite(z)
        draw_spheres(frame, view, z[there], diameter[there], float(data["confinement"]))
        yield frame


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
    canvas = Canvas.blank(width, below + 2 * FOOT + 16)
    time, speed = _clock(data, data["moving_time"].values, frame_rate)
    _head(canvas, f"moving along at {float(data['moving_velocity']):.3f} U\u0304", data)
    for view in views:
        canvas.channel(view)
        if view is not views[-1]:
            y = (view.axis + view.scale / 2) * REFERENCE_WIDTH / width + ROW_GAP / 2
            canvas.text(
                16, y, "\u2199 goes on below, on the right", size=SMALL_TEXT, fill=GREY_TEXT
            )
        first = data["moving_position"].values[0]
        for column in view.column(first[np.isfinite(first)]):
            canvas.ring(column, view.axis, beta * view.scale / 2)
    y = below + FOOT / 2 + 4
    _foot(canvas, y, data, speed)
    canvas.ring(840 * canvas.unit, y * canvas.unit, 9 * canvas.unit)
    canvas.text(857, y, "in the first frame", size=SMALL_TEXT)
    spheres = zip(data["moving_position"].values, data["moving_diameter"].values, strict=True)
    for n, (z, diameter) in enumerate(spheres):
        now = canvas.copy()
        _progress(now, below + FOOT + 14, data, n)
        frame, there = _timed(now, time(n)), np.isfinite(z)
        for view in moving_views(data, n, width):
            draw_spheres(frame, view, z[there], diameter[there], beta)
        yield frame


def _timed(canvas: Canvas, words: str) -> NDArray:
    """The picture with the time in its head."""
    canvas = canvas.copy()
    canvas.text(REFERENCE_WIDTH - 16, HEADER / 2, words, anchor="rm")
    return np.array(canvas.image)


def _head(canvas: Canvas, place: str, data: xr.Dataset):
    canvas.text(16, HEADER / 2, place)
    for share, words in ((0.28, _conditions(data)), (0.74, _entry(data))):
        canvas.text(REFERENCE_WIDTH / 2, share * HEADER, words, anchor="mm", size=SMALL_TEXT)


def _ticks(canvas: Canvas, view: View, below: float, station: float):
    """Positions in D below the channel, and a mark at the station."""
    end = view.start + canvas.image.width / view.scale
    for z in MaxNLocator(8, steps=[1, 2, 5, 10]).tick_values(view.start, end):
        x = float(view.column(z)) / canvas.unit
        canvas.box(x - 1, below + THICK, x + 1, below + THICK + 9, WALL)
        if 30 < x < REFERENCE_WIDTH - 30:
            canvas.text(x, below + 28, f"{z:g} D", anchor="mm", size=SMALL_TEXT)
    x = np.clip(float(view.column(station)) / canvas.unit, 10, REFERENCE_WIDTH - 10)
    canvas.pointer(x, below + THICK)


def _foot(canvas: Canvas, y: float, data: xr.Dataset, speed: str):
    """Flow, scale bar, legend and speed of the movie."""
    canvas.text(16, y, "flow", size=SMALL_TEXT)
    canvas.arrow(66, y)
    length, name = scale_bar(float(data["field_of_view"]), float(data["channel_diameter"]))
    start, end = bar_columns(length, float(data["field_of_view"]))
    canvas.box(start, y - 2.5, end, y + 2.5, BLACK)
    canvas.text(end + 12, y, name, size=SMALL_TEXT)
    canvas.disc(455, y, BLUE)
    canvas.text(472, y, "sphere", size=SMALL_TEXT)
    canvas.disc(575, y, VERMILLION)
    canvas.text(592, y, f"touching (s* < {TOUCHING:g} d)", size=SMALL_TEXT)
    canvas.text(REFERENCE_WIDTH - 16, y, speed, anchor="rm", size=SMALL_TEXT)


def bar_columns(length: float, field_of_view: float) -> tuple[float, float]:
    """Ends of a scale bar, given in D as the window is, for a frame `REFERENCE_WIDTH` wide."""
    return BAR_START, BAR_START + length / field_of_view * REFERENCE_WIDTH


def _progress(canvas: Canvas, y: float, data: xr.Dataset, n: int):
    """The whole channel as a line, with its stations, and the window that moves along it."""
    left, right = 120, REFERENCE_WIDTH - 120
    per_length = (right - left) / float(data["channel_length"])
    end = float(data["moving_window_end"][n])
    canvas.text(left - 16, y, "inlet", anchor="rm", size=SMALL_TEXT)
    canvas.text(right + 16, y, "outlet", size=SMALL_TEXT)
    canvas.box(left, y - THICK / 2, right, y + THICK / 2, WALL)
    for z in data["station"].values:
        x = left + per_length * z
        canvas.box(x - 1, y - 8, x + 1, y + 8, WALL)
        canvas.text(x, y + 24, f"{z:g} D", anchor="mm", size=SMALL_TEXT)
    start = left + per_length * (end - float(data["moving_length"]))
    canvas.box(start, y - 8, max(left + per_length * end, start + 4), y + 8, BLUE)


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
