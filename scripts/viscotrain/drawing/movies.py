"""What the cameras of a film see: a movie of each, and all stations at one moment as a figure.

Cameras fixed at the stations, and one that moves along (`trains.films`); `windows` draws to scale.
Words in a frame are physical where De > 0; `labelled` gives a film what they need.
"""

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.text import Text
from numpy.typing import NDArray

from viscotrain.drawing.conventions import POSITION, train_conditions, with_sphere_rate
from viscotrain.drawing.encoding import write
from viscotrain.drawing.style import BLUE, Drawing, styled
from viscotrain.drawing.windows import (
    MARK,
    PAD,
    SHADOW,
    SPHERE,
    WALL,
    draw_legend,
    draw_scale,
    draw_station,
    draw_window,
    figure_of_windows,
    frames,
    place,
    spheres,
)
from viscotrain.fluid.units import CENTIMETRES
from viscotrain.trains.sizes import contact
from viscotrain.trains.statistics import touching
from viscotrain.trains.variables import in_digits

AROUND, LINE = 0.75, 0.15  # heights of words above and below the windows, and of a line, in inches
PROGRESS = 0.12  # the same of the line that stands for the channel
NARROWER = 0.15  # than the rows is this line, on either side, over the length of the channel
RING = {
    "facecolor": "none",
    "edgecolor": SHADOW,
    "linewidth": 1.0,
    "zorder": 0.5,
}  # a sphere in the first frame
STATION = Line2D([], [], ls="", marker="^", color="black", ms=MARK)
FIRST = Line2D([], [], ls="", marker="o", mfc="none", mec=SHADOW, ms=SPHERE)
OF_FILM = ["field_of_view", "confinement", "deborah", "injection_rate", "memory_number"]
OF_FILM += ["volume_fraction", "feed_volume_fraction", "diameter_variation"]


def labelled(film: xr.Dataset, units: xr.Dataset) -> xr.Dataset:
    """A film with its physical units: the channel's diameter in mm, D/Ubar in s, spheres/s.

    Args:
        film: Result of `films.film`.
        units: Result of `units.physical_units`.
    """
    own = units.sel(deborah=float(film["deborah"]))
    return with_sphere_rate(film, units).assign(
        channel_diameter=own["channel_diameter"].variable, time_scale=own["time"].variable
    )


@styled
def stations(film: xr.Dataset, units: xr.Dataset) -> Drawing:
    """What the cameras at all stations see at the same moment, one under the other, to scale.

    Args:
        film: Result of `films.film`.
        units: Result of `units.physical_units`.
    """
    names = ["position", "diameter", "window_start", "time", "spacing_variation"]
    data = labelled(film, units)[[*names, *OF_FILM, "sphere_rate", "channel_diameter"]]
    data = data.isel(frame=film.sizes["frame"] // 2)
    data.attrs = {name: film.attrs[name] for name in ("injection", "given")}
    title = [*train_conditions(data).split("\n"), "all stations at the same moment"]
    count, view = data.sizes["station"], float(data["field_of_view"])
    figure, panels = figure_of_windows(count, view, AROUND + LINE * len(title))
    for n, axes in enumerate(panels):
        seen = _draw_station(axes, data, n)
        place(
            seen, data["position"].values[n], data["diameter"].values[n], float(data["confinement"])
        )
    draw_scale(panels[0], float(data["channel_diameter"]))
    panels[-1].set_xlabel(POSITION)
    figure.suptitle("\n".join(title))
    draw_legend(figure, _touches(data["position"], data), station=STATION)
    return Drawing(figure, data)


def _draw_station(axes: Axes, data: xr.Dataset, n: int):
    """The window of the camera at station n with its name, and its spheres, none yet."""
    station = float(data["station"][n])
    seen = draw_window(axes, float(data["window_start"][n]), float(data["field_of_view"]))
    draw_station(axes, station)
    words = _place(station, data) + f"\nCV {float(data['spacing_variation'][n]):.2f}"
    axes.set_ylabel(words, rotation=0, ha="right", va="center")
    return seen


def _place(z: float, data: xr.Dataset) -> str:
    """A position in D and in cm."""
    return f"$z$ = {z:g} $D$\n{CENTIMETRES * float(data['channel_diameter']) * z:.3g} cm"


def _touches(position: xr.DataArray, data: xr.Dataset) -> bool:
    """Whether any spheres touch; positions in D, the last dimension is that of spheres."""
    beta = float(data["confinement"])
    kind = "moving_diameter" if "moving_sphere" in position.dims else "diameter"
    rows = (each.values.reshape(-1, each.shape[-1]) for each in (position, data[kind]))
    for z, ratio in zip(*rows, strict=True):
        there = np.isfinite(z)
        if touching(z[there], beta, contact(ratio[there] - 1)).any():
            return True
    return False


def _clock(data: xr.Dataset, times: NDArray, frame_rate: float) -> tuple[Callable, str]:
    """How to write the time of a frame, and how much slower than the flow the movie is."""
    scale = float(data["time_scale"])
    if not math.isfinite(scale):  # De = 0: any small flow rate
        return lambda n: f"t = {times[n]:.2f} D/U\u0304", "U\u0304: mean velocity of the flow"
    seconds = times * scale
    slower = (times.size - 1) / frame_rate / seconds[-1]
    words = f"{in_digits(slower)}\N{MULTIPLICATION SIGN} slower than real"
    if slower < 1:
        words = f"{in_digits(1 / slower)}\N{MULTIPLICATION SIGN} faster than real"
    shown, unit = (1e3 * seconds, "ms") if seconds[-1] < 1 else (seconds, "s")
    decimals = max(0, math.ceil(-math.log10(shown[1] - shown[0])))  # every frame has its own
    return lambda n: f"t = {shown[n]:.{decimals}f} {unit}", words


def _conditions(data: xr.Dataset) -> list[str]:
    """Lines of the title of a film."""
    return [*train_conditions(data).split("\n"), *filter(None, [data.attrs.get("channel")])]


def _around(data: xr.Dataset) -> float:
    """Height of the words of a film, in inches."""
    return AROUND + LINE * len(_conditions(data))


def _head(figure: Figure, data: xr.Dataset) -> Text:
    """The conditions, and on the right a place for words that change."""
    shown = figure.suptitle("\n".join(_conditions(data)), x=0.01, ha="left")
    look = {"ha": "right", "va": "top", "fontsize": shown.get_fontsize()}
    return figure.text(0.99, 1 - PAD / figure.get_figheight(), "", **look)


@styled
def station_film(
    data: xr.Dataset, station: int, frame_rate: float
) -> tuple[Figure, list, Callable]:
    """The figure of the camera at a station, what moves in it, and how to set it to a frame.

    Args:
        data: Result of `labelled`.
        station: Its number.
        frame_rate: Frames per second of the movie, which decides how slow it is.
    """
    figure, (axes,) = figure_of_windows(1, float(data["field_of_view"]), _around(data))
    time, speed = _clock(data, data["time"].values, frame_rate)
    now = _head(figure, data)
    seen = _draw_station(axes, data, station)
    draw_scale(axes, float(data["channel_diameter"]))
    axes.set_title(speed)
    axes.set_xlabel(POSITION)
    positions, diameters = (data[name].values[station] for name in ("position", "diameter"))
    touch = _touches(data["position"].isel(station=station), data.isel(station=station))
    draw_legend(figure, touch, station=STATION)

    def update(n: int):
        now.set_text(time(n))
        place(seen, positions[n], diameters[n], float(data["confinement"]))

    return figure, [seen, now], update


@styled
def moving_film(data: xr.Dataset, frame_rate: float) -> tuple[Figure, list, Callable]:
    """The same of the camera that moves along; its rows are pieces of a window."""
    rows, beta = int(data["moving_rows"]), float(data["confinement"])
    length = float(data["moving_length"]) / rows
    figure, panels = figure_of_windows(rows, length, _around(data) + LINE, PROGRESS)
    time, speed = _clock(data, data["moving_time"].values, frame_rate)
    at = f"at {float(data['moving_velocity']):.3g} U\u0304"
    now = _head(figure, data)
    positions, diameters = data["moving_position"].values, data["moving_diameter"].values
    ends = data["moving_window_end"].values
    seen = []
    for n, axes in enumerate(panels[:-1]):
        seen.append(draw_window(axes, -(n + 1) * length, length))
        place(spheres(axes, **RING), positions[0] - ends[0], diameters[0], beta)
        axes.set_xticks([])
        axes.set_ylabel(f"row {n + 1}\n{length:.3g} $D$", rotation=0, ha="right", va="center")
        if n:
            axes.set_title(f"row {n} goes on here, at the right", loc="right")
    draw_scale(panels[0], float(data["channel_diameter"]))
    panels[0].set_title(f"moving along {at}, {speed}")
    window = _draw_progress(panels[-1], data)
    touch = _touches(data["moving_position"], data)
    draw_legend(figure, touch, **{"where it was in the first frame": FIRST})

    def update(n: int):
        count, variation = in_view(data, n)
        now.set_text(f"{time(n)}\nCV {variation:.2f} of these {count} spheres")
        window.set_x(ends[n] - float(data["moving_length"]))
        for spheres_of_row in seen:
            place(spheres_of_row, positions[n] - ends[n], diameters[n], beta)

    return figure, [*seen, now, window], update


def in_view(data: xr.Dataset, n: int) -> tuple[int, float]:
    """How many spheres frame n of the moving camera shows, and the CV of their spacings."""
    z, end = data["moving_position"].values[n], float(data["moving_window_end"][n])
    z = z[(z >= end - float(data["moving_length"])) & (z <= end)]
    spacing = np.diff(z)
    return z.size, float(spacing.std() / spacing.mean()) if spacing.size else math.nan


def _draw_progress(axes: Axes, data: xr.Dataset) -> Rectangle:
    """The whole channel as a line, narrower than the rows, its stations and the window in it."""
    length = float(data["channel_length"])
    beside = NARROWER * length
    axes.set(xlim=(-beside, length + beside), ylim=(-1, 1), yticks=[])
    axes.set_xticks(data["station"].values)
    axes.spines["bottom"].set_bounds(0, length)
    axes.spines[["left", "right", "top"]].set_visible(False)
    axes.spines["bottom"].set(color=WALL, position=("data", 0))
    axes.set_xlabel(POSITION)
    axes.set_title("where the camera is in the channel")
    window = Rectangle((0, -0.8), float(data["moving_length"]), 1.6, facecolor=BLUE, lw=0)
    return axes.add_patch(window)


def make(
    film: xr.Dataset, units: xr.Dataset, folder: str | Path, *, width: int, frame_rate: float
) -> list[Path]:
    """Write the movies of all stations, `station_<z/D>`, and `moving_frame`; their paths.

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


def station_frames(
    data: xr.Dataset, station: int, *, width: int, frame_rate: float
) -> Iterator[NDArray]:
    """Frames of the camera at a station (its number), as `windows.frames` has them."""
    figure, moving, update = station_film(data, station, frame_rate)
    return frames(figure, width, data.sizes["frame"], moving, update)


def moving_frames(data: xr.Dataset, *, width: int, frame_rate: float) -> Iterator[NDArray]:
    """Frames of the camera that moves along."""
    figure, moving, update = moving_film(data, frame_rate)
    return frames(figure, width, data.sizes["frame"], moving, update)
