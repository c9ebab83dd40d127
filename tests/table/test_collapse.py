"""Scaling of relative velocities with the confinement: known powers are found again."""

import numpy as np
import pytest

from viscotrain.table.collapse import AGREEMENT, collapse, exponent

BETA = np.array([0.1, 0.2, 0.3, 0.4])
XI = np.geomspace(0.02, 2, 41)
CURVE = 0.1 * XI * np.exp(-XI / 0.4)


def law(n, beta=BETA):
    return beta[:, None] ** n * CURVE


@pytest.mark.parametrize("n", [3.7, 4.0, -1.5])
def test_a_known_power_is_found_again_everywhere(n):
    power = exponent(BETA, law(n), 0.0)
    np.testing.assert_allclose(power.exponent, n, rtol=1e-12)
    np.testing.assert_allclose(power.halfwidth, 0.0, atol=1e-10)


def test_attraction_counts_as_repulsion_but_not_both():
    np.testing.assert_allclose(exponent(BETA, -law(4), 0.0).exponent, 4)
    mixed = law(4) * np.array([1, 1, 1, -1])[:, None]
    assert np.isnan(exponent(BETA, mixed, 0.0).exponent).all()
    assert not collapse(BETA, XI, mixed, 0.0).inside.any()


def test_the_interval_holds_the_power_as_often_as_it_says():
    rng = np.random.default_rng(1)
    scattered = law(4)[:, :1] * np.exp(0.05 * rng.standard_normal((4, 2000)))
    power = exponent(BETA, scattered, 0.0)
    share = (np.abs(power.exponent - 4) <= power.halfwidth).mean()
    assert 0.93 < share < 0.97


def test_errors_of_the_velocities_widen_the_interval():
    """By the error of a slope, times the normal quantile."""
    x = np.log(BETA) - np.log(BETA).mean()
    power = exponent(BETA, law(4), 0.02 * law(4))
    np.testing.assert_allclose(power.halfwidth, 1.96 * 0.02 / np.sqrt(x @ x), rtol=1e-3)


def test_a_velocity_of_the_size_of_its_error_is_not_fitted():
    power = exponent(BETA, law(4), law(4)[0].max() / 6)  # the smallest spheres, where they are slow
    known = np.isfinite(power.exponent)
    np.testing.assert_array_equal(known, law(4)[0] >= 5 / 6 * law(4)[0].max())
    assert 0 < known.sum() < XI.size


def test_two_diameters_have_a_power_with_the_interval_of_their_errors():
    two = law(4, BETA[:2])
    power = exponent(BETA[:2], two, 0.01 * two)
    np.testing.assert_allclose(power.exponent, 4)
    np.testing.assert_allclose(power.halfwidth, 1.96 * 0.01 * np.sqrt(2) / np.log(2), rtol=1e-3)


def test_the_range_ends_where_another_power_begins():
    """Below xi = 0.1 velocities go with the square: the range begins there, and n is not mixed."""
    two = np.where(XI < 0.1, 30 * law(2), law(4))
    found = collapse(BETA, XI, two, 0.0)
    assert found.nearest == XI[XI >= 0.1][0]
    assert found.farthest == XI[-1]
    assert found.power.exponent == pytest.approx(4, rel=1e-12)


def test_the_longest_of_several_ranges_counts():
    gap = law(4) * np.where((XI > 0.1) & (XI < 0.12), BETA[:, None], 1)
    found = collapse(BETA, XI, gap, 0.0)
    assert (found.nearest, found.farthest) == (XI[XI >= 0.12][0], XI[-1])


def test_scaled_velocities_in_the_range_agree_as_stated():
    """A power that changes slowly with the distance: the range is where 4 is within 20 %."""
    drifting = BETA[:, None] ** (4.2 + 0.3 * np.log(XI)) * CURVE
    found = collapse(BETA, XI, drifting, 0.0)
    scaled = np.log(drifting / BETA[:, None] ** 4)
    off = np.abs(scaled - scaled.mean(axis=0)).max(axis=0)
    np.testing.assert_array_equal(found.inside, off <= np.log1p(AGREEMENT))
    assert 0 < found.inside.sum() < XI.size
    powers = 4.2 + 0.3 * np.log(XI[found.inside])
    assert found.power.exponent == pytest.approx(powers.mean(), rel=1e-12)


def test_another_power_has_no_range_where_four_holds():
    found = collapse(BETA, XI, law(3), 0.0)
    assert not found.inside.any() and np.isnan(found.power.exponent) and np.isnan(found.nearest)
