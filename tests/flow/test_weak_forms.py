"""How strongly the transport of the conformation is upwinded."""

import math

import ngsolve
import pytest
from netgen.geom2d import unit_square
from ngsolve import H1, GridFunction, x, y

from viscotrain.flow import weak_forms
from viscotrain.flow.axisymmetry import Velocity

H = 0.03  # of the elements, as far as `upwind` is told


def added(velocity, lam):
    """What is added to the test function 3 x + 2 y at a point."""
    mesh = ngsolve.Mesh(unit_square.GenerateMesh(maxh=0.5))
    chi = GridFunction(H1(mesh, order=1))
    chi.Set(3 * x + 2 * y)
    (test,) = weak_forms.upwind(
        [chi], Velocity(*map(ngsolve.CoefficientFunction, velocity)), H, lam
    )
    point = mesh(0.3, 0.4)
    return test(point) - chi(point)


@pytest.mark.parametrize("lam", [1.0, 62.0])
def test_fast_fluid_is_upwinded_by_a_share_of_the_element(lam):
    """C h n . grad chi, n along the flow, whatever the relaxation time."""
    along = (3 * 30 + 2 * 40) / 50
    assert added((30.0, 40.0), lam) == pytest.approx(0.1 * H * along, rel=1e-4)
    assert added((-30.0, -40.0), lam) == pytest.approx(-0.1 * H * along, rel=1e-4)


def test_slow_fluid_is_upwinded_in_proportion_to_the_relaxation_time():
    """What a polymer remembers there, it remembers of a way that is short: c h lam u/(0.2 D)."""
    slow = (1e-5, 0.0)
    assert added(slow, 1.0) == pytest.approx(0.1 * H * 3e-5 / 0.2, rel=1e-6)
    assert added(slow, 62.0) == pytest.approx(62 * added(slow, 1.0), rel=1e-4)


def test_between_both_the_way_within_a_relaxation_time_decides():
    """Where it is 0.2 D, the share is smaller by the root of two."""
    lam = 10.0
    share = added((0.02, 0.0), lam) / (0.1 * H * 3)
    assert share == pytest.approx(1 / math.sqrt(2), rel=1e-6)
