"""The law in log-conformation form against the law as a tensor equation."""

import math

import ngsolve
import numpy as np
import pytest
from netgen.geom2d import unit_square
from ngsolve import CoefficientFunction
from scipy.linalg import expm, expm_frechet

from viscotrain.flow import giesekus
from viscotrain.flow.axisymmetry import Tensor
from viscotrain.flow.giesekus import LogConformation

MESH = ngsolve.Mesh(unit_square.GenerateMesh(maxh=1.0))  # must outlive its points
POINT = MESH(0.3, 0.4)


def numbers(functions) -> np.ndarray:
    return np.array([CoefficientFunction(f)(POINT) for f in functions])


def as_matrix(psi: np.ndarray) -> np.ndarray:
    """Psi as a tensor in (z, r, azimuth)."""
    m, a, b, theta = psi
    return np.array([[m + a, b, 0], [b, m - a, 0], [0, 0, theta]])


def constants(values) -> list[CoefficientFunction]:
    return [CoefficientFunction(float(v)) for v in values]


def random_states(count: int):
    rng = np.random.default_rng(7)
    for k in range(count):
        psi = rng.normal(scale=1.5, size=4)
        if k % 4 == 0:  # within the power series, too
            psi[1:3] *= 1e-2
        L = np.zeros((3, 3))
        L[:2, :2] = rng.normal(size=(2, 2))
        L[2, 2] = -L[0, 0] - L[1, 1]
        yield psi, L, rng.uniform(0.1, 5), rng.uniform(0, 1)


def test_conformation_is_the_matrix_exponential():
    for psi, *_ in random_states(40):
        zz, rr, tt, zr = numbers(giesekus.conformation(LogConformation(*constants(psi))))
        expected = expm(as_matrix(psi))
        found = np.array([[zz, zr, 0], [zr, rr, 0], [0, 0, tt]])
        # relative to the largest entry: round-off of the exponential
        assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


def test_evolution_is_the_upper_convected_giesekus_equation():
    """d/dt exp(psi) must be L c + c L^T - [(c - I) + alpha (c - I)^2]/lambda.

    L is the velocity gradient with L_ij = du_i/dx_j, z before r.
    """
    for psi, L, lam, alpha in random_states(200):
        D = (L + L.T) / 2
        vorticity = (L[0, 1] - L[1, 0]) / 2
        rate = giesekus.evolution(
            LogConformation(*constants(psi)),
            Tensor(*constants([D[0, 0], D[1, 1], D[2, 2], D[0, 1]])),
            CoefficientFunction(vorticity),
            CoefficientFunction(lam),
            alpha,
        )
        c = expm(as_matrix(psi))
        change = expm_frechet(
            as_matrix(psi), as_matrix(numbers(rate)), compute_expm=False, check_finite=True
        )
        strain = c - np.eye(3)
        expected = L @ c + c @ L.T - (strain + alpha * strain @ strain) / lam
        scale = np.abs(expected).max() + np.abs(c).max() ** 2 / lam
        assert np.abs(change - expected).max() < 1e-9 * scale


def test_stress_is_elastic_modulus_times_strain():
    psi = LogConformation(*constants([0.3, 0.2, -0.1, 0.4]))
    c, tau = numbers(giesekus.conformation(psi)), numbers(giesekus.polymer_stress(psi, 0.6, 3.0))
    assert tau == pytest.approx(0.2 * (c - [1, 1, 1, 0]), abs=1e-15)


@pytest.mark.parametrize("offset", [-1e-9, 1e-9])
def test_series_and_closed_forms_meet(offset):
    """The two branches agree at their border, to the truncation error of the series."""
    delta = math.sqrt(giesekus.SMALL_DELTA_SQUARED + offset)
    S, C, g = numbers(giesekus._even_functions(CoefficientFunction(delta**2)))
    assert pytest.approx(math.sinh(delta) / delta, rel=1e-13) == S
    assert pytest.approx(math.cosh(delta), rel=1e-13) == C
    assert g == pytest.approx((delta / math.tanh(delta) - 1) / delta**2, rel=1e-11)


def test_linearisation_is_finite_at_rest():
    """The stress-free state is delta = 0, where closed forms are 0/0."""
    mesh = ngsolve.Mesh(unit_square.GenerateMesh(maxh=1.0))
    space = ngsolve.H1(mesh, order=1) ** 2
    (a, b), (v, w) = space.TnT()
    S, C, g = giesekus._even_functions(a * a + b * b)
    form = ngsolve.BilinearForm(space)
    form += ((S + C + g) * (a * v + b * w)).Compile() * ngsolve.dx
    state = ngsolve.GridFunction(space)
    form.AssembleLinearization(state.vec)
    assert np.isfinite(form.mat.AsVector().FV().NumPy()).all()
