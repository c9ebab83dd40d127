"""Estimates of errors by the order above, and meshes that follow from them."""

import math
from dataclasses import replace

import ngsolve
import numpy as np
import pytest
from harness import study

from viscotrain.config import stages
from viscotrain.flow import newton, quasi_steady, refinement
from viscotrain.flow.discretisation import copy
from viscotrain.flow.meshes import Sizes
from viscotrain.studies.dns import make_flow, mesh_of, triplet

COARSE = {"velocity_order": 3, "sphere_elements": 6, "wall_size": 0.25, "axis_size": 0.15}
STUDY = stages.flow(study("config", dns=COARSE))
DEBORAH = 1.0


def solved(flow, start=None):
    """The flow with its solution, from a vector of its unknowns or in steps from rest."""
    if start is None:
        iteration = newton.ModifiedNewton(flow.newtonian, flow.free_newtonian)
        assert iteration.solve(flow.state, tolerance=1e-9, max_iterations=5).converged
    else:
        flow.state.vec.data = start
    for De in (DEBORAH / 4, DEBORAH) if start is None else (DEBORAH,):
        flow.deborah.Set(De)
        iteration = newton.ModifiedNewton(flow.viscoelastic, flow.free)
        assert iteration.solve(flow.state, tolerance=1e-10, max_iterations=40).converged
    return flow


def raised(flow, orders=1):
    """The flow in a higher order, its state the same."""
    above = flow.variant(flow.fluid, flow.velocity_order + orders)
    flow.embed(copy(flow.state.vec), above)
    above.deborah.Set(flow.deborah.Get())
    return above


def begun(above, precision=np.float32):
    """An iteration of this flow."""
    iteration = newton.ModifiedNewton(above.viscoelastic, above.free)
    iteration._precision = precision
    return iteration


def estimated(flow):
    above = raised(flow)
    return refinement.estimate(flow, above, begun(above))


def solved_above(flow, orders):
    above = raised(flow, orders)
    return solved(above, start=copy(above.state.vec))


def of_goals(flow, vector):
    return np.array([ngsolve.InnerProduct(goal, vector) for goal in refinement._goals(flow)])


def goals(flow):
    """Velocity of the reference sphere and relative velocities of neighbours."""
    return of_goals(flow, flow.state.vec)


@pytest.fixture(scope="module")
def pair():
    return solved(make_flow(STUDY, triplet(STUDY, math.inf, 1.5)))


@pytest.fixture(scope="module")
def single():
    return solved(make_flow(STUDY, triplet(STUDY, math.inf, math.inf)))


@pytest.fixture(scope="module")
def three():
    """What elements contribute to one of its relative velocities cancels to a tenth."""
    return solved(make_flow(STUDY, triplet(STUDY, 1.5, 2.5)))


@pytest.fixture(params=["pair", "single", "three"])
def coarse(request):
    return request.getfixturevalue(request.param)


# ---------------------------------------------------------------------------------------- goals


def test_goals_are_velocity_and_relative_velocities():
    flow = make_flow(STUDY, triplet(STUDY, 1.5, 2.5))
    values = np.random.default_rng(1).normal(size=flow.space.ndof)
    flow.state.vec.FV().NumPy()[:] = values
    U, *relative = (ngsolve.InnerProduct(goal, flow.state.vec) for goal in refinement._goals(flow))
    assert pytest.approx(flow.sphere_velocities()["middle"]) == U
    assert pytest.approx(flow.relative_velocities()) == relative


def test_a_single_sphere_has_its_velocity_as_goal():
    flow = make_flow(STUDY, triplet(STUDY, math.inf, math.inf))
    (goal,) = refinement._goals(flow)
    flow.state.vec[flow.unknown_of("wall")] = -1.7
    assert ngsolve.InnerProduct(goal, flow.state.vec) == pytest.approx(1.7)


# ------------------------------------------------------------------------------------- estimate


def values(vector):
    return vector.FV().NumPy().copy()


def test_an_estimate_leaves_the_solution_and_begins_the_order_above(pair):
    above = raised(pair)
    before, embedded, iteration = values(pair.state.vec), goals(above), begun(above)
    refinement.estimate(pair, above, iteration)
    assert np.array_equal(values(pair.state.vec), before)
    solution = goals(solved_above(pair, 1))
    assert np.abs(goals(above) - solution).max() < 0.1 * np.abs(embedded - solution).max()
    end = iteration.solve(above.state, tolerance=1e-11, max_iterations=30, onwards=True)
    assert end.converged and end.factorisations == 0
    assert goals(above) == pytest.approx(solution, abs=1e-10)


def by_elements(above, precision=np.float32):
    """Of each goal: change by the first update; -z . R of all unknowns, and of the elements'."""
    iteration, elements = begun(above, precision), refinement._Elements(above)
    residual, change = iteration.look(above.state, 1)
    R, found = values(residual), []
    for goal in refinement._goals(above):
        z = values(iteration.adjoint(goal))
        found.append((ngsolve.InnerProduct(goal, change), -(z @ R), -elements.sums(z * R).sum()))
    return np.array(found).T


def test_elements_add_up_to_what_the_first_update_changes(coarse):
    """To single precision; the signs are those of the change."""
    change, whole, elements = by_elements(raised(coarse))
    largest = np.abs(change).max()
    assert np.all(np.abs(change) > 0.05 * largest)
    assert whole == pytest.approx(change, abs=5e-4 * largest)
    assert elements == pytest.approx(change, abs=5e-4 * largest)


def test_elements_add_up_to_round_off_in_double_precision(coarse):
    """Unknowns of no element have no residual in the order below, but for its quadrature."""
    above = raised(coarse)
    change, whole, elements = by_elements(above, np.float64)
    assert whole == pytest.approx(change, rel=1e-8)
    assert elements == pytest.approx(change, abs=5e-4 * np.abs(change).max())


def test_adjoint_gives_the_change_of_goals_to_second_order(pair):
    """A wrong sign or a matrix that is not transposed would leave a first-order rest."""
    above, solution = raised(pair), solved_above(pair, 1)
    below, rests = copy(above.state.vec), []
    for share in (0.1, 0.05):
        above.state.vec.data = (1 - share) * solution.state.vec + share * below
        exact = goals(solution) - goals(above)
        _, estimated, _ = by_elements(above)
        rests.append(np.abs(estimated - exact))
        assert np.all(rests[-1] < 0.02 * np.abs(exact))
    assert np.all(rests[1] < 0.3 * rests[0])


def test_what_the_updates_change_is_what_the_order_adds(coarse):
    """The distance to the solution of the order above, solved to its end: with its sign."""
    above = raised(coarse)
    _, change = begun(above).look(above.state, refinement.UPDATES)
    exact = goals(solved_above(coarse, 1)) - goals(coarse)
    assert of_goals(above, change) == pytest.approx(exact, rel=0.1)
    assert np.all(np.abs(exact) > 1e-7)


def test_error_of_a_coarse_solution_is_within_its_estimate(coarse):
    """And not far below it: neither part of an estimate is lost, nor counted many times."""
    found = estimated(coarse)
    error = np.abs(goals(solved_above(coarse, 2)) - goals(coarse))
    estimates = np.array([found.velocity, *found.relative])
    assert np.all(error < estimates)
    assert np.all(estimates < 20 * error)
    assert found.order == coarse.velocity_order
    assert found.contributions.shape == found.rates.shape == (coarse.mesh.ne,)


def test_an_estimate_has_what_is_seen_and_what_is_not(coarse):
    """The elements are those of the space above; each has what it contributes most."""
    found, above = estimated(coarse), raised(coarse)
    iteration, elements = begun(above), refinement._Elements(above)
    residual, change = iteration.look(above.state, refinement.UPDATES)
    shares = [
        np.abs(elements.sums(values(iteration.adjoint(goal)) * values(residual)))
        for goal in refinement._goals(above)
    ]
    unseen = np.sqrt(np.sum(np.square(shares), axis=1))
    expected = refinement.SEEN * np.abs(of_goals(above, change)) + refinement.UNSEEN * unseen
    assert [found.velocity, *found.relative] == pytest.approx(expected, rel=1e-6)
    counts = np.array([0.5 if len(shares) == 3 else 1.0] + [1.0] * len(found.relative))
    assert found.decisive == pytest.approx((counts * expected).max(), rel=1e-6)
    largest = (counts[:, None] * shares).max(axis=0)
    assert found.contributions == pytest.approx(largest, rel=1e-6, abs=1e-12)
    if len(shares) > 1:  # no goal alone has them all
        assert min(np.sum(largest > 1.01 * each) for each in counts[:, None] * shares) > 0


@pytest.mark.parametrize(
    "relative, expected", [((), 8.0), ((2.0,), 8.0), ((9.0,), 9.0), ((2.0, 1.0), 4.0)]
)
def test_an_error_of_u_counts_by_half_in_triplets(relative, expected):
    """And fully in pairs: relative velocities of triplets are interpolated from it."""
    none = np.array([])
    error = refinement.Estimate(3, 8.0, relative, none, none, gain=0.1)
    assert error.decisive == expected


def test_an_order_ahead_is_what_its_estimate_will_be(pair):
    now, then = estimated(pair), estimated(solved_above(pair, 1))
    assert (now.order, then.order) == (3, 4)
    assert now.ahead(3) == now.decisive
    assert now.ahead(4) < now.decisive
    assert 0.2 < now.ahead(4) / then.decisive < 5


def test_refining_reduces_the_estimate(pair):
    coarse = estimated(pair)
    sizes, *_ = refinement.refined(pair.mesh, coarse, 3, coarse.decisive / 4, 10_000)
    finer = solved(pair.on(mesh_of(STUDY, pair.geometry, sizes)))
    assert finer.mesh.ne > pair.mesh.ne
    assert estimated(finer).decisive < coarse.decisive / 2


def test_distance_from_the_order_below_needs_no_adjoint(pair):
    higher = solved_above(pair, 1)
    found = refinement.compared(higher, pair)
    expected = np.subtract(higher.relative_velocities(), pair.relative_velocities())
    assert found.relative == pytest.approx(np.abs(expected))
    assert found.contributions.size == 0


# ---------------------------------------------------------------------------------------- decay


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_decay_of_a_known_polynomial(degree):
    """Coefficients of an orthonormal polynomial are its own; norms are those of L2."""
    rule = ngsolve.IntegrationRule(ngsolve.TRIG, 2 * degree)
    transform, degrees = refinement._orthonormal(rule, degree)
    x, y = np.array([point[:2] for point in rule.points]).T
    lower, highest = x + 2 * y, (x - 0.3) ** degree + 4 * x * y ** (degree - 1)
    coefficients = transform @ highest
    assert np.sum(coefficients**2) == pytest.approx(rule.weights @ highest**2)
    assert np.sum((transform @ np.ones_like(x)) ** 2) == pytest.approx(0.5)
    assert np.abs((transform @ np.ones_like(x))[degrees > 0]).max() < 1e-12
    assert np.abs((transform @ lower)[degrees > 1]).max(initial=0.0) < 1e-12
    assert np.linalg.norm(coefficients[degrees == degree]) > 1e-3
    gram = transform @ np.diag(1 / np.array(rule.weights)) @ transform.T
    np.testing.assert_allclose(gram, np.eye(len(degrees)), atol=1e-12)


def test_decay_is_that_of_the_conformation():
    """The highest degree over the one below; at most one, and not below noise."""
    flow = make_flow(STUDY, triplet(STUDY, math.inf, math.inf))
    decays = refinement._Decays(flow)
    z, r = ngsolve.x, ngsolve.y
    smooth = decays.of([(1 + z + r,)])
    assert np.median(smooth) == refinement.SMOOTHEST  # more in curved elements
    curved = decays.of([(1 + z + r + 10 * z * r,)])
    steeper = decays.of([(1 + z + r + 20 * z * r,)])
    assert steeper.sum() > 1.05 * curved.sum() and steeper.max() <= 1
    rough = decays.of([(ngsolve.sin(200 * z) * ngsolve.cos(170 * r),)])
    assert np.median(rough) > 0.5


# ---------------------------------------------------------------------------------------- sizes


def test_meshes_follow_the_sizes_asked_for():
    geometry = triplet(STUDY, math.inf, math.inf)
    z = geometry.positions[0]
    coarse = mesh_of(STUDY, geometry)
    centres, own = refinement._centres_and_sizes(coarse)
    wanted = np.where(np.abs(centres[:, 0] - z) < 0.4, own / 3, own)
    centres, found = refinement._centres_and_sizes(mesh_of(STUDY, geometry, Sizes(centres, wanted)))
    near = np.abs(centres[:, 0] - z) < 0.3
    beyond = np.abs(centres[:, 0] - z) > 1.0
    assert np.median(found[near]) < 0.6 * np.median(own)
    assert np.median(found[beyond]) > 0.7 * np.median(own)


def estimate_of(contributions, rate):
    """An error in order 3 with these contributions, of which one more order leaves a tenth."""
    rates = np.full(contributions.size, rate)
    return refinement.Estimate(3, 0.0, (1.0,), contributions, rates, gain=0.1)


def test_elements_that_contribute_more_become_smaller(pair):
    contributions = np.ones(pair.mesh.ne)
    contributions[:10] = 1e4
    _, own = refinement._centres_and_sizes(pair.mesh)
    error = estimate_of(contributions, 3.0)
    found, elements, left = refinement.refined(pair.mesh, error, 3, 1 / 4, 10_000)
    change = refinement.MESHED * found.sizes / own
    assert change[:10].max() < change[10:].min()
    assert change.min() >= refinement.FINEST and change.max() <= 1.001 * refinement.COARSEST
    assert left == pytest.approx(1 / 4, rel=1e-3)
    assert elements == pytest.approx((change**-2).sum(), rel=1e-3)


def test_sizes_stop_at_the_number_of_elements_allowed(pair):
    contributions = np.linspace(1.0, 2.0, pair.mesh.ne)
    _, own = refinement._centres_and_sizes(pair.mesh)
    most = 1.5 * pair.mesh.ne
    sizes, elements, _ = refinement.refined(
        pair.mesh, estimate_of(contributions, 2.0), 3, 1e-6, most
    )
    change = refinement.MESHED * sizes.sizes / own
    assert (change**-2).sum() == pytest.approx(most, rel=0.05)
    assert elements == pytest.approx(most, rel=0.05)


def test_the_error_of_equal_elements_falls_with_their_size(pair):
    """Halving all sizes: four times the elements, each with 2^-(2 + q) of the contribution."""
    equal = np.ones(pair.mesh.ne)
    _, elements, left = refinement.refined(
        pair.mesh, estimate_of(equal, 2.0), 3, 1e-9, 4 * equal.size
    )
    assert elements == pytest.approx(4 * equal.size, rel=0.02)
    assert left == pytest.approx(refinement.RESERVE * 2**-3.0, rel=0.02)


# ---------------------------------------------------------------------------------------- promises


def slow(error, gain):
    return replace(error, gain=gain)


def test_a_promise_is_the_root_of_what_the_next_order_gains(pair):
    error = slow(estimated(pair), 0.64)
    found = refinement.promised(error, refinement.Limits(error.order + 1, 1e9))
    assert found.order == error.order + 1
    assert found.decisive == pytest.approx(0.8 * error.decisive)
    assert found.velocity == pytest.approx(0.8 * error.velocity)
    assert found.relative == pytest.approx(tuple(0.8 * each for each in error.relative))
    np.testing.assert_allclose(found.contributions, 0.8 * error.contributions)


def test_nothing_is_promised_that_cannot_be_told(pair):
    error = slow(estimated(pair), 0.64)
    limits = refinement.Limits(error.order + 1, 1e9)
    assert refinement.promised(slow(error, 0.99 * refinement.SLOW_GAIN), limits) is None
    assert refinement.promised(error, limits._replace(order=error.order)) is None
    assert refinement.promised(None, limits) is None
    assert refinement.promised(refinement.compared(pair, pair), limits) is None


def climbed(monkeypatch, slow_gain, accuracy):
    """A pair at De = 5 in order 3 or 4 on one mesh, and the estimates on the way."""
    looks, estimate = [], refinement.estimate

    def counted(*given):
        looks.append(estimate(*given))
        return looks[-1]

    flow = make_flow(STUDY, triplet(STUDY, math.inf, 1.5))
    options = quasi_steady.SolverOptions(
        1e-9, 40, 3.0, accuracy=accuracy, max_velocity_order=4, max_unknowns=1e9
    )
    with monkeypatch.context() as patch:
        patch.setattr(refinement, "SLOW_GAIN", slow_gain)
        patch.setattr(refinement, "estimate", counted)
        (solution,) = quasi_steady.solve(flow, [5.0], options)
    return solution, looks


@pytest.mark.parametrize("share", [1.1, 0.6, 0.1])
def test_a_climb_ends_with_the_order_that_was_looked_at(monkeypatch, share):
    """The same solution as with a look at the order above, which is not made.

    Whether the order below is accurate itself, only this one, or none within the limits.
    """
    _, (first, *_) = climbed(monkeypatch, math.inf, 1.0)
    looked, _ = climbed(monkeypatch, math.inf, 0.1 * first.decisive)
    solution, looks = climbed(monkeypatch, 0.0, share * first.decisive)
    promised = math.sqrt(first.gain)
    assert len(looks) == 1 + (share < promised)
    assert solution.accurate == (share > promised)
    assert solution.flow.velocity_order == looked.flow.velocity_order == 4
    for name, U in looked.velocities.items():
        assert solution.velocities[name] == pytest.approx(U, abs=1e-8)
    if solution.accurate:
        assert solution.error.order == 4
        assert solution.estimated_error == pytest.approx(promised * first.decisive, rel=1e-3)


# ----------------------------------------------------------------------------------------- plans


def plan(flow, allowed, contributions=None, **limits):
    if contributions is None:
        contributions = np.ones(flow.mesh.ne)
    most = refinement.Limits(**({"order": 7, "unknowns": 1e6} | limits))
    return refinement.plan(flow, estimate_of(contributions, 1.0), allowed, most)


def test_the_order_is_raised_where_that_is_enough(pair):
    assert plan(pair, 0.15) == (4, None)
    assert plan(pair, 0.015) == (5, None)


def test_a_mesh_is_refined_where_few_elements_have_the_error(pair):
    few = np.full(pair.mesh.ne, 1e-6)
    few[:2] = 1.0
    order, sizes = plan(pair, 0.5, few)
    assert order == 3 and sizes is not None


def test_no_plan_is_beyond_the_limits(pair):
    assert plan(pair, 1e-3, order=4)[0] <= 4
    assert plan(pair, 1e-3, unknowns=10) is None


def test_a_plan_does_not_hang_on_the_last_digits(pair):
    found = estimated(pair)
    limits = refinement.Limits(7, 1e6)
    for share in (0.4, 0.12):
        plans = []
        for n in range(12):
            relative = tuple(error * (1 + 1e-9 * n) for error in found.relative)
            error = replace(found, relative=relative)
            plans.append(refinement.plan(pair, error, share * found.decisive, limits))
        assert len({(order, sizes is None) for order, sizes in plans}) == 1


def test_unknowns_of_an_element_are_about_those_of_a_flow(pair):
    about = refinement.unknowns_per_element(3, len(pair.fluid.modes)) * pair.mesh.ne
    assert about == pytest.approx(pair.space.ndof, rel=0.15)


def test_the_ladder_without_a_mesher_keeps_the_mesh():
    flow = make_flow(STUDY, triplet(STUDY, math.inf, 1.5))
    options = quasi_steady.SolverOptions(1e-7, 40, 3.0, accuracy=1e-12)
    (solution,) = quasi_steady.solve(flow, [DEBORAH], options)
    assert solution.flow.mesh is flow.mesh
    assert solution.solved and not solution.accurate
    raising = replace(
        options, accuracy=0.9 * solution.estimated_error, max_velocity_order=5, max_unknowns=1e6
    )
    (solution,) = quasi_steady.solve(flow, [DEBORAH], raising)
    assert solution.accurate and solution.flow.velocity_order > flow.velocity_order
