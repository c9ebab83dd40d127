"""Order between the Deborah numbers of a table: exact at them, and of curves that are known."""

import numpy as np
import pytest
import xarray as xr

from viscotrain.trains import order
from viscotrain.trains.order_between import BEYOND, order_at

DEBORAH, SPACING = np.array([0.0, 1.0, 2.0, 5.0]), np.array([2.0, 3.0])
LENGTH = 800.0


def found(rate=lambda De: 1e-3 * np.log1p(De), velocity=lambda De: 2 - 0.05 * np.log1p(De)):
    """Neighbours only: growth -rate (1 - cos k)/2 at every spacing, twice at the second."""
    shape = (1 - np.cos(order.WAVE_NUMBERS)) / 2
    growth = -np.multiply.outer(np.multiply.outer(rate(DEBORAH), [1.0, 2.0]), shape)
    U = np.repeat(velocity(DEBORAH)[:, None], 2, axis=1)
    dims = ("deborah", "spacing", "wave_number")
    return xr.Dataset({"growth_rate": (dims, growth), "velocity": (dims[:2], U)})


def test_the_numbers_of_the_table_are_its_own():
    own = found()
    at = order_at(own, DEBORAH, DEBORAH, LENGTH)
    rate = -own["growth_rate"].values[..., -1] / own["velocity"].values
    assert at["ordering_rate"] == pytest.approx(rate, rel=1e-12)
    left = order.remaining_variation(own["growth_rate"].values, own["velocity"].values, LENGTH)
    assert at["remaining_variation"] == pytest.approx(left, rel=1e-12)


def test_straight_lines_are_met_between_and_a_little_beyond():
    De = np.array([[1.3, 4.9], [5.5, 6.2]])
    at = order_at(found(), DEBORAH, De, LENGTH)
    expected = 1e-3 * np.log1p(De) / (2 - 0.05 * np.log1p(De))
    assert at["ordering_rate"][..., 0] == pytest.approx(expected, rel=1e-9)
    assert at["ordering_rate"][..., 1] == pytest.approx(2 * expected, rel=1e-9)
    ordering = 1 / expected  # of the law with neighbours only
    assert at["remaining_variation"][0, 0, 0] == pytest.approx(
        order.law(LENGTH, ordering[0, 0]), rel=1e-6
    )


def test_a_smooth_curve_is_followed():
    at = order_at(found(lambda De: 1e-3 * np.tanh(De)), DEBORAH, 1.5, LENGTH)
    expected = 1e-3 * np.tanh(1.5) / (2 - 0.05 * np.log1p(1.5))
    assert at["ordering_rate"][0] == pytest.approx(expected, rel=0.04)


def test_far_away_nothing_is_known():
    at = order_at(found(), DEBORAH, [5 * (1 + BEYOND) + 0.01], LENGTH)
    assert np.isnan(at["ordering_rate"]).all()
    assert np.isnan(at["remaining_variation"]).all()
    below = order_at(found().isel(deborah=[1, 2]), DEBORAH[1:3], [0.9, 0.5], LENGTH)
    assert np.isfinite(below["ordering_rate"][0]).all()
    assert np.isnan(below["ordering_rate"][1]).all()


def test_one_deborah_number_has_no_slope():
    at = order_at(found().isel(deborah=[3]), DEBORAH[3:], [5.0, 5.1], LENGTH)
    assert np.isfinite(at["ordering_rate"][0]).all()
    assert np.isnan(at["ordering_rate"][1]).all()


def test_trains_that_do_not_order_have_rate_zero():
    at = order_at(found(lambda De: -1e-3 * De), DEBORAH, [1.0, 1.5], LENGTH)
    assert np.all(at["ordering_rate"] == 0)
    assert np.all(at["remaining_variation"] > 1)
