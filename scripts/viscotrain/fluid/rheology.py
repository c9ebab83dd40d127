"""Rheometric functions of the fluid: what a rheometer would measure of it.

The fluid is a solvent (eta_s) and Giesekus modes (eta_k, lambda_k, alpha_k), all in physical units.
With the strain of a mode's conformation a = c - I = (lambda/eta) tau and the velocity gradient
L_ij = du_i/dx_j, the law of one mode and the stress are

    da/dt = L + L^T + L a + a L^T - (a + alpha a.a)/lambda,
    sigma = 2 eta_s D + sum_k (eta/lambda) a.

Small oscillation, where alpha does not enter:

    G' = sum_k (eta/lambda) x^2/(1 + x^2),  G'' = eta_s omega + sum_k eta omega/(1 + x^2),
    x = lambda omega.

Steady shear u_1 = gamma x_2, with W = lambda gamma, N1 = sigma_11 - sigma_22 and
N2 = sigma_22 - sigma_33 (Bird, Armstrong & Hassager, Dynamics of Polymeric Liquids 1, 1987, table
7.3-4; viscosity, f and F in `shear`):

    N1 = sum_k 2 (eta/lambda) F (1 - alpha f)/(1 - f),   N2 = -sum_k (eta/lambda) f,   f = alpha F.

Steady uniaxial extension u = rate (x_1, -x_2/2, -x_3/2), with W = lambda rate: two separate
quadratic equations, of which the root that vanishes with W is the state reached from rest,

    alpha a_11^2 + (1 - 2 W) a_11 - 2 W = 0,    alpha a_22^2 + (1 + W) a_22 + W = 0,
    eta_E = (sigma_11 - sigma_22)/rate = 3 eta_s + sum_k (eta/lambda) (a_11 - a_22)/rate.

An Oldroyd-B mode has no steady state for W >= 1/2: infinite.

Start-up of shear has no closed form; the ordinary differential equations of a_11, a_22 and a_12 are
integrated (a_33 stays 0).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from viscotrain.errors import FluidError
from viscotrain.fluid.parameters import DimensionlessFluid, Fluid, Mode
from viscotrain.fluid.shear import shear_viscosity, viscometric

TIME_STEP_TOLERANCE = 1e-10  # of start-up, relative: stresses to about 1e-8


class SteadyShear(NamedTuple):
    """Viscosity in Pa s and normal stress differences in Pa, each shaped like the shear rate."""

    viscosity: NDArray
    first_normal_stress_difference: NDArray
    second_normal_stress_difference: NDArray


class ShearStartUp(NamedTuple):
    """Shear stress and normal stress differences in Pa, each shaped like the time."""

    shear_stress: NDArray
    first_normal_stress_difference: NDArray
    second_normal_stress_difference: NDArray


def storage_modulus(angular_frequency: ArrayLike, fluid: Fluid) -> NDArray:
    """G' in Pa at frequencies in rad/s; same shape."""
    omega = np.asarray(angular_frequency, dtype=float)
    G = np.zeros_like(omega)
    for mode in fluid.modes:
        x = (mode.relaxation_time * omega) ** 2
        G += mode.viscosity / mode.relaxation_time * x / (1 + x)
    return G


def loss_modulus(angular_frequency: ArrayLike, fluid: Fluid) -> NDArray:
    """G'' in Pa at frequencies in rad/s; same shape."""
    omega = np.asarray(angular_frequency, dtype=float)
    G = fluid.solvent_viscosity * omega
    for mode in fluid.modes:
        G += mode.viscosity * omega / (1 + (mode.relaxation_time * omega) ** 2)
    return G


def steady_shear(shear_rate: ArrayLike, fluid: Fluid) -> SteadyShear:
    """Viscosity, N1 and N2 at shear rates in 1/s, which may be zero or negative."""
    rate = np.asarray(shear_rate, dtype=float)
    N1, N2 = np.zeros_like(rate), np.zeros_like(rate)
    for mode in fluid.modes:
        alpha, modulus = mode.mobility, mode.viscosity / mode.relaxation_time
        W_squared = (mode.relaxation_time * rate) ** 2
        F = viscometric(W_squared, alpha).F
        f = alpha * F  # without cancellation
        N1 += 2 * modulus * F * (1 - alpha * f) / (1 - f)
        N2 -= modulus * f
    return SteadyShear(viscosity(rate, fluid), N1, N2)


def viscosity(shear_rate: ArrayLike, fluid: Fluid) -> NDArray:
    """Steady shear viscosity in Pa s at shear rates in 1/s; same shape."""
    rate = np.asarray(shear_rate, dtype=float)
    scaled = DimensionlessFluid.from_physical(fluid.solvent_viscosity, fluid.modes)
    return fluid.zero_shear_viscosity * shear_viscosity(rate, scaled, fluid.longest_relaxation_time)


def extensional_viscosity(extension_rate: ArrayLike, fluid: Fluid) -> NDArray:
    """Steady uniaxial extensional viscosity in Pa s at rates above 0, in 1/s; same shape.

    Infinite where an Oldroyd-B mode has no steady state.

    Raises:
        FluidError: A rate is not above 0.
    """
    rate = np.asarray(extension_rate, dtype=float)
    if not np.all(rate > 0):
        raise FluidError(f"extension rate is {np.min(rate):g} 1/s; allowed: above 0")
    eta = np.full_like(rate, 3 * fluid.solvent_viscosity)
    for mode in fluid.modes:
        alpha, W = mode.mobility, mode.relaxation_time * rate
        p, q = 1 - 2 * W, 1 + W
        root = np.sqrt(p**2 + 8 * alpha * W)
        # Of the two forms of the root the one without cancellation, which also holds at alpha = 0.
        with np.errstate(divide="ignore", invalid="ignore"):
            a_11 = np.where(p > 0, 4 * W / (p + root), np.divide(root - p, 2 * alpha))
        a_22 = -2 * W / (q + np.sqrt(q**2 - 4 * alpha * W))
        eta += mode.viscosity / mode.relaxation_time * (a_11 - a_22) / rate
    return eta


def shear_start_up(time: ArrayLike, shear_rate: float, fluid: Fluid) -> ShearStartUp:
    """Stresses after a shear rate in 1/s is imposed on the fluid at rest.

    Args:
        time: Times in s since then, ascending, none negative, shape (n,).
        shear_rate: In 1/s.
        fluid: In physical units.

    Raises:
        FluidError: Times are not as above.
    """
    t = np.asarray(time, dtype=float)
    if t.ndim != 1 or not t.size or not t[0] >= 0 or not np.all(np.diff(t) > 0):
        raise FluidError("times of start-up; allowed: one or more, ascending, none negative")
    stress = np.full_like(t, fluid.solvent_viscosity * shear_rate)
    N1, N2 = np.zeros_like(t), np.zeros_like(t)
    for mode in fluid.modes:
        modulus = mode.viscosity / mode.relaxation_time
        a_11, a_22, a_12 = _strain_in_start_up(t, shear_rate, mode)
        stress += modulus * a_12
        N1 += modulus * (a_11 - a_22)
        N2 += modulus * a_22
    return ShearStartUp(stress, N1, N2)


def _strain_in_start_up(t: NDArray, shear_rate: float, mode: Mode) -> NDArray:
    """a_11, a_22 and a_12 of a mode at the times t, shape (3, n); integrated in units of lambda."""
    alpha, W = mode.mobility, mode.relaxation_time * shear_rate

    def rate_of_change(_, a):
        a_11, a_22, a_12 = a
        return (
            2 * W * a_12 - a_11 - alpha * (a_11**2 + a_12**2),
            -a_22 - alpha * (a_22**2 + a_12**2),
            W * (1 + a_22) - a_12 - alpha * a_12 * (a_11 + a_22),
        )

    times = t / mode.relaxation_time
    if W == 0 or times[-1] == 0:
        return np.zeros((3, t.size))
    solution = solve_ivp(
        rate_of_change,
        (0.0, times[-1]),
        np.zeros(3),
        method="LSODA",
        t_eval=times,
        rtol=TIME_STEP_TOLERANCE,
        atol=TIME_STEP_TOLERANCE * min(1.0, W**2),  # slow shear: a_11 and a_22 are of order W^2
    )
    return solution.y
