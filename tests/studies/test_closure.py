"""The closure: the model of a short train, and its comparison with direct simulations."""

import numpy as np
import pytest
import xarray as xr
from harness import study
from scipy.integrate import solve_ivp
from synthetic import PAPER_NODES, constant, triplet

from viscotrain.config import stages
from viscotrain.studies import accuracy, closure
from viscotrain.words import LEADING, MIDDLE, TRAILING

BETA = 0.2
TIMES = np.linspace(0.0, 200.0, 21)


def test_model_of_a_triplet_follows_the_table():
    velocities = triplet(PAPER_NODES, PAPER_NODES)
    start = np.array([1.6, 2.2])

    def rate(_, s):
        U = velocities(*s)
        return np.array([U[MIDDLE] - U[TRAILING], U[LEADING] - U[MIDDLE]]) / BETA

    exact = solve_ivp(rate, (0, 200), start, t_eval=TIMES, rtol=1e-10, atol=1e-10).y.T
    found = closure.model_distances(velocities, BETA, start, TIMES)
    assert np.abs(exact[-1] - start).max() > 0.1
    np.testing.assert_allclose(found, exact, atol=1e-6)


def test_inner_spheres_feel_their_two_neighbours_only():
    velocities = triplet(PAPER_NODES, PAPER_NODES)
    soon = np.array([0.0, 0.1])  # before the change has come through
    near = closure.model_distances(velocities, BETA, np.array([2.0, 2.0, 2.0, 2.0]), soon)
    far = closure.model_distances(velocities, BETA, np.array([2.0, 2.0, 2.0, 9.0]), soon)
    assert abs(near[1, 2] - far[1, 2]) > 1e-5  # next to the gap that differs
    assert near[1, 0] == pytest.approx(far[1, 0], abs=1e-8)


def direct(distance) -> xr.Dataset:
    return xr.Dataset(
        {"distance": (("time", "gap"), distance), "confinement": BETA},
        coords={"time": TIMES[: len(distance)]},
    )


def test_the_model_begins_where_the_start_up_ends():
    still = triplet(law=constant)
    moving = np.linspace([1.5, 2.0, 2.5], [1.7, 2.0, 2.1], TIMES.size)
    compared = closure.with_model(direct(moving), still, start=50.0)
    model = compared["model_distance"]
    assert np.isnan(model[:5]).all()
    np.testing.assert_allclose(model[5:], np.tile(moving[5], (16, 1)))
    change = moving[-1] - moving[5]
    expected = np.abs(np.cumsum(change)).max()
    assert accuracy.largest_difference(compared) == pytest.approx(expected)


def test_refinement_is_compared_at_the_end():
    coarse = direct(np.linspace([1.5, 2.0, 2.5], [1.7, 2.0, 2.1], TIMES.size))
    finer = direct(np.linspace([9.0, 9.0, 9.0], [1.701, 2.002, 2.1], 5))
    found = accuracy.refinement_difference(closure.with_refinement(coarse, finer))
    assert found == pytest.approx(3e-3)


def test_without_time_after_the_start_up_there_is_nothing_to_compare():
    compared = closure.with_model(direct(np.full((21, 3), 2.0)), triplet(law=constant), 1e3)
    assert np.isnan(accuracy.largest_difference(compared))


@pytest.mark.slow
def test_three_spheres_are_a_triplet():
    """The only train for which the closure is exact; both sides come by different ways."""
    three = study(verification={"closure": {"distances": (2.0, 2.0)}})
    rows = closure.error_at_gap(stages.closure_gap(three), 0.5, report=print)
    assert rows["number"].tolist() == [1, 2]
    assert rows["direct"].abs().max() > 1e-5
    assert rows["error"].abs().max() < 1e-9
