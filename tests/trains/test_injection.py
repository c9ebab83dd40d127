"""Injection: what the laws of the intervals are, what enters, and that both fractions agree."""

import numpy as np
import pytest
from scipy.integrate import quad
from synthetic import SINGLE, constant, triplet

from viscotrain.fluid.parameters import mean_spacing
from viscotrain.trains.injection import (
    INJECTIONS,
    channel_volume_fraction,
    feed_volume_fraction,
    injection_law,
)
from viscotrain.trains.repeats import run_repeats
from viscotrain.trains.statistics import injected

BETA, PHI = 0.2, 0.004
DRAWN = 4000


def law_of(injection, **changes):
    options = {"confinement": BETA, "volume_fraction": PHI, "velocity": 1.65, "slowest": 1.6}
    return injection_law(injection=injection, **options | changes)


def drawn(law):
    rng = np.random.default_rng(1)
    return np.array([law.draw(rng) for _ in range(DRAWN)])


def train(**changes):
    options = {
        "confinement": BETA,
        "volume_fraction": PHI,
        "centreline_velocity": 1.67,
        "length": 40.0,
        "stations": [0.0, 40.0],
        "passages": 400,
        "repeats": 4,
        "seed": 2,
    }
    return run_repeats(triplet(law=constant), **options | changes)


@pytest.mark.parametrize("injection", INJECTIONS)
def test_mean_interval_is_that_of_the_volume_fraction_in_the_channel(injection):
    """V_p/(pi R^2 phi U_p) with d = beta, R = 1/2, and one diameter in the shortest interval."""
    law = law_of(injection, confinement=0.3, volume_fraction=0.01, velocity=1.7, slowest=1.5)
    assert law.mean == pytest.approx(np.pi * 0.3**3 / 6 / (np.pi * 0.5**2 * 0.01 * 1.7))
    assert law.shortest * 1.5 == pytest.approx(0.3)
    times = drawn(law)
    assert times.min() >= law.shortest
    error = law.variation * law.mean / DRAWN**0.5  # standard error
    assert times.mean() == pytest.approx(law.mean, abs=4 * error + 1e-12)


@pytest.mark.parametrize(("injection", "variation"), [("uniform", 0.49), ("poisson", 0.85)])
def test_coefficient_of_variation(injection, variation):
    """Of the demo, and by the distribution's own moments."""
    law = law_of(injection)
    assert law.variation == pytest.approx(variation, abs=0.01)
    times = drawn(law)
    # of 4000 deviates: 1.1 % of a uniform, 2.5 % of an exponential distribution; times three
    assert times.std() / times.mean() == pytest.approx(law.variation, rel=0.08)

    def above(t):
        return 1 - law.share_below(t)

    longest, kink = 60 * law.mean, [law.shortest, 2 * law.mean - law.shortest]
    mean, square = (
        quad(lambda t, n=n: n * t ** (n - 1) * above(t), 0, longest, points=kink, limit=200)[0]
        for n in (1, 2)
    )
    assert mean == pytest.approx(law.mean, rel=1e-6)
    assert np.sqrt(square - mean**2) / mean == pytest.approx(law.variation, rel=1e-5)


@pytest.mark.parametrize("injection", INJECTIONS)
def test_share_below_is_that_of_what_is_drawn(injection):
    law = law_of(injection)
    times = drawn(law)
    for interval in (0.9 * law.shortest, 1.1 * law.shortest, law.mean, 1.9 * law.mean):
        share = float(law.share_below(interval))
        error = np.sqrt(share * (1 - share) / DRAWN)
        assert np.mean(times < interval) == pytest.approx(share, abs=4 * error + 1e-12)


def test_even_intervals_are_the_mean_and_draw_nothing():
    law, rng = law_of("even"), np.random.default_rng(1)
    assert {law.draw(rng) for _ in range(5)} == {law.mean}
    assert rng.random() == np.random.default_rng(1).random()
    result = train(injection="even", repeats=1, passages=50)
    assert float(result["spacing_variation"][-1]) < 1e-8
    assert float(result["even_share_injected"]) == 1.0


def test_uniform_intervals_end_where_they_begin_on_the_other_side_of_the_mean():
    law = law_of("uniform")
    assert drawn(law).max() <= 2 * law.mean - law.shortest
    assert float(law.share_below(2 * law.mean - law.shortest)) == 1.0
    assert float(law.share_below(law.mean)) == pytest.approx(0.5)


def test_room_for_equal_intervals_only():
    """A mean that is the shortest one leaves nothing random."""
    for injection in INJECTIONS:
        law = INJECTIONS[injection](0.2, 0.2)
        assert set(drawn(law)) == {0.2}
        assert law.variation == 0.0
        assert law.share_below(np.array([0.1, 0.3])).tolist() == [0.0, 1.0]


def test_what_is_poured_in_is_what_enters():
    """Spheres per time, times their volume, over the flow rate pi D^2 Ubar/4."""
    law = law_of("uniform", velocity=SINGLE)
    feed = (np.pi / 6 * BETA**3) / law.mean / (np.pi / 4)
    assert feed_volume_fraction(PHI, SINGLE) == pytest.approx(feed)
    assert feed == pytest.approx(0.0066, abs=1e-5)  # 0.4 % in the channel at De = 5
    assert channel_volume_fraction(feed, SINGLE) == pytest.approx(PHI)


def test_a_train_of_the_feed_is_that_of_the_channel():
    """The same spheres, by either fraction; s* = (U_p/Ubar) (2/3) beta^2/phi_feed."""
    own = train(passages=40, repeats=2)
    feed = float(own["feed_volume_fraction"])
    assert feed == pytest.approx(PHI * SINGLE)
    poured = train(passages=40, repeats=2, volume_fraction=feed, feed=True)
    assert float(poured["volume_fraction"]) == pytest.approx(PHI, rel=1e-12)
    assert float(poured["feed_volume_fraction"]) == feed  # as it is given, for names of files
    assert own.attrs["given"] == "volume_fraction"
    assert poured.attrs["given"] == "feed_volume_fraction"
    # an interval may differ in its last bit
    np.testing.assert_allclose(poured["spacing"], own["spacing"], rtol=0, atol=1e-9)
    law = SINGLE * mean_spacing(BETA, feed)
    assert float(poured["mean_spacing_law"]) == pytest.approx(law)


@pytest.mark.parametrize("injection", INJECTIONS)
def test_a_train_is_what_the_law_makes_of_it(injection):
    """Spheres that ignore each other, at both ends of the channel, against the baseline."""
    result = train(injection=injection)
    assert result.attrs["injection"] == injection
    gaps = 1600
    for name in ("spacing_variation", "even_share", "touching_share"):
        law = float(result[f"{name}_injected"])
        # standard errors of shares; 1.5 covers the CV's; touching spheres come in twos
        error = 1.5 * np.sqrt(max(law * (1 - law), 0.01) / gaps)
        np.testing.assert_allclose(result[name], law, rtol=0, atol=4 * error)
    density = result["spacing_density"].isel(station=1)
    error = np.sqrt(result["spacing_density_injected"] / 0.25 / gaps)
    assert (np.abs(density - result["spacing_density_injected"]) < 4.5 * error + 1e-12).all()
    np.testing.assert_allclose(result["mean_spacing"], mean_spacing(BETA, PHI), rtol=0.09)
    rate = 1600 / float((result["passage_time"][:, 0, -1] - result["passage_time"][:, 0, 0]).sum())
    assert float(result["injection_rate"]) == pytest.approx(rate, rel=0.09)


def test_strings_that_the_law_makes_by_itself():
    """Of independent gaps: n (1 - p)^2 p^(n-1), here by drawing them."""
    law = law_of("poisson", volume_fraction=0.02, slowest=1.65)
    found = injected(law, confinement=BETA, velocity=1.65, mean_spacing=4 / 3)
    p = float(law.share_below(1.1 * BETA / 1.65))
    assert 0.2 < p < 0.3
    touches = np.random.default_rng(0).random(100_000) < p
    length = np.diff(np.flatnonzero(~np.r_[False, touches, False]))
    for n in (1, 2, 3, 4):
        expected = n * np.sum(length == n) / length.sum()
        share = float(found["string_share_injected"].sel(string_length=n))
        assert share == pytest.approx(expected, abs=4 * n * np.sqrt(expected / 1e5))
    assert float(found["string_share_injected"].sum()) == pytest.approx(1.0)
    assert float(found["touching_share_injected"]) == pytest.approx(1 - (1 - p) ** 2)
