"""Closures: velocities of trains from those of triplets, against sums written out here."""

import numpy as np
import pandas as pd
import pytest
from harness import ROOT
from hypothesis import given
from hypothesis import strategies as st
from synthetic import PAPER_NODES, SINGLE, relative, superposed, triplet

from viscotrain.table.interpolation import TripletVelocities
from viscotrain.trains import closures
from viscotrain.trains.closures import CLOSURES, EverySphere, Nearest, increments
from viscotrain.trains.motion import Channel, chain_motion
from viscotrain.words import LEADING, MIDDLE, TRAILING

INF = np.inf
SPLINE = 1e-9  # Ubar: error of a tabulated increment, measured


class Exact:
    """A law without a table: increments fall by e in 2.2 d, without a tail in 1/s."""

    smallest_distance, slowest, isolated = 1.05, 1.6, SINGLE

    def closure(self, sp, sf, particle):
        sp, sf = (np.maximum(s, self.smallest_distance) for s in (sp, sf))
        sp, sf, particle = np.broadcast_arrays(sp, sf, particle)
        return np.take_along_axis(superposed(sp, sf), particle[..., None], axis=-1)[..., 0]


EXACT = Exact()
FAR = EverySphere(EXACT)


def velocity(sp, sf, particle):
    return float(EXACT.closure(np.array([sp]), np.array([sf]), particle)[0])


def test_four_spheres_by_hand():
    s = np.array([1.3, 2.2, 1.7])
    expected = [
        velocity(INF, 1.3, MIDDLE)
        + (velocity(1.3, 2.2, TRAILING) - velocity(1.3, INF, TRAILING))
        + (velocity(1.3 + 2.2, 1.7, TRAILING) - velocity(1.3 + 2.2, INF, TRAILING)),
        velocity(1.3, 2.2, MIDDLE) + (velocity(2.2, 1.7, TRAILING) - velocity(2.2, INF, TRAILING)),
        velocity(2.2, 1.7, MIDDLE) + (velocity(1.3, 2.2, LEADING) - velocity(INF, 2.2, LEADING)),
        velocity(1.7, INF, MIDDLE)
        + (velocity(2.2, 1.7, LEADING) - velocity(INF, 1.7, LEADING))
        + (velocity(1.3, 2.2 + 1.7, LEADING) - velocity(INF, 2.2 + 1.7, LEADING)),
    ]
    found = FAR.free_velocities(s)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2 * SPLINE)
    assert np.abs(found - Nearest(EXACT).free_velocities(s)).max() > 1e-5


def direct_sum(s):
    """The sum over all spheres, none dropped, nothing tabulated."""
    z = np.concatenate([[0.0], np.cumsum(s)])
    N = z.size
    i, j = (each.ravel() for each in np.indices((N, N)))
    ahead, behind = j > i + 1, j < i - 1
    a, b = z[j[ahead] - 1] - z[i[ahead]], z[j[ahead]] - z[j[ahead] - 1]
    forward = EXACT.closure(a, b, TRAILING) - EXACT.closure(a, INF, TRAILING)
    a, b = z[i[behind]] - z[j[behind] + 1], z[j[behind] + 1] - z[j[behind]]
    backward = EXACT.closure(b, a, LEADING) - EXACT.closure(INF, a, LEADING)
    none = np.array([INF])
    U = EXACT.closure(np.concatenate([none, s]), np.concatenate([s, none]), MIDDLE)
    U += np.bincount(i[ahead], forward, N)
    return U + np.bincount(i[behind], backward, N)


@given(st.lists(st.floats(1, 15), min_size=2, max_size=60))
def test_what_is_dropped_is_negligible(distances):
    """1e-8 Ubar per term, tabulated ones included."""
    s = np.array(distances)
    error = np.abs(FAR.free_velocities(s) - direct_sum(s))
    assert error.max() < 1e-8 * s.size


def test_reach_is_where_increments_are_negligible():
    """They decay by e in 2.2 d; behind the reach none is above 1e-8, just before it one is."""
    a, b = np.array([FAR.reach / 1.02, FAR.reach, 2 * FAR.reach]), np.geomspace(1.05, 1e3, 100)
    largest = np.abs(increments(EXACT, a, b)).max(axis=(0, 2))
    assert largest[0] > 1e-8 > largest[1] > largest[2]
    assert 20 < FAR.reach < 30


def test_spheres_that_do_not_feel_each_other():
    class Alone(Exact):
        def closure(self, sp, sf, particle):
            return np.full(np.broadcast_shapes(sp.shape, sf.shape), SINGLE)

    closure = EverySphere(Alone())
    assert closure.reach == Alone.smallest_distance
    np.testing.assert_array_equal(closure.free_velocities(np.full(5, 1.2)), [SINGLE] * 6)


def test_spheres_far_apart_are_single():
    found = FAR.free_velocities(np.full(4, 1e4))
    np.testing.assert_allclose(found, SINGLE, rtol=0, atol=1e-12)


@pytest.mark.parametrize("closure", CLOSURES.values())
def test_trains_of_two_and_one(closure):
    """Middle spheres, bit by bit."""
    velocities = triplet(PAPER_NODES, PAPER_NODES)
    closed = closure(velocities)
    pair = chain_motion(closed, np.array([0.4])).velocity
    np.testing.assert_array_equal(pair, [velocities(INF, 1.4)[1], velocities(1.4, INF)[1]])
    assert pair[1] - pair[0] == pytest.approx(relative(1.4), abs=5e-5)  # interpolation
    np.testing.assert_array_equal(chain_motion(closed, np.array([])).velocity, [SINGLE])
    assert Channel(closed, 0.2).motion(np.array([]))[0].size == 0


def symmetric(sp, sf):
    """As at De = 0: the mirror image of a train moves the same way."""
    sp, sf = np.broadcast_arrays(np.asarray(sp, dtype=float), np.asarray(sf, dtype=float))
    near, far = -3e-3 * np.exp(-sp), -3e-3 * np.exp(-sf)
    both = 1e-3 * np.exp(-sp - sf)
    return SINGLE + np.stack([near + both, near + far, far + both], axis=-1)


@pytest.mark.parametrize("closure", CLOSURES.values())
def test_a_train_of_three_is_the_triplet(closure):
    """Where pairs (s, inf) and (inf, s) are one flow; also in lubrication."""
    velocities = triplet(PAPER_NODES, PAPER_NODES, symmetric)
    for s in ([1.6, 2.2], [1.02, 1.4], [5.0, 1.07]):
        found = chain_motion(closure(velocities), np.array(s) - 1).velocity
        np.testing.assert_allclose(found, velocities(*s), rtol=0, atol=SPLINE)


def test_a_train_and_its_mirror_image_at_deborah_0():
    closure = EverySphere(triplet(PAPER_NODES, PAPER_NODES, symmetric))
    s = np.array([1.2, 3.0, 1.02, 2.0, 7.0, 1.5, 1.5, 2.2])
    there, back = (chain_motion(closure, gap).velocity for gap in (s - 1, (s - 1)[::-1]))
    np.testing.assert_allclose(there[::-1], back, rtol=0, atol=1e-14)  # rounding of 1.6
    # a train that is its own mirror image keeps its length
    length = chain_motion(closure, np.concatenate([s, s[::-1]]) - 1).relative.sum()
    assert abs(length) < 1e-14


def test_nearest_neighbours_are_those_of_the_study():
    velocities = triplet(PAPER_NODES, PAPER_NODES)
    s = np.array([1.3, 2.2, 1.7, 6.0])
    expected = [
        velocities(1.3, 2.2)[0],
        velocities(1.3, 2.2)[1],
        velocities(2.2, 1.7)[1],
        velocities(1.7, 6.0)[1],
        velocities(1.7, 6.0)[2],
    ]
    found = chain_motion(Nearest(velocities), s - 1).velocity
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


# ---------------------------------------------------------------------------- direct simulations

KEPT = ROOT / "tests" / "verification" / "equally_spaced"  # of the demo's fluid, d/D = 0.2
SIX = pd.read_csv(KEPT / "six_spheres.csv")  # by `scripts/closure_gap.py`
TRIPLETS = pd.read_csv(KEPT / "triplets.csv")  # by `scripts/dns.py`
LARGEST_ERROR = {  # Ubar, of every_sphere, by gap and De; what three spheres do not know of six
    (1.0, 0.0): 2e-6,
    (1.0, 1.0): 1e-5,
    (1.0, 5.0): 2e-5,
    (2.0, 0.0): 5e-9,
    (2.0, 1.0): 3e-6,
    (2.0, 5.0): 4e-6,
}


def simulated(gap, deborah):
    """Triplets with nodes at all distances of equally spaced spheres, those that matter simulated.

    The others, such as (2s, 2s), count for nothing at the nodes.
    """
    s = 1 + gap
    own = TRIPLETS[TRIPLETS["deborah"] == deborah].set_index(["sp", "sf"])
    found = own[["trailing", "middle", "leading"]]
    single = found.loc[(INF, INF), "middle"]
    nodes = [s, 2 * s, 3 * s, 4 * s, INF]
    U = np.full((5, 5, 3), single)
    for k, sp in enumerate(nodes[:-1]):
        U[k, 0], U[0, k] = found.loc[(sp, s)], found.loc[(s, sp)]
        U[k, -1, :2] = U[-1, k, 1:] = found.loc[(sp, INF), ["trailing", "middle"]]
    return TripletVelocities(nodes, nodes, U)


@pytest.mark.parametrize(("gap", "deborah"), LARGEST_ERROR)
def test_six_spheres_against_direct_simulation(gap, deborah):
    """No interpolation, so what is left is the closure's own error."""
    velocities, gaps = simulated(gap, deborah), np.full(5, gap)
    direct = SIX[(SIX["deborah"] == deborah) & (SIX["gap"] == gap)]["direct"].to_numpy()
    ours, study = (
        np.abs(chain_motion(closure(velocities), gaps).relative - direct).max()
        for closure in (EverySphere, Nearest)
    )
    assert ours < LARGEST_ERROR[gap, deborah]
    assert ours < study / 10
    if deborah > 0:
        assert study > 0.1 * np.abs(direct).max()


def test_memory_drives_neighbours_apart_by_what_their_gap_changes():
    """A pair by hand, and in a train each gap acts on its two spheres only."""
    held = EverySphere(triplet(PAPER_NODES, PAPER_NODES))
    strength = 0.13 * 62 / 0.2
    remembering = closures.WithMemory(held, strength)
    pair = np.array([2.5])
    before, after = (np.diff(each.free_velocities(pair))[0] for each in (held, remembering))
    assert abs(before) > 1e-4
    assert after == pytest.approx(before * (1 + strength * abs(before)), rel=1e-12)
    distance = np.array([1.6, 2.5, 4.0])
    change = remembering.free_velocities(distance) - held.free_velocities(distance)
    r = np.diff(held.free_velocities(distance))
    q = strength / 2 * r * np.abs(r)
    np.testing.assert_allclose(change, [-q[0], q[0] - q[1], q[1] - q[2], q[2]], rtol=0, atol=1e-15)
    even = np.full(60, 3.0)
    middle = slice(25, 35)
    alike = [each.free_velocities(even)[middle] for each in (held, remembering)]
    np.testing.assert_allclose(alike[1], alike[0], rtol=0, atol=1e-9)
    assert type(closures.make_closure("nearest", triplet())) is Nearest
    assert isinstance(closures.make_closure("nearest", triplet(), 1.0), closures.WithMemory)
