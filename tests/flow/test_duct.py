"""Flow in ducts without spheres: exact series, a slit, a round duct, and what is refused."""

import math

import ngsolve as ng
import numpy as np
import pytest
from netgen.occ import Circle, OCCGeometry, Rectangle
from scipy.optimize import brentq

from viscotrain.errors import FluidError
from viscotrain.flow.duct import rectangle_flow, solve
from viscotrain.fluid.parameters import NEWTONIAN, DimensionlessFluid, Mode
from viscotrain.fluid.pipe import pipe_flow
from viscotrain.fluid.shear import shear_viscosity

TERMS = np.arange(1, 400, 2)  # of the series, whose sums fall as n^-5 and exp(-n)
THINNING = DimensionlessFluid(0.02, (Mode(0.98, 1.0, 0.5),))


def exact(aspect):
    """U_max/Ubar, G, and the rate at the middle of the larger side, of a Newtonian fluid.

    White, Viscous Fluid Flow, section 3-3.3: a rectangle of sides 1 and a, series in cos(n pi y).
    """
    n, sign = TERMS, (-1.0) ** ((TERMS - 1) // 2)
    half = n * math.pi * aspect / 2
    mean = (1 - 192 / (math.pi**5 * aspect) * np.sum(np.tanh(half) / n**5)) / 12
    largest = (1 - 32 / math.pi**3 * np.sum(sign / n**3 / np.cosh(np.minimum(half, 700)))) / 8
    at_wall = (1 - 8 / math.pi**2 * np.sum(1 / n**2 / np.cosh(np.minimum(half, 700)))) / 2
    return largest / mean, 1 / mean, at_wall / mean


def test_square_has_the_known_velocity_and_friction():
    """U_max/Ubar = 2.0963 and f Re = 56.91, with f of the hydraulic diameter, which is the side."""
    flow = rectangle_flow(NEWTONIAN, 0.0)
    assert flow.centreline_velocity == pytest.approx(2.0963, abs=1e-4)
    assert 2 * flow.pressure_gradient == pytest.approx(56.91, abs=2e-3)  # as many digits as printed


@pytest.mark.parametrize("aspect", [1.0, 1.5, 4.0, 20.0])
def test_rectangles_agree_with_the_series(aspect):
    flow, (largest, gradient, at_wall) = rectangle_flow(NEWTONIAN, 0.0, aspect), exact(aspect)
    assert flow.centreline_velocity == pytest.approx(largest, rel=1e-8)
    assert flow.pressure_gradient == pytest.approx(gradient, rel=1e-8)
    assert flow.largest_wall_shear_rate == pytest.approx(at_wall, rel=1e-6)
    # the force on the wall, with the viscosity 1, balances the pressure
    balance = gradient * aspect / (2 * (1 + aspect))
    assert flow.mean_wall_shear_rate == pytest.approx(balance, rel=1e-5)


@pytest.mark.parametrize("deborah", [1.0, 5.0, 62.0])
def test_round_duct_is_the_pipe(deborah, hyaluronic_acid):
    """The same code on a quarter of a disc, against integrals over the shear rate."""
    quarter = Circle((0, 0), 0.5).Face() * Rectangle(1, 1).Face()
    for edge in quarter.edges:
        centre = edge.center
        edge.name = "wall" if min(centre.x, centre.y) > 1e-6 else "symmetry"
    mesh = ng.Mesh(OCCGeometry(quarter, dim=2).GenerateMesh(maxh=0.08)).Curve(6)
    u, gradient = solve(mesh, hyaluronic_acid, deborah)
    flow = pipe_flow(hyaluronic_acid, deborah)
    assert u(mesh(0.0, 0.0)) == pytest.approx(flow.centreline_velocity, rel=1e-6)
    assert gradient == pytest.approx(flow.pressure_gradient, rel=1e-6)


def test_the_middle_of_a_flat_duct_is_a_slit(hyaluronic_acid):
    """There the stress is G y: rate and velocity from the flow curve, inverted point by point.

    What the ends do falls as exp(-pi x sqrt(n)) with the slope n of the stress; 1e-6 at 20 : 1.
    """
    De = 5.0
    flow = rectangle_flow(hyaluronic_acid, De, 20.0)

    def rate(y):
        def excess(gamma):
            stress = float(shear_viscosity(np.array(gamma), hyaluronic_acid, De)) * gamma
            return stress - flow.pressure_gradient * y

        return brentq(excess, 0.0, 1e4, xtol=1e-13)

    y, weights = np.polynomial.legendre.leggauss(80)
    velocity = sum(w * rate((x + 1) / 4) for x, w in zip(y, weights / 4, strict=True))
    assert flow.centreline_velocity == pytest.approx(velocity, rel=1e-6)
    assert flow.largest_wall_shear_rate == pytest.approx(rate(0.5), rel=1e-5)


def test_other_elements_give_the_same_flow(monkeypatch):
    """Less by a third each way, in a fluid that thins strongly; 1e-4 is what is promised."""
    coarse = rectangle_flow(THINNING, 20.0)
    monkeypatch.setattr("viscotrain.flow.duct.ELEMENTS", 7)
    monkeypatch.setattr("viscotrain.flow.duct.LAYERS", 7)
    fine = rectangle_flow(THINNING, 20.0)
    assert coarse != fine
    assert coarse == pytest.approx(fine, rel=5e-6)


def test_a_decreasing_flow_curve_is_refused():
    with pytest.raises(FluidError, match="monotonic"):
        rectangle_flow(DimensionlessFluid(0.01, (Mode(0.99, 1.0, 0.9),)), 20.0)
