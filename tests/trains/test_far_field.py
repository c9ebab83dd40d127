"""What spheres behind the neighbours add, extrapolated in time, against the sum at every step."""

import numpy as np
import pytest
from synthetic import constant, superposed, triplet

from viscotrain.trains import recording
from viscotrain.trains.closures import CLOSURES, EverySphere, Nearest, make_closure
from viscotrain.trains.far_field import FIRST, FarField
from viscotrain.trains.motion import TOLERANCE, Channel
from viscotrain.trains.recording import record_train

BETA = 0.2


def three_bodies(sp, sf, scale=5):
    """The synthetic law, stronger, and what all three spheres do together."""
    together = np.exp(-np.asarray(sp) / 3 - np.asarray(sf) / 2)[..., None]
    return superposed(sp, sf, scale=scale) + scale * together * np.array([6e-4, 0.0, -4e-4])


CLOSURE = EverySphere(triplet(law=three_bodies))
WEAK = EverySphere(triplet(law=lambda sp, sf: three_bodies(sp, sf, scale=1)))  # as real ones


class Summed(FarField):
    """Sums at every step instead."""

    def after(self, time):
        """Nothing is known."""

    def follow(self, distance, change):
        """Nothing to follow."""

    def advance(self, time, distance):
        """Nothing to extrapolate."""

    def enter(self, distance):
        """Nothing to change."""

    leave = enter


def distances(number, seed=0):
    return 1.05 + np.random.default_rng(seed).exponential(2.0, number)


def far_field(distance, closure=CLOSURE):
    return FarField(closure, BETA, TOLERANCE, distance)


def train(monkeypatch, kind, closure=CLOSURE, **changes):
    monkeypatch.setattr(recording, "FarField", kind)
    options = {"volume_fraction": 0.012, "length": 120.0, "passages": 150} | changes
    return record_train(
        closure,
        confinement=BETA,
        stations=[0.0, options["length"]],
        rng=np.random.default_rng(3),
        **options,
    )


def test_the_law_has_something_to_add():
    assert np.abs(CLOSURE.far(distances(40))).max() > 1e-4
    assert CLOSURE.reach < 40 * 3  # of a train of forty spheres not all are felt by each


@pytest.mark.parametrize("number", [0, 1, 2, 3, 60])
def test_a_sphere_that_enters_or_leaves_changes_the_sum_as_it_should(number):
    longer = distances(number + 1)
    field = far_field(longer[1:])
    field.enter(longer)
    np.testing.assert_allclose(field.after(0.0), CLOSURE.far(longer), rtol=0, atol=1e-15)
    field = far_field(longer)
    field.leave(longer)
    np.testing.assert_allclose(field.after(0.0), CLOSURE.far(longer[:-1]), rtol=0, atol=1e-15)


def test_the_last_sphere_leaves_and_another_one_enters():
    nothing = np.array([])
    field = far_field(nothing)
    field.leave(nothing)
    assert field.after(0.0).size == 0
    field.advance(10.0, nothing)
    field.enter(nothing)
    np.testing.assert_array_equal(field.after(1.0), [0.0])


def test_the_rate_is_that_of_the_distances():
    """Also of a sphere that has entered since F was summed, of which it is known from then on."""
    start = distances(30)
    change = np.random.default_rng(1).normal(0.0, 2e-2, start.size)
    field = far_field(start[1:])
    field.follow(start[1:], change[1:])
    later = start + 0.05 * change
    field.advance(0.05, later[1:])
    field.enter(later)
    field.follow(later, change)
    for time in (0.0, 0.05):
        expected = CLOSURE.far(later + time * change)
        np.testing.assert_allclose(field.after(time), expected, rtol=0, atol=2e-8)
    moved = np.abs(CLOSURE.far(later + 0.05 * change) - CLOSURE.far(later))
    assert moved.max() > 1e-7  # the rate matters


class Parabola:
    """F is the square of the only distance."""

    def far(self, distance):
        return distance[:1] ** 2


def test_rates_follow_from_what_was_missed():
    """Of a rate that changes evenly one is a sixth of an interval behind, whatever it was before.

    That is where e = (1 - 3/2) e - (2 - 3/2) h leads, e being what the rate at the end is wrong by.
    """
    t, h = np.array([1.0]), FIRST
    field = FarField(Parabola(), BETA, TOLERANCE, t)
    field.follow(t, np.array([30.0]))  # wrong by 58
    for _ in range(40):
        field._interval = h  # as if errors were small
        t = t + h
        field.advance(h, t)
    rate = field.after(1.0) - field.after(0.0)
    np.testing.assert_allclose(rate, 2 * t - h / 3, rtol=0, atol=1e-9)


@pytest.mark.parametrize("memory", [0.0, 2.0])
def test_a_train_as_with_sums_at_every_step(monkeypatch, memory):
    closure = make_closure("every_sphere", CLOSURE.triplets, memory)
    summed = train(monkeypatch, Summed, closure)
    record = train(monkeypatch, FarField, closure)
    assert np.abs(summed.spacing[1] - summed.spacing[0]).max() > 0.3  # d
    np.testing.assert_allclose(record.spacing, summed.spacing, rtol=0, atol=1e-3)
    np.testing.assert_array_equal(record.deviation, summed.deviation)


def test_without_the_far_field_the_same_train_is_another_one(monkeypatch):
    record = train(monkeypatch, Summed)
    nearest = train(monkeypatch, Summed, Nearest(CLOSURE.triplets))
    assert np.abs(record.spacing - nearest.spacing).max() > 0.01


def test_few_sums_in_a_dense_train(monkeypatch):
    """Steps end at every sphere that enters or leaves, and would need two sums each."""
    counts = {"sums": 0, "steps": 0}
    far, step = EverySphere.far, Channel.step

    def counted(self, distance):
        counts["sums"] += distance.size > 100  # a part of the train is no sum of it
        return far(self, distance)

    def stepped(self, *given):
        counts["steps"] += 1
        return step(self, *given)

    monkeypatch.setattr(EverySphere, "far", counted)
    monkeypatch.setattr(Channel, "step", stepped)
    record = train(monkeypatch, FarField, WEAK, passages=20, length=160.0)
    assert record.remaining > 200
    assert counts["sums"] < 0.2 * 2 * counts["steps"]


@pytest.mark.parametrize("name", CLOSURES)
def test_spheres_that_ignore_each_other(monkeypatch, name):
    closure = CLOSURES[name](triplet(law=constant))
    record = train(monkeypatch, FarField, closure)
    expected = record.spacing[0]
    np.testing.assert_allclose(record.spacing[1], expected, rtol=0, atol=1e-9)
