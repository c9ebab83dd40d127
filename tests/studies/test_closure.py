"""Short trains, simulated directly and by the train model with both closures."""

import numpy as np
import pytest
import xarray as xr
from harness import study
from scipy.integrate import solve_ivp
from synthetic import PAPER_NODES, constant, triplet

from viscotrain.config import stages
from viscotrain.studies import accuracy, closure, dns, train_models
from viscotrain.table.assembly import combine
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains.closures import CLOSURES, Nearest
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
    found = train_models.model_distances(Nearest(velocities), BETA, start, TIMES)
    assert np.abs(exact[-1] - start).max() > 0.1
    np.testing.assert_allclose(found, exact, atol=1e-6)


def test_inner_spheres_may_feel_their_two_neighbours_only():
    nearest = Nearest(triplet(PAPER_NODES, PAPER_NODES))
    soon = np.array([0.0, 0.1])  # before the change has come through
    near, far = (
        train_models.model_distances(nearest, BETA, np.array([2.0, 2.0, 2.0, last]), soon)
        for last in (2.0, 9.0)
    )
    assert abs(near[1, 2] - far[1, 2]) > 1e-5  # next to the gap that differs
    assert near[1, 0] == pytest.approx(far[1, 0], abs=1e-8)


def direct(distance, over=0.0) -> xr.Dataset:
    return xr.Dataset(
        {
            "distance": (("time", "gap"), distance),
            "confinement": BETA,
            "start_up_time": over,
        },
        coords={"time": TIMES[: len(distance)]},
    )


def test_the_models_begin_where_the_start_up_ends():
    still = triplet(law=constant)
    moving = np.linspace([1.5, 2.0, 2.5], [1.7, 2.0, 2.1], TIMES.size)
    compared = train_models.with_models(direct(moving, over=50.0), still)
    model = compared["model_distance"]
    assert model["closure"].values.tolist() == ["every_sphere", "nearest"]
    assert np.isnan(model[:, :5]).all()
    np.testing.assert_allclose(model[:, 5:], np.tile(moving[5], (2, 16, 1)))
    change = moving[-1] - moving[5]
    expected = pytest.approx(np.abs(np.cumsum(change)).max())
    assert accuracy.largest_differences(compared) == {"every_sphere": expected, "nearest": expected}


def test_each_closure_moves_its_own_train():
    velocities = triplet(PAPER_NODES, PAPER_NODES)
    start = np.array([1.5, 2.2, 1.3, 3.0, 1.8])
    compared = train_models.with_models(direct(np.tile(start, (TIMES.size, 1))), velocities)
    for name, make in CLOSURES.items():
        expected = train_models.model_distances(make(velocities), BETA, start, TIMES)
        np.testing.assert_array_equal(compared["model_distance"].sel(closure=name), expected)
    found = accuracy.largest_differences(compared)
    assert abs(found["every_sphere"] - found["nearest"]) > 1e-3


def test_refinement_is_compared_at_the_end():
    coarse = direct(np.linspace([1.5, 2.0, 2.5], [1.7, 2.0, 2.1], TIMES.size))
    finer = direct(np.linspace([9.0, 9.0, 9.0], [1.701, 2.002, 2.1], 5))
    found = accuracy.refinement_difference(closure.with_refinement(coarse, finer))
    assert found == pytest.approx(3e-3)


def test_without_time_after_the_start_up_there_is_nothing_to_compare():
    compared = train_models.with_models(
        direct(np.full((21, 3), 2.0), over=1e3), triplet(law=constant)
    )
    assert np.isnan(list(accuracy.largest_differences(compared).values())).all()


@pytest.mark.slow
def test_three_spheres_are_a_triplet():
    """The only train for which closures are exact; both sides come by different ways."""
    three = study(verification={"closure": {"distances": (2.0, 2.0)}})
    spacing = closure.velocities_at_gap(stages.closure_gap(three), 0.5, report=print)
    assert spacing["number"].tolist() == [1, 2]
    assert spacing["direct"].abs().max() > 1e-5
    nodes = [1.5, np.inf]
    results = [dns.solve_geometry(stages.flow(three), p, f, print)[0] for p in nodes for f in nodes]
    table = combine(results, sp=nodes, sf=nodes, deborah=stages.flow(three).deborah)
    rows = train_models.with_errors_of_models(spacing, VelocityTable(table))
    assert rows["closure"].tolist() == ["every_sphere"] * 2 + ["nearest"] * 2
    assert rows["error"].abs().max() < 1e-9
