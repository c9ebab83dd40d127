"""Weak forms of the flow, one function per physical term; each returns an integrand.

Trial functions u, p, psi; test functions v, q, chi. In the frame of one sphere (see `dns`)

    0 = viscous(eta_s) + sum_k polymer(tau_k) + pressure + incompressibility + flow_rate + follow
    0 = storage(psi_k) + transport(psi_k)   for each mode k

Integration by parts leaves the traction on the boundaries. On a boundary where u_z is one unknown
(a sphere, the wall) the natural condition is the total force, not the traction: zero for a sphere.
"""

from ngsolve import CoefficientFunction

from viscotrain.axisymmetry import (
    CROSS_SECTION,
    Tensor,
    Velocity,
    advect,
    boundary_integral,
    contract,
    divergence,
    rate_of_deformation,
)
from viscotrain.giesekus import LogConformation
from viscotrain.jets import sqrt

UPWINDING = 0.1  # c
SLOWEST = 0.1  # eps, in Ubar


def viscous(viscosity, u: Velocity, v: Velocity) -> CoefficientFunction:
    """2 eta D(u) : D(v)."""
    return 2 * viscosity * contract(rate_of_deformation(u), rate_of_deformation(v))


def polymer(tau: Tensor, v: Velocity) -> CoefficientFunction:
    """Tau : D(v)."""
    return contract(tau, rate_of_deformation(v))


def pressure(p, v: Velocity) -> CoefficientFunction:
    """-p div v."""
    return -p * divergence(v)


def incompressibility(u: Velocity, q) -> CoefficientFunction:
    """-q div u; the sign makes the Newtonian matrix symmetric."""
    return -q * divergence(u)


def flow_rate(u: Velocity, v: Velocity, drop, drop_test, *, mean_velocity, length):
    """Impose the mean velocity relative to the wall; its multiplier is the pressure drop.

    `drop` is the pressure drop over the periodic length. It drives the fluid at the inlet, and the
    wall, whose velocity in the frame of the sphere is an unknown, carries the opposite force:

        drop [int_inlet v_z r - v_wall A] + drop_test [int_inlet (u_z - mean) r - u_wall A],

    A = `CROSS_SECTION`; the values at the wall are written as means over its length.
    """
    area_per_wall = CROSS_SECTION / (length * 0.5)
    return boundary_integral(
        drop * v.z + drop_test * (u.z - mean_velocity), "inlet"
    ) - boundary_integral(area_per_wall * (drop * v.z + drop_test * u.z), "wall")


def upwind(chi, relative: Velocity, element_size) -> list[CoefficientFunction]:
    """Test functions of the streamline-upwind Petrov-Galerkin method, chi + t (u - w) . grad chi.

    Args:
        chi: Test functions of the components of psi.
        relative: Velocity u - w relative to the mesh, an unknown.
        element_size: h, in D.
    """
    speed = sqrt(relative.z**2 + relative.r**2 + SLOWEST**2)
    time = UPWINDING / speed * element_size
    return [test + time * advect(relative, test) for test in chi]


def transport(psi, tests, relative: Velocity, rate: LogConformation) -> list[CoefficientFunction]:
    """[(u - w) . grad psi - rate] . test, one integrand per component of psi.

    The mesh moves with w; the time derivative at one of its points, `storage`, is the term that the
    quasi-steady problem drops.
    """
    return [
        (advect(relative, component) - change) * test
        for component, test, change in zip(psi, tests, rate, strict=True)
    ]


def storage(psi, tests, leading, history) -> list[CoefficientFunction]:
    """(leading psi + history) . test, one integrand per component: d psi/dt at a point of the mesh.

    A backward difference formula has the coefficient `leading` for the new psi; `history` is the
    sum over the old ones.
    """
    return [
        (leading * component + old) * test
        for component, old, test in zip(psi, history, tests, strict=True)
    ]


def follow(u: Velocity, speed, test, sphere: str):
    """(W - u_z) W_test on a sphere: makes its velocity an unknown that the mesh can move with."""
    return boundary_integral((speed - u.z) * test, sphere)
