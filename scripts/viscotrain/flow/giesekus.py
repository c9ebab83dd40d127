"""The Giesekus law in log-conformation variables, without eigenvectors.

Mode k has the conformation c = I + (lambda_k/eta_k) tau_k = exp(psi). With psi in place of tau_k
the conformation is positive definite by construction, whatever the solver does. In the (z, r) plane

    psi = [[m + a, b], [b, m - a]],   theta = psi_tt,   delta^2 = a^2 + b^2,
    S = sinh(delta)/delta,   C = cosh(delta),   g = (delta coth(delta) - 1)/delta^2,
    c_zz, c_rr = e^m (C +- S a),   c_zr = e^m S b,   c_tt = e^theta,

and with e = (D_zz - D_rr)/2, f = D_zr and the vorticity w the law reads

    Dm/Dt     = D_zz + D_rr               - [alpha e^m C - (1 - alpha) e^-m C + 1 - 2 alpha]/lambda
    Da/Dt     = 2 e - 2 g (f a - e b) b + 2 w b - [alpha e^m + (1 - alpha) e^-m] S a/lambda
    Db/Dt     = 2 f + 2 g (f a - e b) a - 2 w a - [alpha e^m + (1 - alpha) e^-m] S b/lambda
    Dtheta/Dt = 2 D_tt - [alpha e^theta - (1 - alpha) e^-theta + 1 - 2 alpha]/lambda

(two-dimensional form of Fattal & Kupferman, J. Non-Newtonian Fluid Mech. 123, 2004, 281, and of
Hulsen, Fattal & Kupferman, 127, 2005, 27; free of eigenvectors like Knechtges, Behr & Elgeti, 214,
2014, 78).
Viscosities are in eta_0, times in D/Ubar, stresses in eta_0 Ubar/D.
"""

from typing import NamedTuple

from ngsolve import CoefficientFunction

from viscotrain.flow.axisymmetry import Tensor
from viscotrain.flow.jets import exp, if_positive, sqrt

SMALL_DELTA_SQUARED = 1e-2  # below, power series: closed forms of S and g are 0/0 at equilibrium


class LogConformation(NamedTuple):
    """psi of one mode, or a rate of change of it, or test functions for it."""

    m: CoefficientFunction
    a: CoefficientFunction
    b: CoefficientFunction
    theta: CoefficientFunction


class Exponentials(NamedTuple):
    """What stress and evolution have in common: e^m, e^theta, S, C and g."""

    m: CoefficientFunction
    theta: CoefficientFunction
    S: CoefficientFunction
    C: CoefficientFunction
    g: CoefficientFunction


def exponentials(psi: LogConformation) -> Exponentials:
    """Of one mode."""
    even = _even_functions(psi.a * psi.a + psi.b * psi.b)
    return Exponentials(exp(psi.m), exp(psi.theta), *even)


def _even_functions(delta_squared):
    """S, C and g, smooth with all derivatives at delta = 0; series exact to 1e-12."""
    q = delta_squared
    large = q - SMALL_DELTA_SQUARED
    delta = sqrt(if_positive(large, q, 1.0))
    growing = exp(delta)
    decaying = 1 / growing
    sinh_over_delta, cosh = (growing - decaying) / (2 * delta), (growing + decaying) / 2
    S = if_positive(large, sinh_over_delta, 1 + q / 6 * (1 + q / 20 * (1 + q / 42 * (1 + q / 72))))
    C = if_positive(large, cosh, 1 + q / 2 * (1 + q / 12 * (1 + q / 30 * (1 + q / 56))))
    g = if_positive(
        large,
        (cosh / sinh_over_delta - 1) / (delta * delta),
        1 / 3 - q * (1 / 45 - q * (2 / 945 - q * (1 / 4725 - q * (2 / 93555)))),
    )
    return S, C, g


def conformation(psi: LogConformation, known: Exponentials | None = None) -> Tensor:
    """C = exp(psi)."""
    e = known or exponentials(psi)
    along, across = e.m * e.C, e.m * e.S
    turned = across * psi.a
    return Tensor(zz=along + turned, rr=along - turned, tt=e.theta, zr=across * psi.b)


def polymer_stress(
    psi: LogConformation, viscosity, relaxation_time, known: Exponentials | None = None
) -> Tensor:
    """Tau = (eta/lambda) (c - I) of one mode."""
    modulus = viscosity / relaxation_time
    c = conformation(psi, known)
    return Tensor(
        zz=(c.zz - 1) * modulus,
        rr=(c.rr - 1) * modulus,
        tt=(c.tt - 1) * modulus,
        zr=c.zr * modulus,
    )


def evolution(
    psi: LogConformation,
    D: Tensor,
    w,
    relaxation_time,
    mobility,
    known: Exponentials | None = None,
) -> LogConformation:
    """Material derivative of psi in a flow with rate of deformation D and vorticity w."""
    _, a, b, _ = psi
    lam, alpha = relaxation_time, mobility
    e = known or exponentials(psi)
    stretch, shear = (D.zz - D.rr) / 2, D.zr
    turn = 2 * (e.g * (shear * a - stretch * b) - w)
    growing, decaying = alpha * e.m, (1 - alpha) / e.m
    recoil = (growing + decaying) * e.S / lam
    return LogConformation(
        m=D.zz + D.rr - ((growing - decaying) * e.C + (1 - 2 * alpha)) / lam,
        a=2 * stretch - turn * b - recoil * a,
        b=2 * shear + turn * a - recoil * b,
        theta=2 * D.tt - (alpha * e.theta - (1 - alpha) / e.theta + (1 - 2 * alpha)) / lam,
    )
