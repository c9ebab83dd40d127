"""The modified Newton iteration on scalar equations with known solutions."""

import math

import ngsolve
import numpy as np
import pytest
from harness import study
from netgen.geom2d import unit_square

from viscotrain.config import stages
from viscotrain.flow import fronts, newton
from viscotrain.flow.discretisation import copy
from viscotrain.flow.newton import ModifiedNewton
from viscotrain.studies.dns import make_flow, triplet

HIGH = 8  # order with much patience


def numbers(order, maxh):
    """One number on each element, and functions of an order that are not free."""
    mesh = ngsolve.Mesh(unit_square.GenerateMesh(maxh=maxh))
    return ngsolve.FESpace([ngsolve.L2(mesh, order=0), ngsolve.L2(mesh, order=order)])


@pytest.fixture(scope="module")
def space():
    return numbers(HIGH, maxh=2.0)


def begun(space, residual, start):
    """Iteration for residual(u) = 0 on each element, its first guess, and its form."""
    (u, _), (v, _) = space.TnT()
    form = ngsolve.BilinearForm(space)
    form += residual(u) * v * ngsolve.dx
    state, free = ngsolve.GridFunction(space), ngsolve.BitArray(space.ndof)
    free.Clear()
    for n in range(space.mesh.ne):
        free[n], state.vec[n] = True, start
    return ModifiedNewton(form, free), state, form


def solve(space, residual, start, max_iterations=40, tolerance=1e-12, **options):
    """Solve residual(u) = 0 on each element; result, iteration and solution."""
    iteration, state, _ = begun(space, residual, start)
    result = iteration.solve(state, tolerance=tolerance, max_iterations=max_iterations, **options)
    return result, iteration, state


def test_one_factorisation_where_it_contracts(space):
    result, iteration, state = solve(space, lambda u: u + 0.01 * u**3 - 1, 1.0)
    assert result.converged and result.factorisations == 1
    u = state.vec[0]
    assert u + 0.01 * u**3 == pytest.approx(1.0, abs=1e-12)
    state.vec[:] = u + 1e-3
    again = iteration.solve(state, tolerance=1e-12, max_iterations=40)
    assert again.converged and again.factorisations == 0


def test_updates_that_are_too_long_are_shortened(space):
    """Whole Newton steps for atan(u) = 0 diverge from |u| > 1.39."""
    result, _, state = solve(space, ngsolve.atan, 10.0)
    assert result.converged
    assert state.vec[0] == pytest.approx(0.0, abs=1e-12)
    assert result.updates[1] > result.updates[0]  # the first one was


def test_what_is_watched_must_converge_too(space):
    """An update that is small in the mean but not in what counts is not the last."""
    result, _, state = solve(space, lambda u: u + 0.3 * u**3 - 1, 1.0, tolerance=1e-3)
    watched, _, closer = solve(
        space,
        lambda u: u + 0.3 * u**3 - 1,
        1.0,
        tolerance=1e-3,
        watch=lambda update: [1e6 * update[0]],
        watch_tolerance=1e-3,
    )
    assert result.converged and watched.converged
    assert result.updates[-1] > 1e-9 > watched.updates[-1]
    assert watched.iterations > result.iterations
    assert abs(closer.vec[0] + 0.3 * closer.vec[0] ** 3 - 1) < 1e-9
    assert abs(state.vec[0] + 0.3 * state.vec[0] ** 3 - 1) > 1e-9


def test_without_a_solution_it_gives_up(space):
    result, _, _ = solve(space, lambda u: u**2 + 1, 3.0)
    assert not result.converged
    assert result.reason.split(":")[0] in ("stuck", "stalled", "diverged")
    assert result.iterations < 40


def test_what_is_not_finite_is_no_solution(space):
    result, _, _ = solve(space, lambda u: u * math.nan, 1.0)
    assert not result.converged


def test_too_few_iterations(space):
    result, _, _ = solve(space, ngsolve.atan, 10.0, max_iterations=3)
    assert result.reason.startswith("no convergence to 1.0e-12")


# ----------------------------------------------------------------------------- matrix that is kept


@pytest.mark.parametrize(
    ("sizes", "slow"),
    [
        ([1e3, 1.0, 3.9], False),  # within the growth allowed, and the mean is quick
        ([1e3, 1.0, 4.1], True),
        ([1e3, 1.0, 0.1, 0.3], False),  # one that grows in between does not count
        ([1e3, 1.0, 0.1, 0.3, 0.01], False),
        ([1.0, 0.1], False),
        ([1.0, 0.4], True),
        ([1.0, 0.5, 0.25, 0.125, 0.1], True),
        ([1.0, math.nan], True),
    ],
)
def test_a_matrix_is_slow_by_growth_or_mean_rate(sizes, slow):
    """To 1e-6 in 14 more updates: from 1 each must be a third of the last."""
    assert newton._is_slow(sizes, 1e-6, 14) == slow


def test_the_mean_rate_is_of_the_last_updates_only():
    """A thousandth at first is forgotten after `WINDOW` updates without a change."""
    standing = [1.0] + newton.WINDOW * [1e-3]
    assert not newton._is_slow(standing, 1e-4, 10)
    assert newton._is_slow([*standing, 1e-3], 1e-4, 10)


def test_patience_is_the_number_of_updates_that_are_left():
    """A quarter each: ten more updates from 4^-3 to 4^-13."""
    sizes = [4.0**-n for n in range(4)]
    assert not newton._is_slow(sizes, 4.0**-13, 10.01)
    assert newton._is_slow(sizes, 4.0**-13, 9.99)


def test_patience_grows_with_the_order():
    """A matrix of high order costs more; one of low order is made anew rather than kept."""
    found = [
        solve(numbers(order, maxh=0.4), uneven, 1.0, tolerance=1e-12)[0] for order in (2, HIGH)
    ]
    low, high = found
    assert low.converged and high.converged
    assert low.factorisations > high.factorisations == 1
    assert low.iterations < high.iterations


def uneven(u):
    """Another equation in each element; one Newton step is not enough in any."""
    k = 1 + 3 * ngsolve.x + ngsolve.y
    return u + 0.3 * k * u**3 - k


# -------------------------------------------------------------------------------- way back


def vector_of(*entries):
    vector = ngsolve.BaseVector(len(entries))
    vector.FV().NumPy()[:] = entries
    return vector


def test_a_new_matrix_is_made_at_the_best_state():
    mixing, applied = newton._Mixing(), vector_of(0.0, 0.0)
    state, visited = vector_of(4.0, 1.0), []
    for update in ((1.0, 1.0), (0.2, -0.1), (3.0, 0.5)):
        visited.append(state.FV().NumPy().copy())
        mixing.apply(state, vector_of(*update), applied)
    mixing.go_back(state)
    assert np.array_equal(state.FV().NumPy(), visited[1])


def test_where_updates_grow_the_next_matrix_is_made_at_the_best_state(space, monkeypatch):
    """Where it is flat updates are too long, and combined ones, too, land where it is steep."""
    backs = []

    def noted(mixing, state):
        sizes = [np.linalg.norm(update) for update in mixing._updates]
        go_back(mixing, state)
        backs.append((state[0], mixing._states[int(np.argmin(sizes))][0]))

    go_back = newton._Mixing.go_back
    monkeypatch.setattr(newton._Mixing, "go_back", noted)
    result, _, state = solve(space, lambda u: ngsolve.exp(20 * u) - 1 + u, -0.3)
    assert result.converged and state.vec[0] == pytest.approx(0.0, abs=1e-12)
    assert backs and all(there == best for there, best in backs)


# -------------------------------------------------------------------------------- going on


def nearly_linear(u):
    return u + 0.01 * u**3 - 1 - ngsolve.x


def values(vector):
    return vector.FV().NumPy().copy()


@pytest.mark.parametrize("onwards", [True, False])
def test_updates_before_are_combined_with_if_nothing_has_changed(onwards):
    """Two solves take no more than one; from scratch the second makes another matrix here."""
    space = numbers(HIGH, maxh=0.4)
    whole, expected, _ = begun(space, uneven, 0.7)
    alone = whole.solve(expected, tolerance=1e-12, max_iterations=40)
    iteration, state, _ = begun(space, uneven, 0.7)
    first = iteration.solve(state, tolerance=1e-3, max_iterations=40)
    second = iteration.solve(state, tolerance=1e-12, max_iterations=40, onwards=onwards)
    assert first.converged and second.converged
    assert second.factorisations == (0 if onwards else 1)
    if onwards:
        assert first.iterations + second.iterations <= alone.iterations + 1
    np.testing.assert_allclose(values(state.vec), values(expected.vec), rtol=0, atol=1e-12)


# -------------------------------------------------------------------------------- looking


def test_looking_tells_the_residual_where_it_begins():
    iteration, state, form = begun(numbers(HIGH, maxh=0.4), uneven, 0.7)
    expected = state.vec.CreateVector()
    form.Apply(state.vec, expected)
    ngsolve.Projector(iteration._free, True).Project(expected)
    residual, change = iteration.look(state, 3)
    assert np.array_equal(values(residual), values(expected))
    assert np.linalg.norm(values(residual)) > 0.1 and np.linalg.norm(values(change)) > 0.1


def test_what_is_seen_is_what_the_solution_changes(monkeypatch):
    """To first order with one update, with its sign; to the end with a few, since combined."""
    monkeypatch.setattr(newton, "SEEN_ENOUGH", 0.0)
    space, found = numbers(HIGH, maxh=0.4), []
    for count in (1, 2, 4):
        iteration, state, _ = begun(space, nearly_linear, 0.5)
        start = values(state.vec)
        found.append(values(iteration.look(state, count)[1]))
    assert iteration.solve(state, tolerance=1e-14, max_iterations=20).converged
    exact = values(state.vec) - start
    errors = [np.abs(change - exact).max() / np.abs(exact).max() for change in found]
    assert 1e-4 < errors[0] < 0.05
    assert errors[1] < errors[0] / 10
    assert errors[2] < errors[1] / 100


def test_a_look_ends_with_an_update_that_is_small(monkeypatch):
    """All that could follow is smaller still."""
    found = []
    for enough in (0.0, newton.SEEN_ENOUGH):
        monkeypatch.setattr(newton, "SEEN_ENOUGH", enough)
        iteration, state, _ = begun(numbers(HIGH, maxh=0.4), nearly_linear, 0.5)
        found.append(values(iteration.look(state, 4)[1]))
        updates = len(iteration._sizes)
        assert updates == 4 if enough == 0 else 1 < updates < 4
    assert found[1] == pytest.approx(found[0], rel=newton.SEEN_ENOUGH)


def test_one_update_is_that_of_newton():
    iteration, state, _ = begun(numbers(HIGH, maxh=2.0), lambda u: u**2 - 2, 3.0)
    _, change = iteration.look(state, 1)
    assert change[0] == pytest.approx(-(3.0**2 - 2) / (2 * 3.0), rel=1e-14)


def test_a_solve_goes_on_from_a_look():
    """To the solution, in as many updates as without one, of which those of the look are some."""
    space = numbers(HIGH, maxh=0.4)
    iteration, state, _ = begun(space, nearly_linear, 0.5)
    start = values(state.vec)
    _, change = iteration.look(state, 3)
    assert np.array_equal(values(state.vec), start + values(change))
    result = iteration.solve(state, tolerance=1e-12, max_iterations=40, onwards=True)
    assert result.converged and result.factorisations == 0
    other, expected, _ = begun(space, nearly_linear, 0.5)
    fresh = other.solve(expected, tolerance=1e-12, max_iterations=40)
    assert result.iterations == fresh.iterations - 3
    np.testing.assert_allclose(values(state.vec), values(expected.vec), rtol=0, atol=1e-12)


def test_looking_makes_a_matrix_where_it_looks():
    """Not that of the solve before, which was elsewhere."""
    iteration, state, _ = begun(numbers(HIGH, maxh=2.0), lambda u: u**2 - 2, 3.0)
    assert iteration.solve(state, tolerance=1e-12, max_iterations=40).converged
    state.vec[0] = state.vec[1] = 10.0
    _, change = iteration.look(state, 1)
    assert change[0] == pytest.approx(-98 / 20, rel=1e-14)


def test_where_updates_grow_a_look_goes_back_and_the_next_solve_shortens_them(space):
    """Just as if the matrix had been made by the solve."""
    iteration, state, _ = begun(space, ngsolve.atan, 10.0)
    iteration.look(state, 2)
    assert state.vec[0] == 10.0
    looked = iteration.solve(state, tolerance=1e-12, max_iterations=40, onwards=True)
    result, _, expected = solve(space, ngsolve.atan, 10.0)
    assert looked.converged and looked.updates == result.updates
    assert looked.factorisations == result.factorisations - 1
    assert state.vec[0] == expected.vec[0]


def steep(u):
    """From u = -1.24 the first update is 100 long, and what follows has no bound."""
    return ngsolve.exp(5 * u) - 1


@pytest.mark.parametrize("count", [1, 2, 4])
def test_an_update_that_diverges_is_left_out(space, count):
    start = math.log(0.01 / 5) / 5  # slope 0.01
    iteration, state, _ = begun(space, steep, start)
    residual, change = iteration.look(state, count)
    first = (1 - math.exp(5 * start)) / 0.01
    assert change[0] == pytest.approx(first, rel=1e-9)
    assert state.vec[0] == start
    assert residual[0] < 0


def test_where_the_first_update_diverges_nothing_changes(space):
    iteration, state, _ = begun(space, steep, -2.0)
    residual, change = iteration.look(state, 4)
    assert np.all(values(change) == 0) and np.linalg.norm(values(residual)) > 0
    assert state.vec[0] == -2.0
    assert iteration.solve(state, tolerance=1e-12, max_iterations=40).reason.startswith("diverged")


def test_the_adjoint_solution_is_with_the_transposed_matrix():
    """An unsymmetric form on a product of spaces: (z, K x) = (j, x) for any x."""
    mesh = ngsolve.Mesh(unit_square.GenerateMesh(maxh=0.4))
    space = ngsolve.FESpace([ngsolve.H1(mesh, order=2, dirichlet="left"), ngsolve.L2(mesh)])
    (u, p), (v, q) = space.TnT()
    form = ngsolve.BilinearForm(space)
    form += (ngsolve.grad(u) * ngsolve.grad(v) + 5 * ngsolve.grad(u)[0] * v + p * q) * ngsolve.dx
    form += (u**3 * v + 2 * u * q) * ngsolve.dx
    state = ngsolve.GridFunction(space)
    state.components[0].Set(ngsolve.x)
    iteration = ModifiedNewton(form, space.FreeDofs())
    residual, change = iteration.look(state, 1)
    goal = state.vec.CreateVector()
    goal.FV().NumPy()[:] = np.random.default_rng(2).normal(size=space.ndof)
    by_change = ngsolve.InnerProduct(goal, change)
    by_residual = -ngsolve.InnerProduct(iteration.adjoint(goal), residual)
    assert by_change == pytest.approx(by_residual, rel=1e-10)


# --------------------------------------------------------------------------------- single precision


@pytest.fixture(scope="module")
def flow():
    """A single sphere, Newtonian, as the first guess of a viscoelastic fluid."""
    coarse = {"velocity_order": 3, "sphere_elements": 6, "wall_size": 0.25, "axis_size": 0.15}
    settings = stages.flow(study("config", dns=coarse))
    flow = make_flow(settings, triplet(settings, math.inf, math.inf))
    iteration = ModifiedNewton(flow.newtonian, flow.free_newtonian)
    assert iteration.solve(flow.state, tolerance=1e-9, max_iterations=5).converged
    flow.deborah.Set(0.3)
    return flow


def solved(flow):
    """Whether precision was doubled, the speeds of the solution, and how it was reached."""
    start = copy(flow.state.vec)
    iteration = ModifiedNewton(flow.viscoelastic, flow.free)
    result = iteration.solve(flow.state, tolerance=1e-7, max_iterations=20)
    assert result.converged
    speeds = flow.speeds(flow.state.vec)
    flow.state.vec.data = start
    return iteration._precision is np.float64, speeds, result


def test_factors_of_single_precision_are_good_enough_here(flow):
    """Though the second update is not so small that nothing needs to be checked."""
    doubled, _, result = solved(flow)
    assert not doubled
    assert result.updates[1] > newton.ROUGHEST * result.updates[0]


def test_precision_is_doubled_for_one_iteration_only(flow, monkeypatch):
    """The next one begins with single precision again."""
    with monkeypatch.context() as patch:
        patch.setattr(newton, "ROUGHEST", 0.0)
        assert solved(flow)[0]
    assert not solved(flow)[0]


def test_small_updates_are_not_called_imprecise(flow):
    """Close to a solution the residual's own rounding is no error of the factors."""
    start = copy(flow.state.vec)
    iteration = ModifiedNewton(flow.viscoelastic, flow.free)
    assert iteration.solve(flow.state, tolerance=1e-5, max_iterations=20).converged
    flow.state.vec.data += 1e-8 * start
    assert not solved(flow)[0]
    flow.state.vec.data = start


def with_fault(fault):
    """Inverses of matrices, of which one of single precision is wrong."""
    right = fronts._inverses

    def faulty(matrices):
        found = right(matrices)
        if matrices.dtype == np.float32:
            found[0] *= 4.0 if fault == "wrong" else 1.0  # by 1.5 updates are within `ROUGHEST`
            found[0, 0, 0] = np.nan if fault == "not finite" else found[0, 0, 0]
        return found

    return faulty


@pytest.mark.parametrize("fault", ["wrong", "not finite"])
def test_where_they_are_not_precision_is_doubled(flow, monkeypatch, fault):
    _, expected, _ = solved(flow)
    monkeypatch.setattr(fronts, "_inverses", with_fault(fault))
    doubled, found, _ = solved(flow)
    assert doubled
    assert found == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("fault", ["wrong", "not finite"])
def test_a_look_doubles_precision_where_it_must(flow, monkeypatch, fault):
    """What it tells is with the precise factors, from where it began."""
    found = []
    for faulty in (False, True):
        start, iteration = copy(flow.state.vec), ModifiedNewton(flow.viscoelastic, flow.free)
        if faulty:
            monkeypatch.setattr(fronts, "_inverses", with_fault(fault))
        residual, change = iteration.look(flow.state, 4)
        flow.state.vec.data = start
        found.append((values(residual), flow.speeds(change)))
        assert (iteration._precision is np.float64) is faulty
    (expected, _), (residual, _) = found
    assert np.array_equal(residual, expected)
    assert found[1][1] == pytest.approx(found[0][1], rel=1e-3)
