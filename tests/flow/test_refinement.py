"""Estimates of errors by the adjoint solution, and meshes that follow from them."""

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


def two_orders(study, sp, sf):
    """Solution in the order of the study, and that of the order below, embedded."""
    flow = make_flow(study, triplet(study, sp, sf))
    below = solved(flow.variant(flow.fluid, flow.velocity_order - 1))
    embedded = below.embed(copy(below.state.vec), flow)
    return solved(flow, start=embedded), embedded


@pytest.fixture(scope="module")
def pair():
    return two_orders(STUDY, math.inf, 1.5)


def adjoint_of(flow):
    return newton.ModifiedNewton(flow.viscoelastic, flow.free).adjoint(flow.state)


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


def differences(flow, start):
    """Of each goal, from `start` to the solution: J itself, -z . R(start), the sum of elements."""
    residual, change = (start.CreateVector() for _ in range(2))
    flow.viscoelastic.Apply(start, residual)
    weights = np.where(list(flow.free), residual.FV().NumPy(), 0.0)
    change.data = flow.state.vec - start
    adjoint, elements = adjoint_of(flow), refinement._Elements(flow)
    found = []
    for goal in refinement._goals(flow):
        z = adjoint(goal).FV().NumPy()
        exact = ngsolve.InnerProduct(goal, change)
        found.append((exact, -(z @ weights), -elements.sums(z * weights).sum()))
    return np.array(found).T


def test_adjoint_gives_the_change_of_goals_to_second_order(pair):
    """A wrong sign or a matrix that is not transposed would leave a first-order rest."""
    flow, below = pair
    rests = []
    for share in (0.1, 0.05):
        start = below.CreateVector()
        start.data = (1 - share) * flow.state.vec + share * below
        exact, estimated, _ = differences(flow, start)
        rests.append(np.abs(estimated - exact))
        assert np.all(rests[-1] < 0.02 * np.abs(exact))
    assert np.all(rests[1] < 0.3 * rests[0])


def test_contributions_of_elements_add_up_to_the_difference_of_orders(pair):
    """Below the order, unknowns that belong to no element have no residual."""
    exact, whole, elements = differences(*pair)
    assert elements == pytest.approx(whole, abs=1e-4 * np.abs(whole).max())
    assert elements == pytest.approx(exact, rel=0.3)


def test_error_of_a_coarse_solution_is_within_its_estimate(pair):
    flow, below = pair
    estimate = refinement.estimate(flow, below, adjoint_of(flow))
    finest = solved_in_order(flow, 5)
    assert estimate.contributions.shape == (flow.mesh.ne,)
    assert estimate.decisive == max(estimate.relative)
    error = np.abs(np.subtract(flow.relative_velocities(), finest.relative_velocities()))
    assert np.all(error < estimate.relative)
    assert np.all(np.array(estimate.relative) < 1e3 * error)
    U, exact = (each.sphere_velocities()["middle"] for each in (flow, finest))
    assert abs(U - exact) < estimate.velocity


def solved_in_order(flow, order):
    higher = flow.variant(flow.fluid, order)
    before = copy(flow.state.vec)
    start = flow.embed(before, higher)
    flow.state.vec.data = before
    return solved(higher, start=start)


def test_an_order_ahead_is_what_its_estimate_will_be(pair):
    flow, below = pair
    now = refinement.estimate(flow, below, adjoint_of(flow))
    higher = solved_in_order(flow, 4)
    then = refinement.estimate(higher, flow.embed(copy(flow.state.vec), higher), adjoint_of(higher))
    assert now.ahead(3) == now.decisive
    assert now.ahead(4) < now.decisive
    assert 0.2 < now.ahead(4) / then.decisive < 5


def test_refining_reduces_the_estimate(pair):
    flow, below = pair
    coarse = refinement.estimate(flow, below, adjoint_of(flow))
    sizes, *_ = refinement.refined(flow.mesh, coarse, 3, coarse.decisive / 4, 10_000)
    finer = flow.on(mesh_of(STUDY, flow.geometry, sizes))
    lower = solved(finer.variant(flow.fluid, flow.velocity_order - 1))
    embedded = lower.embed(copy(lower.state.vec), finer)
    solved(finer, start=embedded)
    fine = refinement.estimate(finer, embedded, adjoint_of(finer))
    assert finer.mesh.ne > flow.mesh.ne
    assert fine.decisive < coarse.decisive / 2


def test_distance_from_the_order_below_needs_no_adjoint(pair):
    flow, _ = pair
    higher = solved_in_order(flow, 4)
    found = refinement.compared(higher, flow)
    expected = np.subtract(higher.relative_velocities(), flow.relative_velocities())
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
    elements = refinement._Elements(flow)
    z, r = ngsolve.x, ngsolve.y
    smooth = elements.decay([(1 + z + r,)])
    assert np.median(smooth) == refinement.SMOOTHEST  # more in curved elements
    curved = elements.decay([(1 + z + r + 10 * z * r,)])
    steeper = elements.decay([(1 + z + r + 20 * z * r,)])
    assert steeper.sum() > 1.05 * curved.sum() and steeper.max() <= 1
    rough = elements.decay([(ngsolve.sin(200 * z) * ngsolve.cos(170 * r),)])
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
    flow, _ = pair
    contributions = np.ones(flow.mesh.ne)
    contributions[:10] = 1e4
    _, own = refinement._centres_and_sizes(flow.mesh)
    error = estimate_of(contributions, 3.0)
    found, elements, left = refinement.refined(flow.mesh, error, 3, 1 / 4, 10_000)
    change = refinement.MESHED * found.sizes / own
    assert change[:10].max() < change[10:].min()
    assert change.min() >= refinement.FINEST and change.max() <= 1.001 * refinement.COARSEST
    assert left == pytest.approx(1 / 4, rel=1e-3)
    assert elements == pytest.approx((change**-2).sum(), rel=1e-3)


def test_sizes_stop_at_the_number_of_elements_allowed(pair):
    flow, _ = pair
    contributions = np.linspace(1.0, 2.0, flow.mesh.ne)
    _, own = refinement._centres_and_sizes(flow.mesh)
    most = 1.5 * flow.mesh.ne
    sizes, elements, _ = refinement.refined(
        flow.mesh, estimate_of(contributions, 2.0), 3, 1e-6, most
    )
    change = refinement.MESHED * sizes.sizes / own
    assert (change**-2).sum() == pytest.approx(most, rel=0.05)
    assert elements == pytest.approx(most, rel=0.05)


def test_the_error_of_equal_elements_falls_with_their_size(pair):
    """Halving all sizes: four times the elements, each with 2^-(2 + q) of the contribution."""
    flow, _ = pair
    equal = np.ones(flow.mesh.ne)
    _, elements, left = refinement.refined(
        flow.mesh, estimate_of(equal, 2.0), 3, 1e-9, 4 * equal.size
    )
    assert elements == pytest.approx(4 * equal.size, rel=0.02)
    assert left == pytest.approx(refinement.RESERVE * 2**-3.0, rel=0.02)


# ----------------------------------------------------------------------------------------- plans


def plan(flow, allowed, contributions=None, **limits):
    if contributions is None:
        contributions = np.ones(flow.mesh.ne)
    most = refinement.Limits(**({"order": 7, "unknowns": 1e6} | limits))
    return refinement.plan(flow, estimate_of(contributions, 1.0), allowed, most)


def test_the_order_is_raised_where_that_is_enough(pair):
    flow, _ = pair
    assert plan(flow, 0.15) == (4, None)
    assert plan(flow, 0.015) == (5, None)


def test_a_mesh_is_refined_where_few_elements_have_the_error(pair):
    flow, _ = pair
    few = np.full(flow.mesh.ne, 1e-6)
    few[:2] = 1.0
    order, sizes = plan(flow, 0.5, few)
    assert order == 3 and sizes is not None


def test_no_plan_is_beyond_the_limits(pair):
    flow, _ = pair
    assert plan(flow, 1e-3, order=4)[0] <= 4
    assert plan(flow, 1e-3, unknowns=10) is None


def test_a_plan_does_not_hang_on_the_last_digits(pair):
    flow, below = pair
    found = refinement.estimate(flow, below, adjoint_of(flow))
    limits = refinement.Limits(7, 1e6)
    for share in (0.4, 0.12):
        plans = []
        for n in range(12):
            relative = tuple(error * (1 + 1e-9 * n) for error in found.relative)
            error = replace(found, relative=relative)
            plans.append(refinement.plan(flow, error, share * found.decisive, limits))
        assert len({(order, sizes is None) for order, sizes in plans}) == 1


def test_unknowns_of_an_element_are_about_those_of_a_flow(pair):
    flow, _ = pair
    about = refinement.unknowns_per_element(3, len(flow.fluid.modes)) * flow.mesh.ne
    assert about == pytest.approx(flow.space.ndof, rel=0.15)


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
