r"""Movies of a flowing train: what cameras fixed at the stations see, and one that moves along.

**Film.** The train is repeat 0 of the trains stage, computed once more with the same random
numbers, and all its positions are taken at the times of the frames (`film`). So the spheres of the
movies are those of the train's file, not a picture of their statistics.

**Cameras at stations** look at a window of the channel that is centred at the station, or, next to
inlet and outlet, at the nearest window inside the channel. All run at the same times.

**The camera that moves along** has the mean velocity V of the tracked spheres of the train's file
(`recording.moving_frame`), so a perfectly ordered train stands still. Its window is cut into rows,
as lines of a text: the leading piece of the train is the top row.

**Frames.** Lengths are true: a point z of a window that begins at z_0 and is w wide is at pixel
W (z - z_0)/w of a frame W pixels wide, the channel is W/w pixels high, a sphere d/D times that.
Spheres closer than `TOUCHING` to a neighbour have a colour of their own.

Movies are MP4 (H.264, yuv420p, which browsers play), or GIF where there is no ffmpeg.

Units: positions in D, times in D/Ubar; words in a frame are physical where De > 0.
"""

import functools
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import imageio_ffmpeg
import matplotlib
import numpy as np
import xarray as xr
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from PIL import Image, ImageColor, ImageDraw, ImageFont

from viscotrain.drawing.style import BLUE, VERMILLION
from viscotrain.trains import recording

LARGEST_ROWS = 4  # of the window that moves along
MARGIN = 2.0  # beyond a window, in d: enough to see whether a sphere at its edge touches another
# A rate factor of 18 cannot be told from the original; the index in front lets browsers start at
# once; one thread and no version in the file make the same bytes everywhere.
ENCODING = "-crf 20 -preset veryfast -threads 1 -movflags +faststart -bitexact"
GIF_COLOURS = 64
REFERENCE_WIDTH = 1280  # pixels, for which the sizes of text and margins below are
TEXT, SMALL_TEXT = 24, 19  # pixels
THICK = 3  # of walls and arrows
WHITE, BLACK = (255, 255, 255), (0, 0, 0)
WATER, WALL, GREY_TEXT = (234, 241, 246), (60, 60, 60), (110, 110, 110)
SHADOW = (150, 170, 185)
SPHERE_COLOUR, TOUCHING_COLOUR = (np.array(ImageColor.getrgb(name)) for name in (BLUE, VERMILLION))
BAR_START = 190  # of the scale bar
NICE = (1, 2, 5)  # leading digits of a scale bar's length


# -------------------------------------------------------------------------------------- positions


def film(
    velocities: recording.Velocities,
    train: xr.Dataset,
    *,
    field_of_view: float,
    interval: float,
    frames: int,
) -> xr.Dataset:
    """Positions of the spheres in the windows of all cameras, at the times of their frames.

    Args:
        velocities: Those of triplets with which the train was simulated.
        train: Result of `recording.run`.
        field_of_view: Length of a window, in D.
        interval: Time between frames of the cameras at the stations, in D/Ubar.
        frames: Number of frames of a movie.

    Returns:
        Dataset with `position` (station, frame, sphere) and `time` (frame) of the cameras at the
        stations, `moving_position` (frame, moving_sphere) and `moving_time` (frame) of the one
        that moves along; positions in D, NaN after the leading sphere in the window.
    """
    beta, length = float(train["confinement"]), float(train["channel_length"])
    span, rows = moving_window(length, field_of_view)
    velocity = tracked_velocity(train)
    entered = float(train["track_time"][0, 0] - train["snapshot_time"][0, 0])
    times = interval * np.arange(frames)
    moving_times = np.linspace(span, length, frames) / velocity
    every_time, at = np.unique(np.concatenate([times, entered + moving_times]), return_inverse=True)
    snapshots = _positions(velocities, train, every_time)
    ends = velocity * moving_times
    margin = MARGIN * beta
    starts = [window(station, length, field_of_view) for station in train["station"].values]
    seen = [
        [_inside(snapshots[n], start - margin, start + field_of_view + margin) for n in at[:frames]]
        for start in starts
    ]
    along = [
        _inside(snapshots[n], end - span - margin, end + margin)
        for n, end in zip(at[frames:], ends, strict=True)
    ]
    in_diameters = "position over channel diameter, the trailing sphere first"
    in_times = "times mean velocity of the flow over channel diameter"
    dataset = xr.Dataset(
        {
            "position": _described(
                _padded(seen), ["station", "frame", "sphere"], f"{in_diameters}; NaN: none"
            ),
            "window_start": _described(
                np.array(starts), ["station"], "upstream end of the window over channel diameter"
            ),
            "time": _described(times, ["frame"], f"time since the first frame {in_times}"),
            "moving_position": _described(
                _padded([along])[0], ["frame", "moving_sphere"], f"{in_diameters}; NaN: none"
            ),
            "moving_window_end": _described(
                ends, ["frame"], "downstream end of the moving window over channel diameter"
            ),
            "moving_time": _described(
                moving_times - moving_times[0], ["frame"], f"time since the first frame {in_times}"
            ),
            "moving_velocity": _described(
                np.array(velocity), [], "velocity of the moving window over that of the flow"
            ),
            "field_of_view": _described(
                np.array(field_of_view), [], "length of a window over channel diameter"
            ),
            "moving_length": _described(
                np.array(span), [], "length of the moving window over channel diameter"
            ),
            "moving_rows": _described(np.array(rows), [], "pieces of the moving window, all equal"),
        },
        coords={"station": train["station"]},
    )
    scalars = ("confinement", "volume_fraction", "channel_length", "deborah", "channel_diameter")
    for name in scalars:
        dataset[name] = train[name]
    dataset["time_scale"] = ((), float(train["time"]), dict(train["time"].attrs))
    return dataset


def tracked_velocity(train: xr.Dataset) -> float:
    """Mean velocity, over that of the flow, of the tracked spheres from inlet to outlet."""
    time, z = train["track_time"].values, train["track_station"].values
    return float((z[-1] - z[0]) / np.mean(time[:, -1] - time[:, 0]))


def window(station: float, length: float, field_of_view: float) -> float:
    """Where the window of a camera begins, in D: centred at the station but inside the channel."""
    return float(np.clip(station - field_of_view / 2, 0.0, length - field_of_view))


def moving_window(length: float, field_of_view: float) -> tuple[float, int]:
    """Length of the window that moves along, in D, and its rows: up to half the channel."""
    rows = int(np.clip(length / 2 // field_of_view, 1, LARGEST_ROWS))
    return min(rows * field_of_view, length / 2), rows


def _positions(
    velocities: recording.Velocities, train: xr.Dataset, times: NDArray
) -> list[NDArray]:
    """Positions in D of all spheres of repeat 0 at some times after recording began."""
    beta, length = float(train["confinement"]), float(train["channel_length"])
    seed = np.random.SeedSequence(int(train.attrs["seed"]), spawn_key=(0,))
    record = recording.simulate(
        velocities,
        confinement=beta,
        volume_fraction=float(train["volume_fraction"]),
        centreline_velocity=float(train["centreline_velocity"]),
        length=length,
        stations=[length],
        passages=1,
        rng=np.random.default_rng(seed),
        snapshot_times=times,
    )
    return [beta * z for z in record.snapshots]


def _inside(z: NDArray, low: float, high: float) -> NDArray:
    return z[(z >= low) & (z <= high)]


def _padded(pieces: Sequence[Sequence[NDArray]]) -> NDArray:
    """Arrays of different lengths as one, filled up with NaN."""
    most = max((z.size for row in pieces for z in row), default=0)
    filled = np.full((len(pieces), len(pieces[0]), most), np.nan)
    for r, row in enumerate(pieces):
        for n, z in enumerate(row):
            filled[r, n, : z.size] = z
    return filled


def _described(values, dims: Sequence[str], long_name: str) -> xr.Variable:
    return xr.Variable(dims, values, {"long_name": long_name, "units": "1"})


def touching(z: NDArray, confinement: float) -> NDArray:
    """Which of the spheres at z (in D, ascending) are closer than `TOUCHING` to a neighbour."""
    near = np.diff(z) < recording.TOUCHING * confinement
    return np.concatenate([[False], near]) | np.concatenate([near, [False]])


# ---------------------------------------------------------------------------------------- drawing


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


def draw_spheres(frame: NDArray, view: View, z: NDArray, confinement: float):
    """Paint spheres with smooth edges into a frame, shape (height, width, 3), of bytes.

    Args:
        frame: Changed in place.
        view: Where the channel is in it.
        z: Positions in D, ascending, without NaN.
        confinement: d/D.
    """
    radius = confinement * view.scale / 2
    height, width = frame.shape[:2]
    for column, near in zip(view.column(z), touching(z, confinement), strict=True):
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


def scale_bar(field_of_view: float, channel_diameter: float) -> tuple[float, str]:
    """Length of a scale bar in D, a round one of about a tenth of the window, and its name.

    Args:
        field_of_view: In D.
        channel_diameter: In mm.
    """
    largest = field_of_view / 8 * channel_diameter * 1e3  # um
    power = 10.0 ** math.floor(math.log10(largest))
    length = max(digit * power for digit in NICE if digit * power <= largest)
    name = f"{length / 1e3:g} mm" if length >= 1e3 else f"{length:g} \N{MICRO SIGN}m"
    return length / 1e3 / channel_diameter, name


def _conditions(data: xr.Dataset) -> str:
    phi = 100 * float(data["volume_fraction"])
    return (
        f"De = {float(data['deborah']):g}   d/D = {float(data['confinement']):g}   "
        f"\N{GREEK SMALL LETTER PHI} = {phi:.4g} %"
    )


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


HEADER, TICKS, FOOT = 52, 42, 46  # heights above the channel, below it, and below that
ROW_GAP = 34  # between the rows of the moving window


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
        data: Result of `film`.
        station: Its number.
        width: Pixels.
        frame_rate: Frames per second of the movie, which decides how slow it is.
    """
    view = station_view(data, station, width)
    below = HEADER + view.scale * REFERENCE_WIDTH / width
    canvas = Canvas.blank(width, below + TICKS + FOOT)
    time, speed = _clock(data, data["time"].values, frame_rate)
    _head(canvas, _place(float(data["station"][station]), data), _conditions(data))
    canvas.channel(view)
    _ticks(canvas, view, below, float(data["station"][station]))
    _foot(canvas, below + TICKS + FOOT / 2, data, speed)
    canvas.pointer(840, below + TICKS + FOOT / 2 - 7)
    canvas.text(857, below + TICKS + FOOT / 2, "station", size=SMALL_TEXT)
    for n, z in enumerate(data["position"].values[station]):
        frame = _timed(canvas, time(n))
        draw_spheres(frame, view, z[np.isfinite(z)], float(data["confinement"]))
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
        data: Result of `film`.
        width: Pixels.
        frame_rate: Frames per second of the movie.
    """
    views, beta = moving_views(data, 0, width), float(data["confinement"])
    below = (views[-1].axis + views[-1].scale / 2) * REFERENCE_WIDTH / width + 10
    canvas = Canvas.blank(width, below + 2 * FOOT + 16)
    time, speed = _clock(data, data["moving_time"].values, frame_rate)
    velocity = f"moving with the train, at {float(data['moving_velocity']):.3f} U\u0304"
    _head(canvas, velocity, _conditions(data))
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
    for n, z in enumerate(data["moving_position"].values):
        now = canvas.copy()
        _progress(now, below + FOOT + 14, data, n)
        frame = _timed(now, time(n))
        for view in moving_views(data, n, width):
            draw_spheres(frame, view, z[np.isfinite(z)], beta)
        yield frame


def _timed(canvas: Canvas, words: str) -> NDArray:
    """The picture with the time in its head."""
    canvas = canvas.copy()
    canvas.text(REFERENCE_WIDTH - 16, HEADER / 2, words, anchor="rm")
    return np.array(canvas.image)


def _head(canvas: Canvas, place: str, conditions: str):
    canvas.text(16, HEADER / 2, place)
    canvas.text(REFERENCE_WIDTH / 2, HEADER / 2, conditions, anchor="mm", size=SMALL_TEXT)


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
    canvas.text(592, y, f"touching (s* < {recording.TOUCHING:g} d)", size=SMALL_TEXT)
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


# ---------------------------------------------------------------------------------------- writing


def ffmpeg() -> str | None:
    """Path of the program that makes MP4, or None where there is none."""
    try:
        return imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError:
        return None


def write(frames: Iterable[NDArray], stem: Path, *, frame_rate: float) -> Path:
    """Write a movie as `stem`.mp4, or as `stem`.gif where there is no ffmpeg; its path."""
    if ffmpeg():
        return _write_mp4(frames, stem.with_name(f"{stem.name}.mp4"), frame_rate)
    return _write_gif(frames, stem.with_name(f"{stem.name}.gif"), frame_rate)


def _write_mp4(frames: Iterable[NDArray], path: Path, frame_rate: float) -> Path:
    frames = iter(frames)
    first = next(frames)
    height, width = first.shape[:2]
    film_strip = imageio_ffmpeg.write_frames(
        str(path),
        (width, height),
        pix_fmt_in="rgb24",
        pix_fmt_out="yuv420p",
        fps=frame_rate,
        codec="libx264",
        quality=None,
        macro_block_size=2,
        output_params=ENCODING.split(),
    )
    film_strip.send(None)
    for frame in itertools.chain([first], frames):
        film_strip.send(np.ascontiguousarray(frame))
    film_strip.close()
    return path


def _write_gif(frames: Iterable[NDArray], path: Path, frame_rate: float) -> Path:
    images = (
        Image.fromarray(frame).quantize(GIF_COLOURS, dither=Image.Dither.NONE) for frame in frames
    )
    next(images).save(
        path,
        save_all=True,
        append_images=images,
        duration=round(1000 / frame_rate),
        loop=0,
    )
    return path


def make(data: xr.Dataset, folder: str | Path, *, width: int, frame_rate: float) -> list[Path]:
    """Write the movies of all stations, `station_<L/D>`, and `moving_frame`; their paths.

    Args:
        data: Result of `film`.
        folder: Made if needed.
        width: Pixels of a frame.
        frame_rate: Frames per second.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    look = {"width": width, "frame_rate": frame_rate}
    paths = [
        write(station_frames(data, n, **look), folder / f"station_{z:g}", frame_rate=frame_rate)
        for n, z in enumerate(data["station"].values)
    ]
    moving = moving_frames(data, **look)
    return [*paths, write(moving, folder / "moving_frame", frame_rate=frame_rate)]
