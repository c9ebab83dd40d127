r"""Films: where the spheres of a train are, in the windows of cameras, at the times of frames.

**Film.** The train is repeat 0 of the trains stage, computed once more with the same random
numbers, and all its positions are taken at the times of the frames (`film`). So the spheres of the
movies are those of the train's file, not a picture of their statistics.

**Cameras at stations** look at a window of the channel that is centred at the station, or, next to
inlet and outlet, at the nearest window inside the channel. All run at the same times.

**The camera that moves along** has the mean velocity V of the tracked spheres of the train's file
(`repeats.moving_frame`), so a perfectly ordered train stands still. Its window is cut into rows, as
lines of a text: the leading piece of the train is the top row.

Units: positions in D, times in D/Ubar.
"""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from viscotrain.fluid.channel import ROUND, CrossSection
from viscotrain.trains.closures import Velocities, make_closure
from viscotrain.trains.condition import generator
from viscotrain.trains.recording import record_train
from viscotrain.trains.repeats import tracked_velocity
from viscotrain.trains.sizes import Sizes
from viscotrain.trains.variables import described

Spheres = NDArray  # positions in D and diameters over their mean, shape (2, N), trailing first
LARGEST_ROWS = 4  # of the window that moves along
MARGIN = 2.0  # beyond a window, in d: enough to see whether a sphere at its edge touches another
DIAMETERS = "diameter over the mean of all; NaN: no sphere"
POSITIONS = "position over channel diameter, the trailing sphere first; NaN: none"
KEPT = ("given", "injection", "channel")  # attributes of trains, the last one of those in ducts
OF_TRAIN = (
    *("confinement", "volume_fraction", "feed_volume_fraction", "injection_rate"),
    *("channel_length", "deborah", "diameter_variation", "spacing_variation"),
)


def film(
    velocities: Velocities,
    train: xr.Dataset,
    *,
    field_of_view: float,
    interval: float,
    frames: int,
    section: CrossSection = ROUND,
) -> xr.Dataset:
    """Positions of the spheres in the windows of all cameras, at the times of their frames.

    Args:
        velocities: Those of triplets with which the train was simulated.
        train: Result of `repeats.run_repeats`.
        field_of_view: Length of a window, in D.
        interval: Time between frames of the cameras at the stations, in D/Ubar.
        frames: Number of frames of a movie.
        section: Of the channel.

    Returns:
        Dataset with `position` (station, frame, sphere) and `time` (frame) of the cameras at the
        stations, `moving_position` (frame, moving_sphere) and `moving_time` (frame) of the one
        that moves along; positions in D, NaN after the leading sphere in the window. Diameters
        over their mean have the shapes of positions; `spacing_variation` is that of the train.
    """
    length = float(train["channel_length"])
    span, rows = moving_window(length, field_of_view)
    velocity = tracked_velocity(train)
    entered = float(train["track_time"][0, 0] - train["snapshot_time"][0, 0])
    times = interval * np.arange(frames)
    moving_times = np.linspace(span, length, frames) / velocity
    every_time, at = np.unique(np.concatenate([times, entered + moving_times]), return_inverse=True)
    snapshots = _positions(velocities, train, every_time, section)
    fixed = _fixed_cameras(train, [snapshots[n] for n in at[:frames]], field_of_view)
    ends = velocity * moving_times
    moving = _moving_camera(train, [snapshots[n] for n in at[frames:]], ends, span)
    since = "time since the first frame times mean velocity of the flow over channel diameter"
    dataset = xr.Dataset(
        fixed
        | {"time": described(times, ["frame"], since)}
        | moving
        | {
            "moving_time": described(moving_times - moving_times[0], ["frame"], since),
            "moving_velocity": described(
                np.array(velocity), [], "velocity of the moving window over that of the flow"
            ),
            "field_of_view": described(
                np.array(field_of_view), [], "length of a window over channel diameter"
            ),
            "moving_rows": described(np.array(rows), [], "pieces of the moving window, all equal"),
        },
        coords={"station": train["station"]},
    )
    for name in OF_TRAIN:
        dataset[name] = train[name]
    dataset["memory_number"] = train["memory_number"].max(keep_attrs=True)
    De, phi = float(train["deborah"]), float(train["volume_fraction"])
    dataset.attrs["title"] = f"positions of spheres in movies at De = {De:g}, phi = {phi:.3g}"
    dataset.attrs |= {name: train.attrs[name] for name in KEPT if name in train.attrs}
    return dataset


def _fixed_cameras(
    train: xr.Dataset, snapshots: Sequence[Spheres], field_of_view: float
) -> dict[str, xr.Variable]:
    """What the cameras at the stations see, and where their windows begin."""
    length, margin = float(train["channel_length"]), MARGIN * float(train["confinement"])
    starts = [window(station, length, field_of_view) for station in train["station"].values]
    seen = [
        [_inside(z, start - margin, start + field_of_view + margin) for z in snapshots]
        for start in starts
    ]
    return {
        **_spheres(seen, ["station", "frame", "sphere"]),
        "window_start": described(
            np.array(starts), ["station"], "upstream end of the window over channel diameter"
        ),
    }


def _moving_camera(
    train: xr.Dataset, snapshots: Sequence[Spheres], ends: NDArray, span: float
) -> dict[str, xr.Variable]:
    """What the camera that moves along sees, and where its window ends."""
    margin = MARGIN * float(train["confinement"])
    along = [
        _inside(z, end - span - margin, end + margin)
        for z, end in zip(snapshots, ends, strict=True)
    ]
    return {
        **_spheres(along, ["frame", "moving_sphere"], "moving_"),
        "moving_window_end": described(
            ends, ["frame"], "downstream end of the moving window over channel diameter"
        ),
        "moving_length": described(
            np.array(span), [], "length of the moving window over channel diameter"
        ),
    }


def window(station: float, length: float, field_of_view: float) -> float:
    """Where the window of a camera begins, in D: centred at the station but inside the channel."""
    return float(np.clip(station - field_of_view / 2, 0.0, length - field_of_view))


def moving_window(length: float, field_of_view: float) -> tuple[float, int]:
    """Length of the window that moves along, in D, and its rows: up to half the channel."""
    rows = int(np.clip(length / 2 // field_of_view, 1, LARGEST_ROWS))
    return min(rows * field_of_view, length / 2), rows


def _positions(
    velocities: Velocities, train: xr.Dataset, times: NDArray, section: CrossSection
) -> list[Spheres]:
    """All spheres of repeat 0 at some times after recording began."""
    beta, length = float(train["confinement"]), float(train["channel_length"])
    record = record_train(
        make_closure(train.attrs["closure"], velocities, float(train.attrs["memory_strength"])),
        confinement=beta,
        volume_fraction=float(train["volume_fraction"]),
        injection=train.attrs["injection"],
        length=length,
        stations=[length],
        passages=1,
        rng=generator(int(train.attrs["seed"]), 0),
        snapshot_times=times,
        section=section,
        sizes=Sizes(float(train["diameter_variation"]), float(train["size_response"])),
    )
    return [
        np.stack([beta * z, 1 + deviation])
        for z, deviation in zip(record.snapshots, record.snapshot_deviations, strict=True)
    ]


def _inside(spheres: Spheres, low: float, high: float) -> Spheres:
    return spheres[:, (spheres[0] >= low) & (spheres[0] <= high)]


def _spheres(pieces: Sequence, dims: Sequence[str], of: str = "") -> dict[str, xr.Variable]:
    """Positions and diameters, of pieces nested as the dimensions but the last, filled with NaN."""
    flat = pieces if len(dims) == 2 else [piece for row in pieces for piece in row]
    most = max((spheres.shape[1] for spheres in flat), default=0)
    filled = np.full((2, len(flat), most), np.nan)
    for n, spheres in enumerate(flat):
        filled[:, n, : spheres.shape[1]] = spheres
    shape = (len(pieces),) if len(dims) == 2 else (len(pieces), len(pieces[0]))
    z, diameter = filled.reshape(2, *shape, most)
    return {
        f"{of}position": described(z, dims, POSITIONS),
        f"{of}diameter": described(diameter, dims, DIAMETERS),
    }
