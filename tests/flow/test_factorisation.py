"""LU factors against the equations that they solve."""

import ngsolve
import numpy as np
import pytest
from netgen.geom2d import unit_square

from viscotrain.flow import factorisation, newton
from viscotrain.flow.factorisation import FactorisationError


@pytest.fixture
def form():
    """An unsymmetric problem."""
    mesh = ngsolve.Mesh(unit_square.GenerateMesh(maxh=0.3))
    space = ngsolve.H1(mesh, order=3, dirichlet="left")
    u, v = space.TnT()
    form = ngsolve.BilinearForm(space)
    form += (ngsolve.grad(u) * ngsolve.grad(v) + 5 * ngsolve.grad(u)[0] * v) * ngsolve.dx
    return form.Assemble()


@pytest.mark.parametrize("transposed", [False, True])
def test_solution_satisfies_its_system(form, transposed):
    free = form.space.FreeDofs()
    right, solution, rest = (form.mat.CreateColVector() for _ in range(3))
    right.FV().NumPy()[:] = np.random.default_rng(1).standard_normal(len(right))
    factors = factorisation.factorise(form, free)
    (factors.solve_transposed if transposed else factors.solve)(right, solution)
    matrix = form.mat.CreateTranspose() if transposed else form.mat
    rest.data = matrix * solution - right
    mask = np.fromiter(free, bool, len(free))
    assert np.abs(rest.FV().NumPy()[mask]).max() < 1e-11
    assert np.all(solution.FV().NumPy()[~mask] == 0)


def test_singular_matrix(form):
    everything = ngsolve.BitArray(form.space.ndof)
    everything.Set()
    form.mat.AsVector()[:] = 0.0
    with pytest.raises(FactorisationError):
        factorisation.factorise(form, everything)


def test_newton_reports_a_singular_matrix():
    numbers = ngsolve.L2(ngsolve.Mesh(unit_square.GenerateMesh(maxh=2.0)), order=0)
    space = numbers * numbers
    (u, w), (v, q) = space.TnT()
    form = ngsolve.BilinearForm(space)
    form += w * q * ngsolve.dx
    form += u**2 * v * ngsolve.dx + v * ngsolve.dx
    state = ngsolve.GridFunction(space)
    iteration = newton.ModifiedNewton(form, space.FreeDofs())
    result = iteration.solve(state, tolerance=1e-12, max_iterations=10)
    assert result.reason.startswith("factorisation failed: ")
