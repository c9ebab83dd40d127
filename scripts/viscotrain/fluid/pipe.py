"""Undisturbed flow: fully developed tube flow of the fluid, from its viscometric functions.

The shear stress T = eta gamma, with the viscosity of `shear`, is proportional to r, and Ubar and
U_max follow from integrals over the shear rate up to that at the wall, gamma_w with T_w
(Rabinowitsch), here integrated by parts:

    Ubar  = R/T_w^3 [gamma_w T_w^3 - int_0^gamma_w T^3 dgamma]/3,
    U_max = R/T_w [gamma_w T_w - int_0^gamma_w T dgamma],       -dp/dz = 2 T_w/R.

gamma_w is the one for which Ubar = 1. At r the shear rate is that of T = T_w r/R, and a mode has
the normal stresses of steady shear, tau_rr = N2, tau_zz = N1 + N2, and none around the axis (N1 and
N2 of a mode in `rheology`). Needs no mesh: the table takes U_max from here, and tests
compare it with that of the finite elements.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from viscotrain.errors import FluidError
from viscotrain.fluid.parameters import CHANNEL_RADIUS, DimensionlessFluid
from viscotrain.fluid.shear import shear_viscosity, viscometric

QUADRATURE_POINTS = 400  # Gauss-Legendre in the shear rate: U_max to 1e-9 up to De = 1000
LARGEST_WALL_SHEAR_RATE = (
    1e6  # bracket of gamma_w, in Ubar/D; 8 if Newtonian, more if shear-thinning
)
PROFILE = 4001  # shear rates between which that of a stress is interpolated, to 1e-6


class PipeFlow(NamedTuple):
    """Centreline velocity in Ubar and pressure gradient -dp/dz in eta_0 Ubar/D^2."""

    centreline_velocity: float
    pressure_gradient: float


def pipe_flow(fluid: DimensionlessFluid, deborah: float) -> PipeFlow:
    """Flow of unit mean velocity at De = lambda_1 Ubar/D.

    Raises:
        FluidError: The shear stress decreases with the shear rate (a mobility above 1/2 with little
            solvent), so that the steady profile is not unique.
    """
    points, weights = np.polynomial.legendre.leggauss(QUADRATURE_POINTS)
    points, weights = (points + 1) / 2, weights / 2

    def stress(shear_rate):
        return shear_viscosity(shear_rate, fluid, deborah) * shear_rate

    def mean_velocity(wall_rate):
        T, T_w = stress(wall_rate * points), stress(np.array(wall_rate))
        return CHANNEL_RADIUS * wall_rate * (1 - weights @ (T / T_w) ** 3) / 3

    wall_rate = brentq(
        lambda rate: mean_velocity(rate) - 1, 1.0, LARGEST_WALL_SHEAR_RATE, xtol=1e-12
    )
    T, T_w = stress(wall_rate * points), float(stress(np.array(wall_rate)))
    if np.any(np.diff(T) < 0):
        raise FluidError(
            f"shear stress is not a monotonic function of the shear rate at De = {deborah:g}; "
            "allowed: mobility up to 1/2, or enough solvent"
        )
    return PipeFlow(
        centreline_velocity=float(CHANNEL_RADIUS * wall_rate * (1 - weights @ (T / T_w))),
        pressure_gradient=2 * T_w / CHANNEL_RADIUS,
    )


class PolymerStress(NamedTuple):
    """tau_zz, tau_rr and tau_zr of all modes in eta_0 Ubar/D, each shaped like the radius."""

    zz: NDArray
    rr: NDArray
    zr: NDArray


def polymer_stress(fluid: DimensionlessFluid, deborah: float, radius: ArrayLike) -> PolymerStress:
    """Stress of the modes in the flow of `pipe_flow`.

    Args:
        fluid: In eta_0 and lambda_1.
        deborah: lambda_1 Ubar/D.
        radius: r in D, of any shape.

    Raises:
        FluidError: As `pipe_flow`.
    """
    T = pipe_flow(fluid, deborah).pressure_gradient / 2 * np.asarray(radius, dtype=float)
    steepest = T.max() / fluid.solvent  # above every shear rate
    rates = np.concatenate([[0.0], np.geomspace(1e-6, steepest, PROFILE)])
    gamma = np.interp(T, shear_viscosity(rates, fluid, deborah) * rates, rates)
    zz, rr = np.zeros_like(gamma), np.zeros_like(gamma)
    for mode in fluid.modes if deborah > 0 else ():
        time, alpha = deborah * mode.relaxation_time, mode.mobility
        F = viscometric((time * gamma) ** 2, alpha).F
        f = alpha * F
        rr -= mode.viscosity / time * f
        zz += mode.viscosity / time * (2 * F * (1 - alpha * f) / (1 - f) - f)
    return PolymerStress(zz, rr, fluid.solvent * gamma - T)
