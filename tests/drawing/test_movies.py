"""Movies: positions against the simulation, pixels against positions, and the files against both.

The channel is short and the synthetic law strong, so that spheres meet within it.
"""

import itertools
import re
import subprocess

import harness
import imageio_ffmpeg
import numpy as np
import pytest
import xarray as xr
import yaml
from matplotlib.collections import EllipseCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from PIL import Image
from synthetic import PAPER_NODES, at_deborah, superposed, triplet

from viscotrain.drawing import encoding, figures, movies, style, windows
from viscotrain.fluid.channel import ROUND
from viscotrain.table.size_response import SizeResponse
from viscotrain.trains import films, statistics
from viscotrain.trains.closures import EverySphere
from viscotrain.trains.condition import generator
from viscotrain.trains.recording import record_train
from viscotrain.trains.repeats import run_repeats
from viscotrain.trains.sizes import Sizes

BETA, LENGTH, VIEW, FRAMES, INTERVAL = 0.2, 40.0, 5.0, 40, 0.05
WIDTH, RATE = 640, 25.0
STATIONS = [0.0, 20.0, 40.0]
UNITS = xr.Dataset(  # of hyaluronic acid in a channel of 0.1 mm; seconds
    {"channel_diameter": 0.1, "time": ("deborah", [np.nan, 0.01504])}, {"deborah": [0.0, 5.0]}
)


def strong(sp, sf):
    return superposed(sp, sf, scale=20)


@pytest.fixture(scope="module")
def velocities():
    return triplet(PAPER_NODES, PAPER_NODES, strong)


@pytest.fixture(scope="module")
def train(velocities):
    result = run_repeats(
        velocities,
        confinement=BETA,
        volume_fraction=0.01,
        centreline_velocity=1.67,
        length=LENGTH,
        stations=STATIONS,
        passages=60,
        repeats=2,
        seed=3,
    )
    return at_deborah(result, 5.0)


@pytest.fixture(scope="module")
def film(velocities, train):
    return films.film(velocities, train, field_of_view=VIEW, interval=INTERVAL, frames=FRAMES)


@pytest.fixture(scope="module")
def data(film):
    return movies.labelled(film, UNITS)


class View:
    """A window in frames so many pixels wide: which columns it has, and the row of its axis."""

    def __init__(self, axes):
        self.axes, (_, height) = axes, axes.figure.canvas.get_width_height()
        self.axis = height - axes.transData.transform((0, 0))[1]
        self.left, self.right = axes.bbox.x0, axes.bbox.x1
        self.scale = axes.bbox.height  # pixels per D

    def column(self, z):
        """Where z, in D as the axes have it, is, in pixels from the left."""
        return self.axes.transData.transform(np.column_stack([z, 0 * np.asarray(z)]))[:, 0]


def filmed(film, count=FRAMES):
    """Frames of a film, and its windows in them."""
    figure, moving, update = film
    pictures = [frame[..., :3] for frame in windows.frames(figure, WIDTH, count, moving, update)]
    return pictures, [View(axes) for axes in figure.axes if axes.get_aspect() == 1]


COLOURS = {"alone": (0, 114, 178), "touching": (213, 94, 0)}


def by_colour(row):
    """Runs of pixels, (first, one after the last), of either kind of sphere."""
    return {
        name: [(run[0], run[-1] + 1) for run in runs(np.abs(row - colour).sum(axis=-1) < 90)]
        for name, colour in COLOURS.items()
    }


def by_brightness(row):
    """The same for decoded frames, whose colours are those of two by two pixels; kinds are one."""
    dark = row @ (0.299, 0.587, 0.114) < 170  # spheres 87 and 119, fluid 239
    drawn = [(run[0], run[-1] + 1) for run in runs(dark)]  # and words beside the window, black
    return dict.fromkeys(COLOURS, drawn)


def assert_spheres_at(frame, view, z, runs_of=by_colour):
    """Edges of spheres, in the row of the axis, are within a pixel of where positions put them.

    Spheres that touch are too close to be told apart: those of their chain's ends count. Returns
    the number of edges.
    """
    row = frame[round(view.axis)].astype(int)
    drawn = runs_of(row)
    z = z[np.isfinite(z)]
    near = np.diff(z) < 1.1 * BETA
    compared = 0
    for chain in np.split(z, np.flatnonzero(~near) + 1):
        left, right = view.column(chain[[0, -1]] + BETA / 2 * np.array([-1, 1]))
        runs_of_kind = drawn["alone" if chain.size == 1 else "touching"]
        for n, edge in ((0, left), (1, right)):
            if view.left + 2 < edge < view.right - 2:
                assert min(abs(run[n] - edge) for run in runs_of_kind) < 1
                compared += 1
    return compared


def runs(mask):
    found = np.split(np.arange(mask.size), np.flatnonzero(np.diff(mask)) + 1)
    return [run for run in found if mask[run[0]]]


# -------------------------------------------------------------------------------------- positions


def test_a_film_is_of_the_spheres_that_entered_by_the_same_law(velocities):
    """Of a feed, at random: positions at the beginning of the recording, bit by bit."""
    train = run_repeats(
        velocities,
        confinement=BETA,
        volume_fraction=0.0165,
        feed=True,
        injection="poisson",
        centreline_velocity=1.67,
        length=LENGTH,
        stations=STATIONS,
        passages=20,
        repeats=1,
        seed=3,
    ).assign(deborah=5.0, memory_number=("repeat", [0.0]))
    ((z, _),) = films._positions(velocities, train, np.array([0.0]), ROUND)
    known = train["position"].values[0, 0]
    np.testing.assert_array_equal(z / BETA, known[np.isfinite(known)] * BETA / BETA)
    film = films.film(velocities, train, field_of_view=VIEW, interval=INTERVAL, frames=2)
    assert float(film["feed_volume_fraction"]) == 0.0165
    assert film.attrs["injection"] == "poisson"
    figure, *_ = movies.station_film(movies.labelled(film, UNITS), 0, RATE)
    words = figure.get_suptitle()
    assert "injection: random (Poisson)" in words and "1.65 % in the feed" in words


def test_spheres_pass_the_station_in_the_film_when_they_do_in_the_train(velocities, train):
    """Passage times of repeat 0 are an independent record of the same spheres."""
    frames = 300  # recorded spheres are there after 12 D/Ubar
    data = films.film(velocities, train, field_of_view=VIEW, interval=INTERVAL, frames=frames)
    since = train["passage_time"].values[0, 1] - float(train["snapshot_time"][0, 0])
    compared = 0
    for time in since[since < (frames - 1) * INTERVAL]:
        n = int(time // INTERVAL)
        before, after = (data["position"].values[1, m] for m in (n, n + 1))
        z = before[before <= STATIONS[1]].max()  # the next one to pass
        moved = after[after > z].min()
        there = z + (moved - z) * (time / INTERVAL - n)
        assert there == pytest.approx(STATIONS[1], abs=VIEW / WIDTH)  # a pixel
        compared += 1
    assert compared > 5


def test_windows_are_centred_but_inside_the_channel(data):
    assert data["window_start"].values.tolist() == [0.0, 17.5, 35.0]
    for n, start in enumerate(data["window_start"].values):
        z = data["position"].values[n]
        assert np.nanmin(z) >= max(start - films.MARGIN * BETA, 0)
        assert np.nanmax(z) <= min(start + VIEW + films.MARGIN * BETA, LENGTH)


def test_the_moving_window_goes_from_inlet_to_outlet_at_the_speed_of_the_train(data, train):
    span, rows = films.moving_window(LENGTH, VIEW)
    assert (span, rows) == (20.0, 4)
    ends = data["moving_window_end"].values
    assert (ends[0], ends[-1]) == (span, pytest.approx(LENGTH))
    time = train["track_time"].values
    expected = LENGTH / np.mean(time[:, -1] - time[:, 0])
    speed = np.diff(ends) / np.diff(data["moving_time"].values)
    np.testing.assert_allclose(speed, expected, rtol=1e-12)
    first = data["moving_position"].values - ends[:, None]
    drift = np.nanmean(first[-1]) - np.nanmean(first[0])
    assert abs(drift) < 1.5  # of 20 D; it would be 20 in a frame at rest


@pytest.mark.parametrize(
    ("length", "view", "expected"),
    [(800, 10, (40, 4)), (20, 10, (10, 1)), (20, 20, (10, 1)), (60, 10, (30, 3))],
)
def test_moving_window_is_at_most_half_the_channel(length, view, expected):
    assert films.moving_window(length, view) == expected


def test_a_train_with_memory_is_filmed_with_it(velocities):
    """Its snapshots are an independent record; without memory spheres are elsewhere."""
    trains = [
        run_repeats(
            velocities,
            confinement=BETA,
            volume_fraction=0.01,
            centreline_velocity=1.67,
            length=LENGTH,
            stations=STATIONS,
            passages=20,
            repeats=1,
            seed=3,
            memory_strength=strength,
        )
        for strength in (0.0, 40.0)
    ]
    times = trains[1]["snapshot_time"].values[0]
    seen = films._positions(velocities, trains[1], times - times[0], ROUND)
    for n, (positions, _) in enumerate(seen):
        held, kept = (train["position"].values[0, n] * BETA for train in trains)
        np.testing.assert_allclose(positions, kept[np.isfinite(kept)], rtol=0, atol=1e-9)
        assert np.abs(positions[-3:] - held[np.isfinite(held)][-3:]).max() > 1e-3


def test_filming_does_not_change_the_train(velocities, train, data):
    again = films.film(velocities, train, field_of_view=8.0, interval=0.11, frames=9)
    both = np.intersect1d(again["position"].values[1, 0], data["position"].values[1, 0])
    known = data["position"].values[1, 0]
    assert set(both) >= set(known[np.isfinite(known)])


# ---------------------------------------------------------------------------------------- drawing


@pytest.mark.parametrize("station", range(len(STATIONS)))
def test_spheres_are_drawn_where_they_are(data, station):
    frames, (view,) = filmed(movies.station_film(data, station, RATE))
    assert view.scale == pytest.approx((view.right - view.left) / VIEW)
    for frame, z in zip(frames, data["position"].values[station], strict=True):
        assert assert_spheres_at(frame, view, z) > 1


def painted(width, start, z, diameter):
    """Spheres in a window as large as its picture, 100 pixels per D; NaN is none."""
    figure = Figure(figsize=(width / 100, 1))
    axes = figure.add_axes((0, 0, 1, 1))
    spheres = windows.draw_window(axes, start, width / 100)
    axes.spines[:].set_visible(False)
    seen = np.array([*z, np.nan]), np.array([*diameter, np.nan])
    look = figure, width, 1, [spheres]
    (frame,) = windows.frames(*look, lambda n: windows.place(spheres, *seen, BETA))
    assert frame.shape == (100, width, 4)
    assert (frame[..., 3] == 255).all()
    return frame[..., :3]


def test_a_sphere_has_its_diameter_and_colours_tell_who_touches():
    frame = painted(400, 1.0, [1.5, 1.71, 3.0], [1.0, 1.0, 1.0])
    blue = runs(np.abs(frame[50].astype(int) - COLOURS["alone"]).sum(axis=-1) < 30)
    red = runs(np.abs(frame[50].astype(int) - COLOURS["touching"]).sum(axis=-1) < 30)
    assert [(run[0], run.size) for run in blue] == [(190, 20)]  # 0.2 D, centre at 2 D
    assert [(run[0], run.size) for run in red] == [(40, 20), (61, 20)]
    rows = np.flatnonzero((frame[:, 200] != frame[5, 5]).any(axis=-1))
    assert (rows[0], rows[-1]) == (40, 59)


def test_unequal_spheres_have_their_own_diameters_and_touch_by_their_gap():
    """Diameters 0.28, 0.2 and 0.12 D: gaps of 0.01 D and, at equal distance, 0.09 D."""
    frame = painted(400, 1.0, [1.5, 1.75, 2.0], [1.4, 1.0, 0.6])
    blue, red = (
        [(run[0], run.size) for run in runs(np.abs(frame[50].astype(int) - rgb).sum(axis=-1) < 30)]
        for rgb in COLOURS.values()
    )
    assert red == [(36, 28), (65, 20)]
    assert blue == [(94, 12)]


def test_films_of_unequal_spheres_are_of_the_diameters_of_the_train(velocities):
    options = {"confinement": BETA, "volume_fraction": 0.01, "centreline_velocity": 1.67}
    train = run_repeats(
        velocities,
        length=LENGTH,
        stations=STATIONS,
        passages=60,
        repeats=1,
        seed=3,
        diameter_variation=0.05,
        size_response=SizeResponse(-0.03, 0.0),
        **options,
    )
    own = films.film(
        velocities, at_deborah(train, 5.0), field_of_view=VIEW, interval=INTERVAL, frames=FRAMES
    )
    seen = own["diameter"].values
    assert np.array_equal(np.isfinite(seen), np.isfinite(own["position"].values))
    again = record_train(
        EverySphere(velocities),
        confinement=BETA,
        volume_fraction=0.01,
        length=LENGTH,
        stations=STATIONS,
        passages=60,
        rng=generator(3, 0),
        sizes=Sizes(0.05, -0.03),
    )
    np.testing.assert_array_equal(again.spacing, train["spacing"][0])
    inside = set(seen[np.isfinite(seen)].round(12))
    assert 10 < len(inside & set((1 + np.array(again.deviation)).round(12))) == len(inside)
    figure, *_ = movies.station_film(movies.labelled(own, UNITS), 0, RATE)
    assert "random (gaps uniformly distributed), diameters vary by 5 %" in figure.get_suptitle()


def test_spheres_at_the_edge_are_cut():
    frame = painted(100, 0.0, [-0.05, 1.2, 5.0], [1.0, 1.0, 1.0])
    water = frame[5, 5]
    assert runs((frame[50] != water).any(axis=-1))[0].tolist() == list(range(5))


def test_rows_of_the_moving_frame_show_successive_pieces(data):
    frames, views = filmed(movies.moving_film(data, RATE))
    starts = [view.axes.get_xlim()[0] for view in views]  # from the leading end of the window
    assert starts == [-VIEW, -2 * VIEW, -3 * VIEW, -4 * VIEW]
    for n in (0, FRAMES // 2, FRAMES - 1):
        z = data["moving_position"].values[n] - float(data["moving_window_end"][n])
        for view in views:
            assert assert_spheres_at(frames[n], view, z) > 1


def test_the_moving_camera_tells_how_even_the_spacings_in_its_view_are(data):
    """Of spheres within its window, not of those in the margin beside it."""
    z = data["moving_position"].copy(deep=True)
    end, length = float(data["moving_window_end"][0]), float(data["moving_length"])
    z[0] = np.nan
    z[0, :6] = np.sort([end + 0.3, *(end - np.array([0, 1, 2, 5])), end - length - 0.1])
    own = data.assign(moving_position=z)
    expected = pytest.approx(np.std([1, 1, 3]) / np.mean([1, 1, 3]))
    assert movies.in_view(own, 0) == (4, expected)
    z[0] = np.nan
    count, variation = movies.in_view(own.assign(moving_position=z), 0)
    assert count == 0 and np.isnan(variation)


@pytest.mark.parametrize("note", [None, "rectangular duct, 2 to 1: as in the inscribed tube"])
@pytest.mark.parametrize("moving", [False, True])
def test_words_do_not_overlap(data, note, moving):
    """At the longest that they become: beyond the quasi-steady range, unequal spheres, a duct."""
    own = data.assign(memory_number=2.4, diameter_variation=0.05)
    own = own.assign_attrs(channel=note) if note else own
    film = movies.moving_film(own, RATE) if moving else movies.station_film(own, 2, RATE)
    (frame,), _ = filmed(film, 1)
    words = [text for text in film[0].findobj(Text) if text.get_text()]
    boxes = [text.get_window_extent() for text in words if text.get_visible()]
    boxes = [box for box in boxes if box.width]
    assert len(boxes) > 10
    over = [pair for pair in itertools.combinations(boxes, 2) if Bbox.intersection(*pair)]
    assert not over
    height, width, _ = frame.shape
    assert min(box.x0 for box in boxes) >= 0 and max(box.x1 for box in boxes) <= width
    assert min(box.y0 for box in boxes) >= 0 and max(box.y1 for box in boxes) <= height


def test_what_stands_still_does_not_move(data):
    """All frames of a camera differ in spheres, time and place only."""
    (first, *_, last), views = filmed(movies.moving_film(data, RATE))
    walls = [round(view.axis - view.scale / 2) for view in views]
    assert (first[walls] == last[walls]).all()
    middle = round((views[0].left + views[0].right) / 2)
    assert (first[walls][:, middle] < 130).all()
    gaps = [round((a.axis + b.axis) / 2) for a, b in itertools.pairwise(views)]
    assert (first[gaps] == last[gaps]).all()
    assert (first != last).any()


def test_a_film_says_how_even_its_train_is_and_its_rows_are_numbered(data, train):
    for n, variation in enumerate(train["spacing_variation"].values):
        figure, *_ = movies.station_film(data, n, RATE)
        assert figure.axes[0].get_ylabel().endswith(f"CV {variation:.2f}")
    figure, (*_, now, _), update = movies.moving_film(data, RATE)
    update(3)
    count, variation = movies.in_view(data, 3)
    assert f"CV {variation:.2f} of these {count} spheres" in now.get_text()
    names = [axes.get_ylabel() for axes in figure.axes]
    assert names[:4] == [f"row {n}\n5 $D$" for n in (1, 2, 3, 4)]
    assert figure.axes[4].get_title() == "where the camera is in the channel"


@pytest.mark.parametrize(
    ("view", "diameter", "micrometres", "name"),
    [
        (10.0, 0.1, 100, "100 \N{MICRO SIGN}m"),
        (5.0, 0.1, 50, "50 \N{MICRO SIGN}m"),
        (100.0, 0.1, 1000, "1 mm"),
        (10.0, 0.05, 50, "50 \N{MICRO SIGN}m"),
    ],
)
def test_scale_bar_is_round_and_true(view, diameter, micrometres, name):
    length, words = windows.scale_bar(view, diameter)
    assert (length * diameter * 1000, words) == (pytest.approx(micrometres), name)
    assert view / 30 < length <= view / 8


def test_scale_bar_in_a_frame_has_its_length(data):
    (frame,), (view,) = filmed(movies.station_film(data, 1, RATE), 1)
    height = windows.ABOVE / style.PAGE * WIDTH  # above the wall
    black = (frame[round(view.axis - view.scale / 2 - height)] < 90).all(axis=-1)
    longest = max(runs(black), key=len)
    # 50 um of 100 um, and the round ends of the line
    assert longest.size == pytest.approx(0.5 * view.scale, abs=2.5 / 72 / style.PAGE * WIDTH + 1)


def test_words_of_a_frame_are_physical(data):
    assert movies._place(400.0, data) == "$z$ = 400 $D$\n4 cm"  # of D = 0.1 mm
    clock, speed = movies._clock(data, data["time"].values, RATE)
    # 0.05 D/Ubar of 15.04 ms last a frame of 40 ms
    assert (clock(2), speed) == ("t = 1.5 ms", "53\N{MULTIPLICATION SIGN} slower than real")
    thousand_times_faster = data.assign(time_scale=0.01504 / 1000)
    assert movies._clock(thousand_times_faster, data["time"].values, RATE)[0](2) == "t = 0.0015 ms"
    newtonian = movies.labelled(data.assign(deborah=0.0), UNITS)
    assert movies._clock(newtonian, data["time"].values, RATE)[0](2) == "t = 0.10 D/U\u0304"


# ------------------------------------------------------------------------------------------ files


def decoded(path):
    reader = imageio_ffmpeg.read_frames(str(path))
    width, height = next(reader)["size"]
    return [np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in reader]


@pytest.fixture(scope="module")
def written(film, tmp_path_factory):
    folder = tmp_path_factory.mktemp("movies")
    return movies.make(film, UNITS, folder, width=WIDTH, frame_rate=RATE)


def test_there_is_a_movie_of_every_camera(written):
    names = ["station_0.mp4", "station_20.mp4", "station_40.mp4", "moving_frame.mp4"]
    assert [path.name for path in written] == names


def test_movies_are_h264_in_yuv420p_of_the_configured_rate(written):
    for path in written:
        command = [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i", str(path)]
        words = subprocess.run(command, capture_output=True, text=True, check=False).stderr
        (stream,) = re.findall(r"Video: .*", words)
        assert stream.startswith("Video: h264")
        assert re.search(r"yuv420p\b.*, 640x\d+.*25 fps", stream)


def test_decoded_spheres_are_where_the_simulation_says(written, data):
    _, (view,) = filmed(movies.station_film(data, 1, RATE), 1)
    frames = decoded(written[1])
    assert len(frames) == FRAMES
    compared = 0
    for frame, z in zip(frames, data["position"].values[1], strict=True):
        compared += assert_spheres_at(frame, view, z, by_brightness)
    assert compared > 2 * FRAMES


def test_the_same_film_gives_the_same_bytes(written, data, tmp_path):
    frames = movies.station_frames(data, 0, width=WIDTH, frame_rate=RATE)
    again = encoding.write(frames, tmp_path / "again", frame_rate=RATE)
    assert again.read_bytes() == written[0].read_bytes()


def test_without_ffmpeg_there_are_gifs(data, tmp_path, monkeypatch):
    def missing():
        raise RuntimeError("No ffmpeg exe could be found.")

    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", missing)
    frames = movies.station_frames(data, 1, width=WIDTH, frame_rate=RATE)
    path = encoding.write(frames, tmp_path / "station_2.5", frame_rate=RATE)
    assert path.name == "station_2.5.gif"
    _, (view,) = filmed(movies.station_film(data, 1, RATE), 1)
    with Image.open(path) as movie:
        assert (movie.n_frames, movie.info["duration"]) == (FRAMES, 40)
        movie.seek(7)
        frame = np.array(movie.convert("RGB"))
    assert assert_spheres_at(frame, view, data["position"].values[1, 7]) > 1


@pytest.mark.slow
def test_scripts_from_the_command_line_and_their_word_about_a_missing_ffmpeg(tiny_table, tmp_path):
    study = harness.written(movies={"frames": 4, "width": 480})
    config = tmp_path / "study.yaml"
    config.write_text(yaml.safe_dump(study), encoding="utf-8")

    def run(script, *arguments, code="pass"):
        start = f"import runpy, sys; {code}; sys.argv = sys.argv[1:]; "
        start += "runpy.run_path(sys.argv[0], run_name='__main__')"
        command = "-c", start, harness.SCRIPTS / script, "--configfile", config
        return harness.output(harness.run_python(*command, *arguments, PATH=""))

    train, film, units = (tmp_path / f"{name}.nc" for name in ("train", "film", "units"))
    condition = ["--deborah", "1", "--volume-fraction", "0.01"]
    run("trains.py", *condition, tiny_table, train)
    run("film.py", tiny_table, train, film)
    assert xr.load_dataset(film).sizes["frame"] == 4
    run("units.py", units)
    sources = film, units
    words = run("movies.py", *sources, tmp_path / "mp4", tmp_path / "figures")
    assert (tmp_path / "figures" / "stations_De1_phi0.01.pdf").exists()
    assert "GIF" not in words and (tmp_path / "mp4" / "station_10.mp4").stat().st_size > 0
    missing = "import imageio_ffmpeg; imageio_ffmpeg._utils._get_ffmpeg_exe = lambda: None"
    words = run("movies.py", *sources, tmp_path / "gif", code=missing)
    assert "no ffmpeg found: movies are GIF" in words
    assert len(list((tmp_path / "gif").glob("*.gif"))) == 4


# ----------------------------------------------------------------------------------------- figure


def test_strip_of_all_stations_shows_one_moment_to_scale(film):
    figure, drawn = figures.draw("stations_De5_phi0.01", film, BETA, UNITS)
    frame = FRAMES // 2
    assert float(drawn["time"]) == pytest.approx(frame * INTERVAL)
    for n, axes in enumerate(figure.axes):
        z = film["position"].values[n, frame]
        z = z[np.isfinite(z)]
        (spheres,) = (drawn for drawn in axes.collections if isinstance(drawn, EllipseCollection))
        np.testing.assert_allclose(spheres.get_offsets()[:, 0], z)
        np.testing.assert_allclose(spheres.get_widths(), BETA)
        red = [to_hex(colour).upper() == style.VERMILLION for colour in spheres.get_facecolor()]
        assert red == statistics.touching(z, BETA).tolist()
        start = float(drawn["window_start"][n])
        assert axes.get_aspect() == 1 and axes.get_xlim() == (start, start + VIEW)
        variation = float(film["spacing_variation"][n])
        assert axes.get_ylabel().startswith(f"$z$ = {STATIONS[n]:g} $D$")
        assert axes.get_ylabel().endswith(f"CV {variation:.2f}")
    bar = figure.axes[0].lines[-1].get_xdata()
    assert bar[1] - bar[0] == pytest.approx(0.5)  # 50 um of 100 um


@pytest.mark.parametrize("touch", [False, True])
def test_the_legend_explains_spheres_that_touch_if_there_are_any(film, touch):
    apart = np.arange(film.sizes["sphere"]) * 5 * BETA
    apart[1] = BETA if touch else apart[1]
    shape = film["position"].dims
    same = film["position"].copy(data=np.broadcast_to(apart, film["position"].shape))
    own = film.assign(position=same, diameter=(shape, np.ones(same.shape)))
    (legend,) = movies.stations(own, UNITS).figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert any(text.startswith("touching") for text in words) == touch


def test_the_strip_needs_the_units_of_its_study(film):
    with pytest.raises(figures.FigureError, match=r"allowed: with the file units\.nc"):
        figures.draw("stations_De5_phi0.01", film, BETA)
