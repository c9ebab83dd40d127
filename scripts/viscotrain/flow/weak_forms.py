"""Weak forms of the flow, one function per physical term; each returns an integrand.

Trial functions u, p, psi; test functions v, q, chi. In the frame of one sphere (see `flow`)

    0 = viscous(eta_s) + sum_k polymer(tau_k) + pressure + incompressibility + flow_rate + follow
    0 = storage(psi_k) + transport(psi_k)   for each mode k, tested with upwind(chi_k)

Upwinding. The equation of psi transports without diffusion; tested with chi alone its solution
oscillates in layers that the mesh does not resolve, and Newton's iteration is stuck there. It is
tested with (A. N. Brooks & T. J. R. Hughes, Comput. Methods Appl. Mech. Eng. 32, 1982, 199)

    chi + t (u - w) . grad chi,    t = c h/sqrt(|u - w|^2 + (s/lambda_k)^2),

instead, which adds a diffusion of order h along the streamlines to what the test functions see, and
nothing where the equation holds: the residual is the same, so the order of the method is kept. The
wind u - w in it is the unknown one, linearised with everything else; frozen, it would spoil the
convergence of Newton's method. t does not contain the time step, so that a transient simulation
stays of second order. It is smooth where the fluid moves with the mesh, at the spheres, and falls
where a polymer relaxes before it has moved by s: there relaxation outweighs transport.

c was chosen by measurement. A fluid of one mode (eta_s/eta_0 = 1/4, alpha = 0.1), one sphere with
d/D = 0.3, 494 elements, order 4: De = 12 is not reached with c = 0, but with c = 0.02, 0.1 and 0.3
(with 0.1 Ubar in place of s/lambda_k). So was s. With those 0.1 Ubar fluid between the spheres,
which moves by some 0.01 Ubar relative to them, is hardly upwinded; psi oscillated there at De = 62,
and each order took three or four matrices. Hyaluronic acid, (2, 2.5), De = 62, 402 elements, orders
4 to 7: 11.9 CPU s with 0.1 Ubar, 3.3 s with s = 0.2 D, of a relative velocity of 3.0235e-3 Ubar
7e-6 and 14e-6 too much. On 917 elements both shrink: in order 8 two pairs of c and s, (0.1, 0.2 D)
and (0.05, 0.5 D), agree to 5e-7 Ubar.

Integration by parts leaves the traction on the boundaries. On a boundary where u_z is one unknown
(a sphere, the wall) the natural condition is the total force, not the traction: zero for a sphere.
"""

from ngsolve import CoefficientFunction

from viscotrain.flow.axisymmetry import (
    CROSS_SECTION,
    Tensor,
    Velocity,
    advect,
    boundary_integral,
    contract,
    divergence,
    rate_of_deformation,
)
from viscotrain.flow.giesekus import LogConformation
from viscotrain.flow.jets import sqrt

UPWINDING = 0.1  # c
REMEMBERED = 0.2  # s, in D


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


def upwind(chi, relative: Velocity, element_size, lam) -> list[CoefficientFunction]:
    """Chi + t (u - w) . grad chi, one test function per component of psi.

    Args:
        chi: Test functions of the components of psi.
        relative: Velocity u - w relative to the mesh, an unknown.
        element_size: h, in D.
        lam: Relaxation time of the mode, in D/Ubar.
    """
    speed = sqrt(relative.z**2 + relative.r**2 + (REMEMBERED / lam) ** 2)
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
