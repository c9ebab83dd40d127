import time

import numpy as np
import pytest
import xarray as xr
from harness import CONFIG, output, run_script
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from synthetic import (
    DEMO_NODES,
    PAPER_NODES,
    SINGLE,
    at_deborah,
    constant,
    superposed,
    triplet,
)

from viscotrain.errors import TrainError
from viscotrain.fluid import parameters
from viscotrain.jobs import datasets
from viscotrain.table.lubrication import RESISTING_GAP
from viscotrain.trains import motion, recording, repeats
from viscotrain.trains.closures import EverySphere, Nearest
from viscotrain.trains.motion import Channel, arrival, chain_motion
from viscotrain.trains.repeats import run_repeats

BETA = 0.2
CHANNEL = {  # short and quick: some 30 spheres at once
    "confinement": BETA,
    "volume_fraction": 0.004,
    "length": 40.0,
    "stations": [0.0, 13.0, 40.0],
    "passages": 60,
}
REPEATED = CHANNEL | {"centreline_velocity": 1.67}


def simulate(velocities, seed=0, closure=EverySphere, **changes):
    options, rng = CHANNEL | changes, np.random.default_rng(seed)
    return recording.record_train(closure(velocities), **options, rng=rng)


def channel_of(velocities, **options):
    return Channel(EverySphere(velocities), BETA, **options)


def moved(channel, z, duration, longest=np.inf):
    """Positions after a duration."""
    y, time_left = channel.state(z), duration
    while time_left > 0:
        step, _ = channel.step(y, min(time_left, longest))
        y, time_left = step.state(step.duration), time_left - step.duration
    return channel.positions(y)


def strong(sp, sf):
    """The synthetic law, twenty times stronger: spacings change by diameters within 40 D."""
    return superposed(sp, sf, scale=20)


# --------------------------------------------------------------------------------------- motion


distances = st.lists(st.floats(1, 15), min_size=1, max_size=20)


DEMO_CHANNEL = channel_of(triplet())


@given(distances, st.floats(-100, 100))
def test_motion_does_not_depend_on_the_place(s, shift):
    channel = DEMO_CHANNEL
    z = BETA * np.cumsum([0, *s])
    # z + shift rounds s by 1e-13, relative velocities of 5e-3 vary by 1/0.1 of themselves per d;
    # the state takes gaps below 1e-9 as that
    here, there = (channel.motion(channel.state(start))[0] for start in (z, z + shift))
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-12)


@settings(max_examples=50)
@given(distances, st.integers(0, 1000))
def test_spheres_never_overlap_and_keep_their_order(s, seed):
    """Any velocities at the nodes, ten times those of the simulation, over 100 D."""
    nodes = np.array(DEMO_NODES)
    noise = np.random.default_rng(seed).normal(size=(nodes.size, nodes.size, 3))
    channel = channel_of(triplet(nodes, nodes, lambda *_: SINGLE + 0.01 * noise))
    z = BETA * np.cumsum([0, *s])
    for _ in range(6):
        z = moved(channel, z, 10.0)
        assert np.diff(z).min() >= BETA * (1 - 1e-12)  # rounding of z near 100


def test_pair_closes_as_the_exact_solution():
    """With h = s - 1, h + g log(h) falls evenly; see `lubricate`."""
    velocities = triplet(law=strong)
    h_min, g = velocities.smallest_distance - 1, RESISTING_GAP
    trailing, leading = chain_motion(Nearest(velocities), np.array([h_min])).velocity
    rate = (trailing - leading) * (h_min + g) / (BETA * h_min)
    channel = channel_of(velocities)
    y, duration = channel.state(np.array([0.0, BETA * 1.08])), 0.0
    while duration < 200.0:
        step, _ = channel.step(y, 1.7)
        y, duration = step.state(step.duration), duration + step.duration
    start, end = 0.08 + g * np.log(0.08), np.exp(y[1]) + g * y[1]
    assert y[1] < -80  # a gap of 1e-36 d, which the difference of positions would lose
    # steps are curved while h is not far below g; each may err by less than 0.02 in log(h)
    assert end == pytest.approx(start - rate * duration, rel=1e-4)


def test_method_is_of_second_order():
    """Four spheres at free distances, step halved: error ratio 4, and small."""
    channel = channel_of(triplet(PAPER_NODES, PAPER_NODES, strong), tolerance=np.inf)
    start = BETA * np.cumsum([0, 1.7, 2.9, 2.2])
    exact = exactly_moved(channel, start, 8.0)
    errors = [
        np.abs(np.diff(moved(channel, start, 8.0, longest=h) - exact)).max() / BETA
        for h in (0.5, 0.25, 0.125)
    ]
    ratios = np.array(errors[:-1]) / errors[1:]
    assert ((ratios > 3.5) & (ratios < 4.5)).all()
    assert errors[-1] < 1e-4


def exactly_moved(channel, z, duration):
    """Positions by an independent integrator, from the positions themselves."""

    def rates(_, z):
        return chain_motion(channel.closure, np.diff(z) / BETA - 1).velocity

    return solve_ivp(rates, (0, duration), z, rtol=1e-10, atol=1e-12, method="DOP853").y[:, -1]


def test_short_train_against_another_integrator():
    """Seven spheres, interaction twenty times the real one, some gaps in lubrication, over 40 D."""
    channel = channel_of(triplet(law=strong))
    start = BETA * np.cumsum([0, 1.05, 2.0, 1.4, 4.0, 1.2, 3.0])
    exact = exactly_moved(channel, start, 24.0)
    change = np.abs(np.diff(exact - start)) / BETA
    error = np.abs(np.diff(moved(channel, start, 24.0) - exact)) / BETA
    assert change.max() > 1.0  # something happened
    assert error.max() < 1e-3  # what is demanded of the whole channel


@pytest.mark.parametrize("tau", [0.0, 0.3, 2.0])
def test_arrival_is_the_inverse_of_uniform_acceleration(tau):
    duration = 2.0
    for speed, acceleration in ((1.6, 0.0), (1.7, 0.1), (1.7, -0.1)):

        def way(time, speed=speed, acceleration=acceleration):
            return time * (speed + acceleration * time / 2)

        assert arrival(way(tau), speed, way(duration), duration) == pytest.approx(tau, abs=1e-14)


# ------------------------------------------------------------------------------------ injection


def test_no_room_for_the_volume_fraction():
    words = r"volume fraction is 0.03, in the feed 0.0495; allowed: at most 0\.02\d+, in the feed"
    with pytest.raises(TrainError, match=words):
        simulate(triplet(), volume_fraction=0.03)


def test_injection_waits_for_room():
    """Velocities that are said to be faster than they are: spheres enter in contact, not inside."""
    velocities = triplet(law=constant)
    velocities.slowest = 1.5 * SINGLE
    record = simulate(velocities, passages=300)
    assert record.delayed > 0
    # a state takes gaps below 1e-9 as that
    assert record.spacing.min() == pytest.approx(1.0, abs=2e-9)


# ------------------------------------------------------------------------------------ recording


def test_spheres_that_ignore_each_other_arrive_on_time():
    record = simulate(triplet(law=constant))
    entry = record.passage_time[0]
    # rounding of times near 100 in some hundred steps
    for station, passed in zip(CHANNEL["stations"], record.passage_time, strict=True):
        np.testing.assert_allclose(passed, entry + station / SINGLE, rtol=0, atol=1e-11)
    # the spacing of an interval is kept to the outlet, from the second recorded sphere on
    intervals = np.diff(entry) * SINGLE / BETA
    for spacing in record.spacing:
        np.testing.assert_allclose(spacing[1:], intervals, rtol=0, atol=1e-10)


def test_mean_spacing_is_that_of_the_injection():
    """<s*> = dt_eq U_p/d = (2/3) beta^2/phi."""
    record = simulate(triplet(law=constant), passages=2000)
    expected = parameters.mean_spacing(BETA, 0.004)
    # uniform in expected -+ (expected - 1): standard error of 2000 spacings, times four
    tolerance = 4 * (expected - 1) / np.sqrt(3 * 2000)
    np.testing.assert_allclose(record.spacing.mean(axis=1), expected, rtol=0, atol=tolerance)
    assert record.spacing.min() >= 1.0 - 1e-12
    assert record.spacing.max() <= 2 * expected - 1 + 1e-9


def test_same_spheres_at_every_station_in_order():
    record = simulate(triplet(law=strong))
    assert np.isfinite(record.spacing).all()
    assert (np.diff(record.passage_time, axis=0) > 0).all()  # from station to station
    assert (np.diff(record.passage_time, axis=1) > 0).all()  # one after the other
    assert set(record.passage_time[0]) <= set(record.entry_time)
    assert set(record.passage_time[2]) <= set(record.exit_time)


def test_recording_begins_when_the_first_sphere_leaves():
    record = simulate(triplet(law=strong))
    first_exit = record.exit_time[0]
    later = [entered for entered in record.entry_time if entered > first_exit]
    np.testing.assert_array_equal(record.passage_time[0], later[: CHANNEL["passages"]])
    assert record.snapshot_time[0] == first_exit


def test_spacing_at_the_outlet_is_the_last_distance():
    """The sphere ahead left when this one was a distance away: a station just there agrees."""
    velocities = triplet(law=strong)
    outlet = simulate(velocities).spacing[-1]
    before = simulate(velocities, stations=np.linspace(0, 40, 401)).spacing
    # stations lie 0.1 D apart; relative velocities are below 0.1 Ubar, so s* changes by
    # 0.1/1.65 * 0.1/0.2 = 0.03 at most between the last station before and the last distance
    near = 400 - np.ceil(outlet * BETA / 0.1).astype(int)
    assert np.abs(before[near, np.arange(60)] - outlet).max() < 0.03


def test_more_stations_change_nothing():
    velocities = triplet(law=strong)
    few, many = simulate(velocities), simulate(velocities, stations=[0, 5, 13, 20.5, 20.6, 40])
    np.testing.assert_array_equal(few.spacing, many.spacing[[0, 2, 5]])
    np.testing.assert_array_equal(few.passage_time, many.passage_time[[0, 2, 5]])


@pytest.mark.slow
def test_tolerance_is_small_enough():
    """Spacings at the outlet, demanded to 1e-3 d; the interaction is twenty times the real one."""
    velocities = triplet(law=strong)
    coarse = simulate(velocities).spacing[-1]
    fine = simulate(velocities, tolerance=motion.TOLERANCE / 100).spacing[-1]
    assert np.abs(coarse - simulate(velocities).spacing[0]).max() > 1.0
    assert np.abs(coarse - fine).max() < 1e-3


def test_a_channel_that_runs_empty():
    """Few spheres in a short channel: sometimes none, and then no spacing."""
    record = simulate(triplet(), length=20.0, stations=[10.0], volume_fraction=0.0005)
    assert record.initial + record.injected == record.removed + record.remaining
    assert np.isnan(record.spacing).any()
    assert np.isfinite(record.passage_time).all()


@settings(max_examples=15)
@given(
    st.integers(0, 2**32),
    st.sampled_from([0.1, 0.2, 0.5]),
    st.floats(0.05, 0.9),
    st.floats(0, 30),
)
def test_nothing_is_lost_and_nothing_overlaps(seed, confinement, crowding, strength):
    record = simulate(
        triplet(law=lambda sp, sf: superposed(sp, sf, scale=strength)),
        seed,
        confinement=confinement,
        volume_fraction=0.5 * crowding * confinement**2,
        length=30.0 * confinement / crowding,
        stations=[0.0, 3.0 * confinement],
        passages=20,
    )
    assert record.initial + record.injected == record.removed + record.remaining
    assert np.nanmin(record.spacing) >= 1 - 1e-9
    for snapshot in record.snapshots:
        assert np.diff(snapshot).min(initial=np.inf) >= 1 - 1e-9
    assert np.isfinite(record.passage_time).all()


@pytest.mark.parametrize("stations", [[-1.0], [0.0, 0.0], [20.0, 10.0], [41.0]])
def test_stations_outside_the_channel(stations):
    with pytest.raises(TrainError, match="allowed: ascending, 0 to 40"):
        simulate(triplet(), stations=stations)


def test_channel_too_short_for_three_spheres():
    with pytest.raises(TrainError, match="channel is 1 D long"):
        simulate(triplet(), length=1.0, stations=[0.0])


@pytest.mark.slow
def test_six_hundred_spheres_in_time():
    """600 spheres over 800 D and 1000 recorded passages: at most 5 s on one core."""
    started = time.process_time()
    record = simulate(
        triplet(PAPER_NODES, PAPER_NODES),
        length=800.0,
        stations=[0.0, 200.0, 400.0, 600.0, 800.0],
        passages=1000,
    )
    assert time.process_time() - started < 5.0
    assert max(snapshot.size for snapshot in record.snapshots) > 590
    assert record.spacing.shape == (5, 1000)


# -------------------------------------------------------------------------------------- results


def run(**changes):
    options = REPEATED | {"repeats": 3, "seed": 7} | changes
    return run_repeats(triplet(law=strong), **options)


@pytest.fixture(scope="module")
def result():
    return run(attributes={"title": "test"})


def test_dataset_holds_what_is_promised(result):
    assert result["spacing"].dims == ("repeat", "station", "passage")
    assert result["spacing"].shape == (3, 3, 60)
    assert result["position"].dims == ("repeat", "snapshot", "sphere")
    assert result["track_time"].shape == (40, 81)
    for name, variable in result.variables.items():
        assert variable.attrs["long_name"] and variable.attrs["units"] == "1", name
    balance = (
        result["initial_count"]
        + result["injected_count"]
        - result["removed_count"]
        - result["remaining_count"]
    )
    assert (balance == 0).all()


def test_number_of_spheres_agrees_with_the_snapshots(result):
    counted = np.isfinite(result["position"]).sum("sphere")
    for r in range(3):
        for n in range(recording.SNAPSHOTS):
            time_of_snapshot = float(result["snapshot_time"][r, n])
            near = result["number_of_spheres"][r].sel(count_time=time_of_snapshot, method="nearest")
            assert abs(int(near) - int(counted[r, n])) <= 1  # an event in between
    assert (result["number_of_spheres"][:, 0] == 3).all()


def test_same_seed_same_bits(result, tmp_path):
    again = run(attributes={"title": "test"})
    xr.testing.assert_identical(again, result)
    datasets.write(result, tmp_path / "a.nc")
    datasets.write(again, tmp_path / "b.nc")
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


def test_seeds_and_repeats_are_independent(result):
    fewer = run(repeats=2)
    np.testing.assert_array_equal(fewer["spacing"], result["spacing"][:2])
    spacings = [*result["spacing"].values[:, 0, 0], *run(seed=8)["spacing"].values[:, 0, 0]]
    assert len(set(spacings)) == 6


def test_tracks_are_the_first_recorded_spheres(result):
    passages = result["passage_time"][0].sel(station=0.0)[:40]
    np.testing.assert_array_equal(result["track_time"].sel(track_station=0.0), passages)
    assert float(result["track_position"][0, 0]) == 0.0


def test_memory_number_of_a_train_is_the_largest_of_all_gaps_and_times(result):
    """By hand: De times the fastest change of a gap, in d, seen along the tracks of the train."""
    train = at_deborah(result, 3.0)
    fastest = result["largest_relative_velocity"].values
    np.testing.assert_allclose(train["memory_number"], 3.0 * fastest / BETA)
    assert train["memory_number"].sizes == {"repeat": 3}
    for row in repeats.summary(train).splitlines():
        assert "quasi-steady" not in row or row.startswith("memory number: ")
    assert repeats.headline(at_deborah(result, 1e3))[-1] == "beyond the quasi-steady range"
    assert "quasi-steady" not in "".join(repeats.headline(at_deborah(result, 1e-3)))


def test_the_fastest_gap_of_a_channel_by_hand():
    """Two spheres alone, at each of a number of steps; nothing else moves the maximum."""
    channel = motion.Channel(EverySphere(triplet(law=strong)), BETA)
    seen = []
    y = channel.state(BETA * np.array([0.0, 1.3, 3.9]))
    for _ in range(5):
        seen.append(np.abs(np.diff(channel.motion(y)[0])).max())
        step, _ = channel.step(y, 2.0)
        y = step.state(step.duration)
    assert channel.fastest == pytest.approx(max(seen), rel=1e-12)
    assert motion.Channel(EverySphere(triplet(law=strong)), BETA).fastest == 0.0


def test_lines_in_the_moving_frame_are_level_without_interaction():
    options = REPEATED | {"repeats": 1, "seed": 7}
    result = run_repeats(triplet(law=constant), **options)
    track = result["track_position"].values
    # positions near 500 d from times near 100 D/Ubar, rounded some hundred times
    np.testing.assert_allclose(track, track[:, :1].repeat(81, axis=1), rtol=0, atol=1e-10)
    spacing = result["spacing"].values[0, 0, 1:40]
    np.testing.assert_allclose(-np.diff(track[:, 0]), spacing, rtol=0, atol=1e-10)


@pytest.mark.slow
def test_distribution_of_what_enters_is_uniform():
    result = run_repeats(
        triplet(law=constant), **REPEATED | {"repeats": 8, "seed": 3, "passages": 500}
    )
    expected = parameters.mean_spacing(BETA, 0.004)
    bins = result["spacing_bin"]
    inside = bins < 2 * expected - 1 - 0.25
    density = result["spacing_density"].sel(station=0.0)[inside.values]
    uniform = 1 / (2 * (expected - 1))
    # 4000 spacings in bins of probability 0.023: standard error 10 %, the largest of 43 below 4
    np.testing.assert_allclose(density, uniform, rtol=0.4)
    within = (
        np.abs(density - uniform)
        < result["spacing_density_halfwidth"].sel(station=0.0)[inside.values]
    )
    assert 0.8 < within.mean() <= 1.0  # 95 % are expected


# --------------------------------------------------------------------------------------- script


@pytest.mark.slow
def test_script_from_the_command_line(tiny_table, tmp_path):
    command = "trains.py", "--configfile", CONFIG / "tiny.yaml", "--deborah", "1"
    files = tiny_table, tmp_path / "train.nc"
    words = output(run_script(*command, "--volume-fraction", "0.01", *files))
    result = xr.load_dataset(files[1])
    assert result["spacing"].shape == (3, 3, 20)
    for name in ("deborah", "deborah_longest_mode"):
        assert float(result[name]) == 1.0
    assert {variable.attrs["units"] for variable in result.variables.values()} == {"1"}
    assert "station/D" in words
    refused = run_script(*command, "--volume-fraction", "0.03", *files)
    assert refused.returncode == 1
    assert refused.stderr.startswith("error: volume fraction is 0.03, in the feed 0.0")
