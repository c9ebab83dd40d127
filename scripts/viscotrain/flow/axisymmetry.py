"""Axisymmetric flow without swirl in the (z, r) half plane; r appears in no other file.

The mesh plane is x = z (along the channel), y = r (distance to the axis). A velocity has the
components (u_z, u_r), a symmetric tensor the components (zz, rr, tt, zr) with t the azimuth:

    D_zz = du_z/dz,  D_rr = du_r/dr,  D_tt = u_r/r,  D_zr = (du_z/dr + du_r/dz)/2,
    vorticity w = (du_z/dr - du_r/dz)/2,     div u = D_zz + D_rr + D_tt

(Bird, Armstrong & Hassager, Dynamics of Polymeric Liquids 1, 1987, appendix A). Integrals are
taken over the half plane with the weight r, that is, without the factor 2 pi.
"""

from typing import NamedTuple

from ngsolve import CoefficientFunction, ds, dx, x, y

from viscotrain.flow.jets import grad
from viscotrain.fluid.parameters import CHANNEL_RADIUS

z, r = x, y

CROSS_SECTION = CHANNEL_RADIUS**2 / 2  # integral of r over the cross-section


class Tensor(NamedTuple):
    """Components of a symmetric tensor, each a coefficient function."""

    zz: CoefficientFunction
    rr: CoefficientFunction
    tt: CoefficientFunction
    zr: CoefficientFunction


class Velocity(NamedTuple):
    """Components of a velocity, trial, test or grid functions."""

    z: CoefficientFunction
    r: CoefficientFunction


def rate_of_deformation(u: Velocity) -> Tensor:
    """D(u) = (grad u + grad u^T)/2."""
    return Tensor(
        zz=grad(u.z)[0],
        rr=grad(u.r)[1],
        tt=u.r / r,
        zr=(grad(u.z)[1] + grad(u.r)[0]) / 2,
    )


def vorticity(u: Velocity) -> CoefficientFunction:
    """The zr component w of the antisymmetric part of the velocity gradient."""
    return (grad(u.z)[1] - grad(u.r)[0]) / 2


def divergence(u: Velocity) -> CoefficientFunction:
    """Trace of D(u)."""
    D = rate_of_deformation(u)
    return D.zz + D.rr + D.tt


def contract(a: Tensor, b: Tensor) -> CoefficientFunction:
    """A : b of two symmetric tensors."""
    return a.zz * b.zz + a.rr * b.rr + a.tt * b.tt + 2 * a.zr * b.zr


def advect(u: Velocity, f: CoefficientFunction) -> CoefficientFunction:
    """U . grad f of a scalar f."""
    return u.z * grad(f)[0] + u.r * grad(f)[1]


def volume_integrand(integrand: CoefficientFunction) -> CoefficientFunction:
    """With the weight of an integral over the fluid."""
    return integrand * r


def volume_integral(integrand: CoefficientFunction):
    """Integral over the fluid, compiled."""
    return volume_integrand(integrand).Compile() * dx


def boundary_integral(integrand: CoefficientFunction, boundary: str):
    """Integral over the boundaries whose names match."""
    return integrand * r * ds(boundary)
