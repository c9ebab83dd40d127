"""Model errors: of trains by velocities that are wrong by a known amount."""

import math

import numpy as np
import pytest
import xarray as xr
from synthetic import DEMO_NODES, dns_result, superposed, triplet
from test_closures import EXACT, SIX, SPLINE, simulated, velocity

from viscotrain.table.assembly import combine
from viscotrain.table.check import check_errors
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains.closures import CLOSURES, POORER, EverySphere, FartherAsPairs, Nearest
from viscotrain.trains.model_error import (
    Shifted,
    in_words,
    interpolation_error,
    model_error,
    variants,
)
from viscotrain.trains.motion import chain_motion
from viscotrain.trains.repeats import run_repeats
from viscotrain.trains.statistics import MEASURES
from viscotrain.words import LEADING, MIDDLE, TRAILING, repeated

INF = np.inf
TRAIN = {
    "confinement": 0.2,
    "volume_fraction": 0.006,
    "centreline_velocity": 1.67,
    "length": 20.0,
    "stations": [0.0, 20.0],
    "passages": 30,
    "repeats": 8,
    "seed": 7,
}


def strong(sp, sf):
    return superposed(sp, sf, scale=10)


# ----------------------------------------------------------------------------- one term poorer


def test_farther_spheres_as_pairs_by_hand():
    s = np.array([1.3, 2.2, 1.7])
    single = EXACT.isolated
    expected = [
        velocity(INF, 1.3, MIDDLE)
        + (velocity(3.5, INF, TRAILING) - single)
        + (velocity(5.2, INF, TRAILING) - single),
        velocity(1.3, 2.2, MIDDLE) + (velocity(3.9, INF, TRAILING) - single),
        velocity(2.2, 1.7, MIDDLE) + (velocity(INF, 3.5, LEADING) - single),
        velocity(1.7, INF, MIDDLE)
        + (velocity(INF, 3.9, LEADING) - single)
        + (velocity(INF, 5.2, LEADING) - single),
    ]
    found = FartherAsPairs(EXACT).free_velocities(s)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2 * SPLINE)


def test_neighbours_as_pairs_by_hand():
    s = np.array([1.3, 2.2])
    single = EXACT.isolated
    expected = [
        velocity(INF, 1.3, MIDDLE),
        velocity(1.3, INF, MIDDLE) + velocity(INF, 2.2, MIDDLE) - single,
        velocity(2.2, INF, MIDDLE),
    ]
    found = POORER["nearest"](EXACT).free_velocities(s)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)
    assert POORER["nearest"](EXACT).free_velocities(np.array([])) == [single]


@pytest.mark.parametrize("gap", [1.0, 2.0])
@pytest.mark.parametrize("deborah", [0.0, 1.0, 5.0])
def test_what_the_last_term_adds_covers_what_it_lacks(gap, deborah):
    """Six spheres, simulated: more than the closure's true error, and less than the study's."""
    velocities, gaps = simulated(gap, deborah), np.full(5, gap)
    direct = SIX[(SIX["deborah"] == deborah) & (SIX["gap"] == gap)]["direct"].to_numpy()
    every, poorer, study = (
        chain_motion(closure(velocities), gaps).relative
        for closure in (EverySphere, FartherAsPairs, Nearest)
    )
    estimate = np.abs(poorer - every).max()
    assert np.abs(every - direct).max() < estimate < np.abs(study - direct).max()


# ------------------------------------------------------------------------------------ the table


def test_neighbours_are_driven_apart_by_what_is_measured():
    """A pair by A f(s), either way; spheres that are equally spaced only at the ends."""
    velocities = triplet()
    for name, make in CLOSURES.items():
        closed = make(velocities)
        shifted = variants(velocities, name, closed, 1e-4)["table"]
        for sign, wrong in ((1, shifted), (-1, Shifted(closed, -1e-4, velocities.decay))):
            s = np.array([2.4])
            more = np.diff(wrong.free_velocities(s)) - np.diff(closed.free_velocities(s))
            f = math.exp(-1.4 / velocities.decay)
            np.testing.assert_allclose(more, sign * 1e-4 * f, rtol=1e-9)
        even = np.full(5, 2.4)
        change = np.diff(shifted.free_velocities(even) - closed.free_velocities(even))
        np.testing.assert_allclose(change[1:-1], 0.0, atol=1e-15)
        np.testing.assert_allclose(change[[0, -1]], 1e-4 * f / 2, rtol=1e-9)
        mean = np.mean(shifted.free_velocities(even) - closed.free_velocities(even))
        assert abs(mean) < 1e-15
        assert shifted.isolated == closed.isolated and shifted.slowest == closed.slowest


def table_with(check):
    results = [dns_result(sp, sf) for sp in DEMO_NODES for sf in DEMO_NODES]
    table = combine(results, sp=DEMO_NODES, sf=DEMO_NODES, deborah=[0.0, 1.0])
    return check_errors(table, check) if check else table


def test_amplitude_is_that_of_the_measured_errors():
    """Errors that fall as f are found again, whatever their sign; no sphere is no gap."""
    table = table_with([dns_result(1.3, 1.9), dns_result(INF, 3.0)])
    velocities = VelocityTable(table)
    decay = velocities.at(1.0).decay
    gaps = np.array([[1.3, 1.9], [INF, 3.0]])
    error = 3e-5 * np.exp(-(gaps - 1) / decay) * [[1, -1], [1, -1]]
    error[1, 0] = 0.5
    table["check_error"].loc[{"deborah": 1.0}] = xr.DataArray(error, dims=["check", "pair"])
    assert interpolation_error(VelocityTable(table), 1.0) == pytest.approx(3e-5)
    assert "3.0e-05 Ubar" in in_words(3e-5, 4)


def test_a_table_that_was_not_checked_has_no_amplitude():
    assert math.isnan(interpolation_error(VelocityTable(table_with([])), 1.0))
    assert list(variants(triplet(), "nearest", Nearest(triplet()), math.nan)) == ["closure"]
    assert "table.check has not measured it" in in_words(math.nan, 1)


# ------------------------------------------------------------------------------------ statistics


def test_errors_of_both_kinds_add_as_independent_ones():
    spacing = np.random.default_rng(0).uniform(2, 6, size=(3, 2, 50))
    wrong = {"table": spacing + 0.3, "closure": spacing - 0.4}
    found = model_error(spacing, wrong, 4.0)
    np.testing.assert_allclose(found["mean_spacing_model_error"], 0.5)
    assert set(found) == {f"{name}_model_error" for name in (*MEASURES, "spacing_mode")}
    np.testing.assert_allclose(
        model_error(spacing, {"closure": spacing - 0.4}, 4.0)["mean_spacing_model_error"], 0.4
    )


@pytest.fixture(scope="module")
def result():
    return run_repeats(triplet(law=strong), **TRAIN, interpolation_error=2e-3)


def test_the_same_trains_are_simulated_again(result):
    """Nothing is wrong yet where they enter, and then it grows; with the same random numbers."""
    error = result["spacing_variation_model_error"].values
    assert error[0] == pytest.approx(0.0, abs=2e-3)  # the last sphere has not moved far
    assert error[1] > 3 * error[0]
    assert (result["mean_spacing_model_error"] < 0.02).all()  # it is that of the injection
    again = run_repeats(
        triplet(law=strong), **TRAIN | {"repeats": 2, "stations": [0.0, 10.0, 20.0]}
    )
    np.testing.assert_array_equal(again["spacing"][:, [0, 2]], result["spacing"][:2])


def test_every_statistic_has_both_errors(result):
    for name in (*MEASURES, "spacing_mode"):
        for end in ("_halfwidth", "_model_error"):
            assert result[name + end].dims == result[name].dims
            assert result[name + end].attrs["long_name"]
    assert "2 repeats simulated again" in result.attrs["model_error"]
    unknown = result["spacing_mode"].isnull()
    assert (result["spacing_mode_model_error"].isnull() == unknown).all()


def test_a_worse_table_has_larger_errors(result):
    better = run_repeats(triplet(law=strong), **TRAIN, interpolation_error=2e-5)
    names = ["spacing_variation_model_error", "spacing_density_model_error"]
    for name in names:
        assert float(better[name][-1].sum()) < float(result[name][-1].sum())


def test_a_few_repeats_are_enough():
    assert [repeated(n) for n in (1, 3, 4, 8, 20, 100)] == [1, 1, 1, 2, 4, 4]
