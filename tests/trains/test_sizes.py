"""Spheres that are not equal: what is drawn, how they move, and the linear law of their scatter."""

import math

import numpy as np
import pytest
from harness import ROOT, study
from scipy.linalg import expm
from scipy.stats import truncnorm
from synthetic import PAPER_NODES, SINGLE, constant, superposed, triplet

from viscotrain.config import stages
from viscotrain.errors import TableError
from viscotrain.studies import train_runs
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.size_response import SizeResponse, size_response
from viscotrain.trains import order, tolerance
from viscotrain.trains.closures import CLOSURES, EverySphere, Nearest, make_closure
from viscotrain.trains.motion import DEEPEST, Channel
from viscotrain.trains.recording import record_train
from viscotrain.trains.repeats import run_repeats
from viscotrain.trains.sizes import CUT, EQUAL, KEPT, Sizes, contact
from viscotrain.trains.statistics import measures

BETA, RESPONSE = 0.2, -0.03
CHANNEL = {
    "confinement": BETA,
    "volume_fraction": 0.004,
    "length": 40.0,
    "stations": [0.0, 13.0, 40.0],
    "passages": 60,
}
PAPER_TABLE = ROOT / "docs" / "study" / "velocity_table.nc"


def simulate(velocities, sizes, seed=0, **changes):
    options = CHANNEL | changes
    return record_train(
        EverySphere(velocities), **options, rng=np.random.default_rng(seed), sizes=sizes
    )


def moved(channel, y, duration):
    while duration > 1e-9:
        step, _ = channel.step(y, duration)
        y, duration = step.state(step.duration), duration - step.duration
    return y


# ------------------------------------------------------------------------------------ diameters


def test_what_is_drawn_has_the_variation_that_is_asked_for():
    assert pytest.approx(truncnorm(-CUT, CUT).std(), rel=1e-12) == KEPT
    rng, sizes = np.random.default_rng(5), Sizes(0.04, RESPONSE)
    e = np.array([sizes.draw(rng) for _ in range(40000)])
    assert e.std() == pytest.approx(0.04, rel=0.015)  # four standard errors
    assert abs(e.mean()) < 4 * 0.04 / math.sqrt(e.size)
    assert 0.99 < np.abs(e).max() * KEPT / (CUT * 0.04) <= 1  # cut there


def test_touching_spheres_are_half_of_both_diameters_apart():
    np.testing.assert_allclose(contact(np.array([0.1, -0.2, 0.0])), [0.95, 0.9])


def test_equal_spheres_are_those_of_before():
    """Whatever the response is; and spheres of either kind enter at the same times."""
    velocities = triplet(law=superposed)
    equal = simulate(velocities, EQUAL)
    same, others = (simulate(velocities, Sizes(v, RESPONSE)) for v in (0.0, 0.01))
    for name in ("spacing", "passage_time", "contact"):
        np.testing.assert_array_equal(getattr(equal, name), getattr(same, name))
    np.testing.assert_array_equal(equal.contact, 1.0)
    count = min(len(equal.entry_time), len(others.entry_time))
    np.testing.assert_allclose(equal.entry_time[:count], others.entry_time[:count], rtol=1e-12)
    assert np.abs(equal.spacing[-1] - others.spacing[-1]).max() > 0.01


# --------------------------------------------------------------------------------------- motion


@pytest.mark.parametrize("sign", [1, -1])
def test_without_interactions_spheres_drift_apart_as_their_diameters_say(sign):
    """Passages and distances, exactly; a swapped sphere or sign would show."""
    sizes = Sizes(0.02, sign * RESPONSE)
    record = simulate(triplet(law=constant), sizes, injection="even")
    first, passages = record.first_recorded, CHANNEL["passages"]
    e = np.array(record.deviation)
    own, ahead = e[first : first + passages], e[first - 1 : first + passages - 1]
    U, U_ahead = (SINGLE + sizes.response * each for each in (own, ahead))
    entry = record.passage_time[0]
    for station, passed in zip(CHANNEL["stations"], record.passage_time, strict=True):
        # gaps change evenly, and their logarithms, which are integrated, do not
        np.testing.assert_allclose(passed, entry + station / U, rtol=0, atol=1e-8)
    opened = (U_ahead - U) * (record.passage_time[1] - entry) / BETA
    np.testing.assert_allclose(record.spacing[1] - record.spacing[0], opened, atol=1e-7)
    assert np.abs(opened).max() > 0.05
    np.testing.assert_allclose(record.contact, 1 + (own + ahead) / 2, rtol=1e-14)


def test_a_fast_sphere_that_meets_a_slow_one_stops_at_contact():
    """Deviations of 20 % and -10 %: contact at 1.05 d; pressed together for a long time."""
    channel = Channel(EverySphere(triplet(law=constant)), BETA, response=-1.0)
    channel.hold(np.array([-0.1, 0.2]))
    y = moved(channel, channel.state(np.array([0.0, 1.5 * BETA])), 20.0)
    assert np.diff(channel.positions(y)) / BETA == pytest.approx(1.05, abs=1e-6)
    together = moved(channel, y, 400.0)
    assert np.isfinite(together).all() and together[1] > DEEPEST - 100
    (U, V), _ = channel.motion(together)
    assert U == V == pytest.approx(SINGLE - 0.05)  # the mean of both


def test_unequal_spheres_never_overlap():
    sizes = Sizes(0.05, 20 * RESPONSE)
    velocities = triplet(law=lambda sp, sf: superposed(sp, sf, scale=20))
    record = simulate(velocities, sizes, volume_fraction=0.01, passages=150)
    assert (record.spacing >= record.contact - 1e-9).all()
    assert (np.abs(record.spacing - record.contact) < 1e-3).any()  # some touch
    for z, e in zip(record.snapshots, record.snapshot_deviations, strict=True):
        assert z.size == e.size
        assert (np.diff(z) >= contact(e) - 1e-9).all()


def test_memory_is_that_of_interactions():
    """Single spheres have no gap to remember: what diameters do is the same with a memory."""
    velocities = triplet(law=constant)
    plain, remembering = (
        make_closure("every_sphere", velocities, strength) for strength in (0.0, 50.0)
    )
    found = []
    for closure in (plain, remembering):
        channel = Channel(closure, BETA, response=RESPONSE)
        channel.hold(np.array([0.1, -0.1, 0.2]))
        found.append(channel.motion(channel.state(BETA * np.array([0.0, 3.0, 6.0])))[0])
    np.testing.assert_allclose(found[0], SINGLE + RESPONSE * np.array([0.1, -0.1, 0.2]))
    np.testing.assert_array_equal(*found)


# ---------------------------------------------------------------------------------- statistics


def test_touching_is_told_by_the_gap():
    spacing = np.array([[[1.15, 3.0, 1.05, 3.0]]])
    equal = measures(spacing, 2.0)["touching_share"].item()
    large = measures(spacing, 2.0, np.array([1.1, 1.0, 0.9, 1.0]))["touching_share"].item()
    assert equal == pytest.approx(2 / 5)  # the pair at 1.05 d
    assert large == pytest.approx(2 / 5)  # the pair with a gap of 0.05 d, not that of 0.15 d
    shares = [
        measures(np.array([[[s, 3.0]]]), 2.0, np.array([c, 1.0]))["touching_share"].item()
        for s, c in ((1.15, 1.0), (1.15, 1.1), (1.05, 0.9))
    ]
    assert shares == pytest.approx([0, 2 / 3, 0])


def test_a_dataset_says_which_diameters_its_spheres_have():
    options = CHANNEL | {"centreline_velocity": 1.67, "repeats": 2, "seed": 7}
    trains, unknown = (
        run_repeats(
            triplet(law=superposed),
            diameter_variation=0.03,
            size_response=SizeResponse(RESPONSE, error),
            **options,
        )
        for error in (0.01, math.nan)
    )
    assert float(trains["diameter_variation"]) == 0.03
    assert float(trains["size_response"]) == RESPONSE
    d, c = trains["diameter"].values, trains["contact_distance"].values
    np.testing.assert_allclose(c[:, 1:], (d[:, 1:] + d[:, :-1]) / 2, rtol=1e-14)
    assert d.std() == pytest.approx(0.03, rel=0.3)
    assert "the size response" in trains.attrs["model_error"]
    assert "the size response" not in unknown.attrs["model_error"]
    assert trains["spacing"].equals(unknown["spacing"])
    name = "spacing_variation_model_error"
    assert (trains[name] > unknown[name]).values[1:].all()  # U' counts, a third wrong


def test_a_table_without_size_response_refuses_unequal_spheres(tiny_table):
    table = VelocityTable.open(tiny_table)
    own = stages.trains(study(particle={"diameter_variation": 0.02}))
    with pytest.raises(TableError, match=r"size_response.*diameter_variation > 0"):
        train_runs.simulate(own, table, 1.0, 0.01)
    assert train_runs.simulate(stages.trains(study()), table, 1.0, 0.01)["spacing"].notnull().all()


# ---------------------------------------------------------------------------------- linear law

LAW, SPACING = triplet(PAPER_NODES, PAPER_NODES), 3.0


def test_without_interactions_the_law_is_that_of_free_drift():
    answer = order.response(Nearest(triplet(law=constant)), SPACING)
    own = tolerance.law(answer, BETA, RESPONSE, [100.0, 800.0])
    t = np.array([100.0, 800.0]) / SINGLE
    expected = math.sqrt(2) * abs(RESPONSE) * t / BETA / SPACING
    np.testing.assert_allclose(own.by_size, expected, rtol=1e-6)
    np.testing.assert_allclose(own.remaining, 1.0, rtol=1e-9)


@pytest.mark.parametrize("closure", CLOSURES.values())
def test_the_law_is_the_solution_of_the_linear_system(closure):
    """A ring of spheres, by a matrix exponential: dz/dt = A z + c e, with e of unit variance."""
    answer, n, length = order.response(closure(LAW), SPACING), 128, 800.0
    side, t = answer.slopes.size // 2, length / answer.velocity
    row = np.zeros(n)
    for m, C in zip(range(-side, side + 1), answer.slopes / BETA, strict=True):
        row[m % n] += C
    A = np.array([np.roll(row, i) for i in range(n)])
    forced = expm(t * np.block([[A, np.eye(n)], [np.zeros((n, 2 * n))]]))
    gaps = np.roll(np.eye(n), 1, axis=1) - np.eye(n)
    from_diameters = gaps @ forced[:n, n:] * RESPONSE / BETA
    own = tolerance.law(answer, BETA, RESPONSE, length)
    found = np.linalg.norm(from_diameters[0]) / SPACING
    assert own.by_size == pytest.approx(found, rel=1e-6)
    # white noise of the distances: their own matrix is that of positions
    left = np.linalg.norm(forced[0, :n])
    assert own.remaining == pytest.approx(left, rel=1e-6)
    free = math.sqrt(2) * abs(RESPONSE) * t / BETA / SPACING
    assert 0.3 < own.by_size / free < 0.95  # interactions hold spheres back


def test_the_largest_variation_is_the_inverse_of_the_law():
    own = tolerance.law(order.response(Nearest(LAW), SPACING), BETA, RESPONSE, 800.0)
    most = own.largest(0.2, 0.25)
    assert 0 < most < own.largest(0.0, 0.25)
    assert own.variation(0.2, most) == pytest.approx(0.25)
    assert own.largest(0.5, 0.25) == 0.0  # not even equal spheres
    assert own.variation(0.2, 0) == pytest.approx(0.2 * own.remaining)


@pytest.mark.slow
@pytest.mark.parametrize("deborah", [5.0, 31.0])
def test_unequal_spheres_scatter_as_the_law_says_by_the_table_of_the_study(deborah):
    """3000 spheres that enter evenly, with the memory of the study: CV within 5 % of the law."""
    table, variation = VelocityTable.open(PAPER_TABLE), 0.005
    U = size_response(table, deborah).value
    model = make_closure("every_sphere", table.at(deborah), 0.13 * deborah / BETA)
    answer = order.response(model, SPACING)
    sizes, rng, n = Sizes(variation, U), np.random.default_rng(3), 3000
    channel = Channel(model, BETA, 1e-3, U)
    channel.hold(np.array([sizes.draw(rng) for _ in range(n)]))
    y, lengths, found = channel.state(BETA * SPACING * np.arange(n)), [300.0, 800.0], []
    for way in np.diff([0.0, *lengths]):
        y = moved(channel, y, way / answer.velocity)
        s = (np.diff(channel.positions(y)) / BETA)[n // 10 : -n // 10]
        found.append(s.std() / s.mean())
    expected = tolerance.law(answer, BETA, U, lengths).by_size * variation
    assert expected[-1] > 0.06
    np.testing.assert_allclose(found, expected, rtol=0.05)


def test_the_law_by_the_table_of_the_study():
    """At De = 5 and 3 d, beads that vary by 1 % have a CV of 0.26 after 800 D, neighbours only."""
    table = VelocityTable.open(PAPER_TABLE)
    answer = order.response(Nearest(table.at(5)), SPACING)
    own = tolerance.law(answer, BETA, size_response(table, 5).value, 800.0)
    assert own.variation(0, 0.01) == pytest.approx(0.264, abs=0.003)


WANTED = tolerance.Wanted("every_sphere", "uniform", 800.0, 0.25)


def test_a_table_is_analysed_for_what_diameters_may_vary_by():
    table = VelocityTable.open(PAPER_TABLE)
    found = order.orders(table, BETA, spacing=[1.3, 2.5])
    tolerant = tolerance.with_tolerance(found, table, WANTED)
    for De in (5, 31):
        own = tolerant.sel(deborah=De)
        assert own["stability"].values.tolist() == [-1, 1]
        assert np.isnan(own["largest_variation_even"][0])
        g = float(own["variation_by_size"][1])
        assert float(own["largest_variation_even"][1]) == pytest.approx(0.25 / g)
        assert 0 < float(own["largest_variation"][1]) < 0.25 / g
    assert all(variable.attrs.get("long_name") for variable in tolerant.data_vars.values())
    words = tolerance.of_condition(table, 31, 0.01, WANTED)
    assert "CV 0.36 -> 0.14 by the linear law, which knows no close pairs" in words
    assert "diameters may vary by 1.4 % at most, by 1.7 % at most if spheres enter evenly" in words
    feed = tolerance.of_condition(table, 31, 0.01 * table.at(31).isolated, WANTED, feed=True)
    assert feed == words
    none = tolerance.of_condition(table, 5, 0.004, WANTED)
    assert "may vary by nothing, it does not order, by 1.8 % at most if" in none


def test_without_a_size_response_the_rest_is_still_analysed():
    table = VelocityTable.open(PAPER_TABLE)
    plain = VelocityTable(table.dataset.drop_vars(["size_response", "size_response_error"]))
    found = tolerance.with_tolerance(order.orders(plain, BETA, spacing=[3.0]), plain, WANTED)
    assert np.isnan(found["largest_variation"]).all()
    assert found["ordering_length"].sel(deborah=5).item() < 2000
    assert "does not say what diameters" in tolerance.of_condition(plain, 5, 0.01, WANTED)
    with pytest.raises(TableError, match="size_response"):
        tolerance.of_one_train(plain, 5, 3.0, 0.01, WANTED)
