"""LU factors against those of ngsolve."""

import gc

import ngsolve
import numpy as np
import pytest
from netgen.geom2d import unit_square

from viscotrain import factorisation, newton
from viscotrain.factorisation import FactorisationError


@pytest.fixture(params=["direct", "by ngsolve"])
def interface(request, monkeypatch):
    """With the C interface of UMFPACK, and where it is not found."""
    if request.param == "by ngsolve":
        monkeypatch.setattr(factorisation, "_LIBRARY", None)
    return request.param


@pytest.fixture
def form(wind):
    """An unsymmetric problem."""
    return unsymmetric_form(wind)


@pytest.fixture
def wind():
    return ngsolve.Parameter(1.0)


def unsymmetric_form(wind):
    mesh = ngsolve.Mesh(unit_square.GenerateMesh(maxh=0.3))
    space = ngsolve.H1(mesh, order=3, dirichlet="left")
    u, v = space.TnT()
    form = ngsolve.BilinearForm(space)
    form += (ngsolve.grad(u) * ngsolve.grad(v) + wind * ngsolve.grad(u)[0] * v) * ngsolve.dx
    return form.Assemble()


def vectors(form):
    right, solution, expected = (form.mat.CreateColVector() for _ in range(3))
    right.FV().NumPy()[:] = np.random.default_rng(1).standard_normal(len(right))
    return right, solution, expected


def assert_equal(solution, expected):
    difference = solution.FV().NumPy() - expected.FV().NumPy()
    assert np.abs(difference).max() < 1e-12 * np.abs(expected.FV().NumPy()).max()


def test_is_the_inverse_of_ngsolve(form, interface):
    free = form.space.FreeDofs()
    right, solution, expected = vectors(form)
    factorisation.factorise(form, free).solve(right, solution)
    expected.data = form.mat.Inverse(free, inverse="umfpack") * right
    assert_equal(solution, expected)


def test_transposed_system(form, interface):
    free = form.space.FreeDofs()
    right, solution, expected = vectors(form)
    factorisation.factorise(form, free).solve_transposed(right, solution)
    transposed = form.mat.CreateTranspose()
    expected.data = transposed.Inverse(free, inverse="umfpack") * right
    assert_equal(solution, expected)


def test_one_analysis_for_all_matrices_of_a_form(form, wind, monkeypatch):
    free = form.space.FreeDofs()
    first = factorisation.factorise(form, free)
    monkeypatch.setattr(factorisation, "Analysis", None)  # no other one is made
    right, solution, expected = vectors(form)
    before = form.mat.Inverse(free, inverse="umfpack")
    expected.data = before * right
    wind.Set(20.0)
    form.Assemble()
    first.solve(right, solution)  # those of the old matrix
    assert_equal(solution, expected)
    factorisation.factorise(form, ngsolve.BitArray(free)).solve(right, solution)
    expected.data = form.mat.Inverse(free, inverse="umfpack") * right
    assert_equal(solution, expected)


def test_another_set_of_unknowns_has_its_own_analysis(form):
    right, solution, expected = vectors(form)
    free = ngsolve.BitArray(form.space.FreeDofs())
    factorisation.factorise(form, free)
    free.Clear(next(i for i, is_free in enumerate(free) if is_free))
    factorisation.factorise(form, free).solve(right, solution)
    expected.data = form.mat.Inverse(free, inverse="umfpack") * right
    assert_equal(solution, expected)


def test_the_analysis_ends_with_its_form(wind):
    form = unsymmetric_form(wind)
    before = len(factorisation._analyses)
    factorisation.factorise(form, form.space.FreeDofs())
    assert len(factorisation._analyses) == before + 1
    del form
    gc.collect()
    assert len(factorisation._analyses) == before


def test_singular_matrix(form):
    everything = ngsolve.BitArray(form.space.ndof)
    everything.Set()
    form.mat.AsVector()[:] = 0.0
    with pytest.raises(FactorisationError, match="singular matrix"):
        factorisation.factorise(form, everything)


def test_newton_reports_a_singular_matrix():
    space = ngsolve.L2(ngsolve.Mesh(unit_square.GenerateMesh(maxh=2.0)), order=0)
    u, v = space.TnT()
    form = ngsolve.BilinearForm(space)
    form += u**2 * v * ngsolve.dx + v * ngsolve.dx
    state = ngsolve.GridFunction(space)
    iteration = newton.ModifiedNewton(form, space.FreeDofs())
    result = iteration.solve(state, tolerance=1e-12, max_iterations=10)
    assert result.reason == "factorisation failed: singular matrix"
