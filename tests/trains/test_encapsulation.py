"""Beads in droplets: exact and random trains, counting, renewal theory, and the way back."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq
from synthetic import at_deborah, triplet

from viscotrain.drawing.encapsulation_figure import draw_encapsulation
from viscotrain.fluid.parameters import Fluid, Mode, mean_spacing
from viscotrain.fluid.units import physical_units
from viscotrain.trains import encapsulation
from viscotrain.trains.occupancy import (
    FREQUENCY_RATIO,
    STEP,
    edges,
    edges_halfwidth,
    occupancy,
    of_passages,
    poisson,
)
from viscotrain.trains.repeats import run_repeats

ROUND_OFF = 1e-12
D, d = 100e-6, 20e-6  # m
UNITS = physical_units(
    Fluid(0.051, (Mode(0.257, 0.0752, 0.283),)),
    {De: De for De in (0.0, 1.0, 5.0)},
    channel_diameter=D,
    particle_diameter=d,
)


def passages(gaps) -> np.ndarray:
    """Times of passages, shape (repeat, passage), by the gaps between them."""
    return np.concatenate([np.zeros((len(gaps), 1)), np.cumsum(gaps, axis=-1)], axis=-1)


@pytest.fixture(scope="module")
def random_beads():
    """40 repeats of beads at random times, one in a unit of time."""
    return passages(np.random.default_rng(4).exponential(size=(40, 2000)))


# ------------------------------------------------------------------------------------- occupancy


def test_an_even_train_at_its_frequency_has_one_bead_in_every_droplet():
    time = np.linspace(0.0, 700.0, 1001)
    assert occupancy(time, 0.7) == pytest.approx(np.array([0.0, 1.0, 0.0]), abs=ROUND_OFF)
    found = of_passages(np.stack([time, time + 0.3]), 1 / 0.7, None)
    assert found["best_single"] == pytest.approx(1.0, abs=ROUND_OFF)
    assert found["best_frequency_ratio"] == 1.0
    assert found["mean_count"] == pytest.approx(1.0, abs=ROUND_OFF)


def test_an_even_train_at_other_frequencies():
    """Between T = 0 and twice the gap: P(1) is a triangle."""
    T = np.linspace(0.05, 1.95, 39)
    found = occupancy(np.arange(50.0), T)
    expected = [np.maximum(1 - T, 0), 1 - np.abs(1 - T), np.maximum(T - 1, 0)]
    assert found == pytest.approx(np.array(expected), abs=ROUND_OFF)


def test_four_beads_by_hand():
    """At 0, 1, 4, 6; droplets begin between 0 and 4."""
    time = np.array([0.0, 1.0, 4.0, 6.0])
    assert occupancy(time, 2.0) == pytest.approx([1 / 4, 3 / 4, 0])  # none from 1 to 2
    assert occupancy(time, 3.0) == pytest.approx([0, 3 / 4, 1 / 4])  # 4 and 6 from 3 on
    assert occupancy(time, 2.5) == pytest.approx([1 / 8, 6 / 8, 1 / 8])  # 1 to 1.5; from 3.5 on


def counted(time, period, phases=2000):
    """The same by counting the beads in the droplets of many phases."""
    counts = []
    for phase in (np.arange(phases) + 0.5) / phases:
        begin = np.arange(time[0] + phase * period, time[-2], period)
        inside = np.searchsorted(time, begin + period) - np.searchsorted(time, begin)
        counts.append(np.bincount(np.minimum(inside, 2), minlength=3))
    total = np.sum(counts, axis=0)
    return total / total.sum()


@pytest.mark.parametrize("period", [0.4, 1.0, 1.7])
def test_occupancy_is_what_counting_gives(period):
    """On pairs and singles; half the steps of the phase in a gap or two are wrong at most."""
    rng = np.random.default_rng(2)
    gaps = rng.choice([0.05, 0.9, 1.6], size=300) + rng.uniform(0, 0.1, size=300)
    time = np.concatenate([[0.0], np.cumsum(gaps)])
    assert occupancy(time, period) == pytest.approx(counted(time, period), abs=2e-4)


def test_random_beads_are_poisson(random_beads):
    """Within twice the half width of 95 % at every frequency, which are not independent."""
    found = of_passages(random_beads, 1.0, None)
    expected = poisson(1 / FREQUENCY_RATIO)
    error = np.abs(found["occupancy_curve"] - expected) / found["occupancy_curve_halfwidth"]
    assert error.max() < 2
    assert found["best_single"] == pytest.approx(math.exp(-1), abs=0.004)
    assert found["occupancy_curve_halfwidth"][1].max() < 0.005  # the bands are narrow
    assert found["poisson_occupancy"] == pytest.approx(found["occupancy"], abs=0.01)


def test_poisson_adds_up():
    m = 0.7
    terms = [math.exp(-m) * m**n / math.factorial(n) for n in range(40)]
    assert poisson(m) == pytest.approx([terms[0], terms[1], sum(terms[2:])], abs=ROUND_OFF)
    assert poisson(np.linspace(0.1, 5, 491))[1].max() == pytest.approx(math.exp(-1), abs=1e-6)


@pytest.mark.parametrize("T", [0.3, 1.0, 2.2])
def test_every_second_of_random_beads_by_renewal_theory(T):
    """Gaps are sums of two exponentials: a droplet begins at either stage of a gap.

    With N of Poisson's distribution of the mean 2 T, P(0) is the mean of P(N < 1) and P(N < 2), and
    P(0) + P(1) that of P(N < 3) and P(N < 4).
    """
    rng = np.random.default_rng(1)
    time = passages(rng.exponential(0.5, size=(40, 5000, 2)).sum(axis=-1))
    found = np.array([occupancy(t, T) for t in time])
    below = np.cumsum([math.exp(-2 * T) * (2 * T) ** n / math.factorial(n) for n in range(4)])
    none, at_most_one = (below[0] + below[1]) / 2, (below[2] + below[3]) / 2
    error = np.abs(found.mean(axis=0) - [none, at_most_one - none, 1 - at_most_one])
    assert np.all(error < 3 * found.std(axis=0, ddof=1) / math.sqrt(40))
    assert error.max() < 0.004


@given(
    st.lists(st.floats(0.01, 10), min_size=2, max_size=30),
    st.floats(0.01, 50),
    st.floats(1e-3, 1e3),
)
def test_shares_add_up_whatever_the_unit_of_time(gaps, period, unit):
    time = np.concatenate([[0.0], np.cumsum(gaps)])
    found = occupancy(time, period)
    assert found.sum() == pytest.approx(1.0, abs=ROUND_OFF)
    assert found.min() > -1e-9
    assert occupancy(unit * time, unit * period) == pytest.approx(found, abs=1e-9)


# ------------------------------------------------------------------------------- best, tolerance


def test_tolerance_of_an_even_train():
    """P(1) is 1 - |1 - T|: 0.95 at T = 0.95 and 1.05."""
    single = occupancy(np.arange(50.0), 1 / FREQUENCY_RATIO)[1]
    assert edges(single) == pytest.approx([1, 1 / 1.05, 1 / 0.95], abs=1e-4)


def random_edges():
    """Of beads at random times: m exp(-m) is 0.95 of its best, which is at m = 1."""

    def short(m):
        return m * math.exp(1 - m) - 0.95

    return [1, 1 / brentq(short, 1, 3), 1 / brentq(short, 0.1, 1)]


def test_tolerance_of_random_beads():
    found = edges(poisson(1 / FREQUENCY_RATIO)[1])
    assert found == pytest.approx(random_edges(), abs=1e-4)


def test_a_range_that_does_not_end_is_said_to_be_so():
    assert np.isnan(edges(np.ones_like(FREQUENCY_RATIO))).tolist() == [False, True, True]


@pytest.mark.parametrize("repeats", [4, 10])
def test_errors_of_the_frequencies_cover_the_truth(repeats):
    """19 times of 20 in the long run, so rarely less than 32 times of 40; and not for nothing."""
    rng, covered, sizes = np.random.default_rng(3), np.zeros(3), []
    for _ in range(40):
        time = passages(rng.exponential(size=(repeats, 300)))
        single = np.array([occupancy(t, 1 / FREQUENCY_RATIO)[1] for t in time])
        sizes.append(edges_halfwidth(single))
        covered += np.abs(edges(single.mean(axis=0)) - random_edges()) < sizes[-1]
    assert covered.min() >= 32
    assert np.min(sizes) >= STEP / 2 * 0.6
    assert np.mean(sizes) < 0.4 / math.sqrt(repeats)
    assert np.isnan(edges_halfwidth(single[:1])).all()


# ------------------------------------------------------------------------------------- the stage


def trains_at(deborah, volume_fraction=0.01, stations=(0.0, 20.0, 40.0), passages=60):
    result = run_repeats(
        triplet(),
        confinement=d / D,
        volume_fraction=volume_fraction,
        centreline_velocity=1.67,
        length=40.0,
        stations=stations,
        passages=passages,
        repeats=2,
        seed=1,
    )
    return at_deborah(result, deborah)


@pytest.fixture(scope="module")
def train():
    return trains_at(5.0)


def test_every_station_of_trains_and_the_ends_of_the_map(train):
    point = trains_at(1.0, 0.015)
    found = encapsulation.combine([train], [point], UNITS)
    assert found["station"].values.tolist() == [0, 20, 40, 0, 40]
    assert found["of_map"].values.tolist() == [0, 0, 0, 1, 1]
    assert found["last_station"].values.tolist() == [0, 0, 1, 0, 1]
    assert found["deborah"].values.tolist() == [5, 5, 5, 1, 1]
    assert found["occupancy"].sum("count").values == pytest.approx(1)
    assert found["occupancy"].values[:, 1] == pytest.approx(found["best_single"].values)
    own = of_passages(train["passage_time"].values[:, 1], float(train["injection_rate"]), None)
    assert found["occupancy"].values[1] == pytest.approx(own["occupancy"])
    for name, variable in found.variables.items():
        assert "long_name" in variable.attrs, name
        assert name == "count" or "units" in variable.attrs, name


def test_a_frequency_in_hertz(train):
    """Droplets per second over beads per second, and the same shares as by counting."""
    seconds = float(UNITS["time"].sel(deborah=5))
    found = encapsulation.combine([train], [], UNITS, droplet_frequency=150.0).isel(condition=2)
    rate = float(train["injection_rate"]) / seconds
    assert float(found["bead_rate"]) == pytest.approx(rate)
    assert float(found["droplet_frequency_ratio"]) == pytest.approx(150 / rate)
    time = train["passage_time"].values[:, 2] * seconds
    expected = np.mean([counted(t, 1 / 150) for t in time], axis=0)
    assert found["occupancy"].values == pytest.approx(expected, abs=1e-3)
    table = encapsulation.table(found.expand_dims("condition"))
    assert table["droplets_per_second"][0] == pytest.approx(150)
    assert table["one_percent"][0] == pytest.approx(100 * expected[1], abs=0.1)
    assert table["best_droplets_per_second"][0] == pytest.approx(
        rate * float(found["best_frequency_ratio"])
    )


def test_creeping_flow_has_no_frequency_in_hertz():
    train = trains_at(0.0)
    found = encapsulation.combine([train], [], UNITS, droplet_frequency=150.0, bead_rate=150.0)
    assert np.isnan(found["occupancy"]).all()
    assert np.isfinite(found["best_single"]).all()
    assert encapsulation.inverse_table(found).empty
    draw_encapsulation(found)
    text = "\n".join(encapsulation.headline(found))
    assert "droplets per bead; within 5 % of it" in text
    assert "nan" not in text


@pytest.mark.parametrize("passages", [1, 2])
def test_too_few_passages_are_said_to_be_so(passages):
    found = encapsulation.combine([trains_at(5.0, passages=passages)], [], UNITS)
    assert np.isnan(found["occupancy"]).all() and np.isnan(found["best_frequency_ratio"]).all()
    assert encapsulation.headline(found) == ["not counted: fewer than 3 passages"]
    draw_encapsulation(found)


def test_the_headline_is_of_the_best_condition_at_its_end(train):
    found = encapsulation.combine([train], [trains_at(1.0, 0.025)], UNITS)
    found["occupancy"][{"condition": 0, "count": 1}] = 0.99  # at the inlet: does not count
    best = encapsulation.best_condition(found)
    assert float(best["station"]) == 40
    single = found["best_single"].values[[2, 4]]
    assert float(best["best_single"]) == single.max()
    lines = encapsulation.headline(found)
    assert f"one bead in {100 * single.max():.1f} +- " in lines[0]
    at_inlet = found["best_single"].values[[0, 3][int(single.argmax())]]
    assert f"as injected {100 * at_inlet:.1f} %" in lines[1]


# ----------------------------------------------------------------------------------- the inverse


def test_the_feed_that_gives_a_rate_is_that_of_a_train_with_this_rate(train):
    rate = float(train["injection_rate"] / UNITS["time"].sel(deborah=5))
    found = encapsulation.inverse(rate, [train], UNITS).isel(flow=0)
    for name in ("feed_volume_fraction", "volume_fraction"):
        assert float(found[f"wanted_{name}"]) == pytest.approx(float(train[name]))
    assert float(found["wanted_mean_spacing"]) == pytest.approx(mean_spacing(d / D, 0.01))
    assert float(found["wanted_flow_rate"]) == pytest.approx(
        float(UNITS["flow_rate"].sel(deborah=5))
    )


def test_the_inverse_by_hand(train):
    """At De = 5, Ubar = 5 * 100 um/0.0752 s = 6.65 mm/s: 50 beads/s in 52.2 nL/s."""
    found = encapsulation.inverse(50.0, [trains_at(0.0), train], UNITS)
    assert found["flow_deborah"].values.tolist() == [5.0]
    Q = math.pi / 4 * 1e-8 * 6.649e-3  # m^3/s
    assert float(found["wanted_feed_volume_fraction"][0]) == pytest.approx(
        50 * 4.18879e-15 / Q, rel=1e-3
    )


def test_too_many_beads_are_said_to_be_so(train):
    found = encapsulation.combine([train], [], UNITS, bead_rate=1e4)
    assert found["possible"].values.tolist() == [0]
    assert encapsulation.headline(found)[-1].endswith("not possible: closer than contact")
    assert encapsulation.inverse_table(found)["possible"].tolist() == [0]
    nothing = encapsulation.inverse_table(encapsulation.combine([train], [], UNITS))
    assert nothing.empty
    assert list(nothing) == list(encapsulation.inverse_table(found))
