"""The modified Newton iteration on scalar equations with known solutions."""

import math

import ngsolve
import pytest
from netgen.geom2d import unit_square

from viscotrain.flow.newton import ModifiedNewton


@pytest.fixture(scope="module")
def space():
    return ngsolve.L2(ngsolve.Mesh(unit_square.GenerateMesh(maxh=2.0)), order=0)


def solve(space, residual, start, max_iterations=40, tolerance=1e-12, **options):
    """Solve residual(u) = 0 on each of two elements; result, iteration and solution."""
    u, v = space.TnT()
    form = ngsolve.BilinearForm(space)
    form += residual(u) * v * ngsolve.dx
    state = ngsolve.GridFunction(space)
    state.vec[:] = start
    iteration = ModifiedNewton(form, space.FreeDofs())
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
