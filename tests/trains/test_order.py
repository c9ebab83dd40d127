"""Order of even trains: the linear theory against its exact limits and the train model itself."""

import math

import numpy as np
import pytest
import xarray as xr
from harness import ROOT
from synthetic import PAPER_NODES, relative, slowing, superposed, triplet

from viscotrain.errors import TableError, TrainError
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import order, tolerance
from viscotrain.trains.closures import CLOSURES, EverySphere, Nearest, make_closure
from viscotrain.trains.motion import Channel

BETA, SPACING = 0.2, 3.0
LAW = triplet(PAPER_NODES, PAPER_NODES)


def reversible(sp, sf):
    """U of three spheres in a Newtonian fluid: mirror images, U_1(sp, sf) = U_3(sf, sp)."""
    U = superposed(sp, sf)
    return (U + superposed(sf, sp)[..., ::-1]) / 2


REVERSIBLE = triplet(PAPER_NODES, PAPER_NODES, reversible)


def slope(function, s, h=1e-4):
    return (function(s + h) - function(s - h)) / (2 * h)


def followed(closure, distances, lengths, velocity, tolerance=1e-4):
    """Distances in d of a long train after it has moved along these lengths."""
    channel = Channel(closure, BETA, tolerance)
    y = channel.state(np.concatenate([[0.0], np.cumsum(distances)]) * BETA)
    time, found = 0.0, []
    for until in np.array(lengths) / velocity:
        while time < until - 1e-9:
            step, _ = channel.step(y, until - time)
            y, time = step.state(step.duration), time + step.duration
        found.append(np.diff(channel.positions(y)) / BETA)
    return found


def test_slopes_of_neighbours_are_those_of_the_law():
    """U_2 = slowing(sp) + slowing(sf) + (relative(sp) - relative(sf))/2, differentiated by hand."""
    found = order.response(Nearest(LAW), SPACING)
    A = slope(slowing, SPACING) + slope(relative, SPACING) / 2
    B = slope(slowing, SPACING) - slope(relative, SPACING) / 2
    assert (found.from_behind, found.from_ahead) == pytest.approx((A, B), abs=3e-6)
    side = found.slopes.size // 2
    inner = found.slopes[side - 1 : side + 2]
    np.testing.assert_allclose(
        inner,
        [-found.from_behind, found.from_behind - found.from_ahead, found.from_ahead],
        atol=1e-9,
    )


@pytest.mark.parametrize("closure", CLOSURES.values())
def test_slopes_add_up_to_nothing(closure):
    """A train that is moved as a whole moves on as before."""
    assert order.response(closure(LAW), SPACING).slopes.sum() == pytest.approx(0, abs=1e-9)


def test_growth_with_neighbours_is_the_formula():
    found = order.response(Nearest(LAW), SPACING)
    k = np.linspace(0, 2 * math.pi, 9)
    A, B = found.from_behind, found.from_ahead
    expected = (A - B) * (1 - np.cos(k)) / BETA + 1j * (A + B) * np.sin(k) / BETA
    np.testing.assert_allclose(order.growth(found, k, BETA), expected, atol=1e-9)
    assert order.ordering_length(found, BETA) == pytest.approx(
        found.velocity * BETA / (2 * (B - A))
    )


def test_the_memory_of_gaps_does_not_change_the_theory():
    """Its slopes are of second order, even with a strength of 100/Ubar (0.13 * 62/0.2 = 40)."""
    held, remembering = (
        order.response(make_closure("every_sphere", LAW, strength), SPACING)
        for strength in (0.0, 100.0)
    )
    relative = np.abs(np.diff(held.slopes)).max()  # of neighbours, which the shift makes
    second_order = 100 * relative**2 * order.SHIFT  # half of it from either gap of a sphere
    assert second_order < 1e-4 * np.abs(held.slopes).max()
    np.testing.assert_allclose(remembering.slopes, held.slopes, rtol=0, atol=second_order)


@pytest.mark.parametrize("closure", CLOSURES.values())
def test_a_reversible_flow_neither_orders_nor_disorders(closure):
    found = order.response(closure(REVERSIBLE), SPACING)
    assert found.from_behind == pytest.approx(found.from_ahead, abs=1e-8)
    assert abs(found.from_ahead) > 1e-5
    assert order.stability(found, BETA) == 0
    assert order.ordering_length(found, BETA) == math.inf


def test_repulsion_that_falls_with_the_distance_orders_and_attraction_does_not():
    lengths = {s: order.response(EverySphere(LAW), s) for s in (1.3, SPACING)}
    assert [order.stability(found, BETA) for found in lengths.values()] == [-1, 1]


@pytest.mark.parametrize("k", [math.pi / 4, math.pi / 2, 3 * math.pi / 4, math.pi])
@pytest.mark.parametrize("closure", CLOSURES.values())
def test_a_wave_in_a_train_grows_as_the_theory_says(closure, k):
    model, n, length = closure(LAW), 600, 300.0
    answer = order.response(model, SPACING)
    start = np.diff(SPACING * np.arange(n + 1) + 1e-2 * np.cos(k * np.arange(n + 1)))
    (end,) = followed(model, start, [length], answer.velocity, tolerance=1e-6)
    inner = np.arange(n // 4, 3 * n // 4)  # where the ends of the train are not felt
    before, after = (
        (np.exp(-1j * k * inner) * (s[inner] - s[inner].mean())).mean() for s in (start, end)
    )
    found = np.log(after / before) * answer.velocity / length
    expected = order.growth(answer, k, BETA)
    assert found.real == pytest.approx(expected.real, rel=0.02)
    assert found.imag == pytest.approx(expected.imag, rel=0.02, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("closure", CLOSURES.values())
def test_small_scatter_decays_along_the_channel_as_the_theory_says(closure):
    """Intervals +-2 % about the mean; 16000 distances, a sampling error of 0.3 %."""
    model, n = closure(LAW), 20000
    answer = order.response(model, SPACING)
    start = SPACING * (1 + np.random.default_rng(1).uniform(-0.02, 0.02, n))
    lengths = np.array([600, 1200, 1800, 2400.0])
    inner = slice(n // 10, -n // 10)
    found = [
        s[inner].std() / start[inner].std()
        for s in followed(model, start, lengths, answer.velocity)
    ]
    rate = order.growth(answer, order.WAVE_NUMBERS, BETA).real
    expected = order.remaining_variation(rate, answer.velocity, lengths)
    assert expected[-1] < 0.85
    np.testing.assert_allclose(found, expected, rtol=0.01)


@pytest.mark.slow
def test_scatter_of_a_tenth_decays_as_the_law_says_by_the_table_of_the_study():
    """Intervals +-10 % about 3 d at De = 5, with neighbours only: CV within 1 % of the law."""
    velocities = VelocityTable.open(ROOT / "docs" / "study" / "velocity_table.nc")
    model, n = Nearest(velocities.at(5)), 40000
    answer = order.response(model, 3.0)
    start = 3 * (1 + np.random.default_rng(2).uniform(-0.1, 0.1, n))
    lengths = np.array([300, 600, 900, 1200.0])
    inner = slice(n // 10, -n // 10)
    found = [
        s[inner].std() / start[inner].std()
        for s in followed(model, start, lengths, answer.velocity)
    ]
    expected = order.law(lengths, order.ordering_length(answer, velocities.confinement))
    assert expected[-1] == pytest.approx(0.70, abs=0.01)
    np.testing.assert_allclose(found, expected, rtol=0.01)


def test_with_neighbours_only_the_scatter_follows_the_bessel_function():
    answer = order.response(Nearest(LAW), SPACING)
    rate = order.growth(answer, order.WAVE_NUMBERS, BETA).real
    ordering = order.ordering_length(answer, BETA)
    x = np.array([0.1, 1, 2.8, 10])
    left = order.remaining_variation(rate, answer.velocity, x * ordering)
    np.testing.assert_allclose(left, order.law(x * ordering, ordering), rtol=1e-6)
    assert left[2] == pytest.approx(0.5, abs=0.01)  # the CV halves at 2.8 l


def table():
    """A reversible flow and the law of `synthetic`, as a velocity table."""
    nodes = np.array(PAPER_NODES)
    U = np.stack([law(nodes[:, None], nodes) for law in (reversible, superposed)])
    dataset = xr.Dataset(
        {
            "velocity": (("deborah", "sp", "sf", "particle"), U),
            "status": (("deborah", "sp", "sf"), np.zeros(U.shape[:-1], dtype=np.int8)),
            "pair_velocity": (
                ("deborah", "pair_distance", "particle_of_pair"),
                U[:, -1, :-1][..., 1:],
            ),
            "pair_status": (("deborah", "pair_distance"), np.zeros((2, 12), dtype=np.int8)),
        },
        coords={
            "deborah": [0.0, 5.0],
            "sp": nodes,
            "sf": nodes,
            "pair_distance": nodes[:-1],
            "particle": ["trailing", "middle", "leading"],
            "particle_of_pair": ["trailing", "leading"],
        },
        attrs={"simulations_settings": f"confinement: {BETA}\n"},
    )
    return VelocityTable(dataset)


def test_a_table_is_analysed_over_deborah_number_and_spacing():
    found = order.orders(table(), BETA, spacing=[1.3, 3.0, 6.0])
    assert found["stability"].values.tolist() == [[0, 0, 0], [-1, 1, 1]]
    assert found["volume_fraction"].sel(spacing=3).item() == pytest.approx(2 / 3 * BETA**2 / 3)
    own = order.response(EverySphere(LAW), 3.0)
    there = found.sel(deborah=5, spacing=3)
    assert there["ordering_length"].item() == pytest.approx(order.ordering_length(own, BETA))
    text = order.summary(found, 800)
    assert "De = 0: no spacing orders" in text
    assert "De = 5: orders fastest at s = 6 d" in text


def test_where_the_table_has_holes_the_order_is_not_known():
    """At one De: the other is the same as without; at all of them: the message of the table."""
    whole, broken = table(), table()
    broken.dataset["velocity"][1, 3, 3] = np.nan
    expected, found = (order.orders(one, BETA, spacing=[3.0]) for one in (whole, broken))
    xr.testing.assert_equal(found.sel(deborah=0), expected.sel(deborah=0))
    for name in ("ordering_length", "stability", "growth_rate"):
        assert np.isnan(found[name].sel(deborah=5)).all()
    assert found["deborah"].values.tolist() == [0, 5]
    assert "De = 5: not known, the table has holes" in order.summary(found, 800)
    wanted = tolerance.Wanted("every_sphere", "uniform", 800.0, 0.25)
    tolerant = tolerance.with_tolerance(found, broken, wanted)
    assert np.isnan(tolerant["injected_variation"].sel(deborah=5)).all()
    assert np.isfinite(tolerant["injected_variation"].sel(deborah=0)).all()
    assert tolerance.of_condition(broken, 5.0, 0.01, wanted).endswith("the table has holes")
    broken.dataset["velocity"][0, 3, 3] = np.nan
    with pytest.raises(TableError, match="1 hole"):
        order.orders(broken, BETA, spacing=[3.0])


def test_the_most_stable_spacing_has_the_shortest_length():
    velocities = table()
    best, shortest = order.most_stable(velocities, 5, BETA)
    near = order.orders(velocities, BETA, spacing=[0.95 * best, best, 1.05 * best])
    lengths = near["ordering_length"].sel(deborah=5).values
    assert lengths.argmin() == 1
    assert lengths[1] == pytest.approx(shortest, rel=1e-6)
    assert order.most_stable(velocities, 0, BETA)[1] == math.inf


def test_one_train_in_words():
    text = order.of_one_train(table(), 5, 3.0)
    assert "s = 3 d (phi = 0.889 % in a tube)" in text
    assert "the train is stable" in text
    assert "after 1, 3, 10 l" in text


@pytest.mark.parametrize("spacing", [0.9, 1.0, math.nan])
def test_a_train_closer_than_contact_is_refused(spacing):
    table = VelocityTable.open(ROOT / "docs" / "study" / "velocity_table.nc")
    with pytest.raises(TrainError, match=r"allowed: above 1 \(contact\)"):
        order.of_one_train(table, 5.0, spacing)
