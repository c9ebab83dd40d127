"""Steady shear of a Giesekus fluid: the viscometric functions of one mode, and the viscosity.

One Giesekus mode in steady shear of rate gamma, with W = lambda gamma, has (Bird, Armstrong &
Hassager, Dynamics of Polymeric Liquids 1, 1987, table 7.3-4)

    eta/eta_k = (1 - f)^2/(1 + (1 - 2 alpha) f),    f = (1 - chi)/(1 + (1 - 2 alpha) chi),
    chi^2 = 2/(1 + s),    s^2 = 1 + 16 alpha (1 - alpha) W^2,

and normal stresses that follow from f and from F = f/alpha, without its 0/0 at alpha = 0
(Oldroyd-B: F = W^2),

    F = 16 (1 - alpha) W^2/[(1 + s)^2 (1 + chi) (1 + (1 - 2 alpha) chi)].
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viscotrain.fluid.parameters import DimensionlessFluid


class Viscometric(NamedTuple):
    """f and F of a mode, each shaped like the shear rate."""

    f: NDArray
    F: NDArray


def viscometric(weissenberg_squared: NDArray, mobility: float) -> Viscometric:
    """The functions f and F of a mode at W^2, any shape."""
    alpha, W_squared = mobility, weissenberg_squared
    s = np.sqrt(1 + 16 * alpha * (1 - alpha) * W_squared)
    chi = np.sqrt(2 / (1 + s))
    denominator = 1 + (1 - 2 * alpha) * chi
    F = 16 * (1 - alpha) * W_squared / ((1 + s) ** 2 * (1 + chi) * denominator)
    return Viscometric((1 - chi) / denominator, F)


def shear_viscosity(shear_rate: NDArray, fluid: DimensionlessFluid, deborah: float) -> NDArray:
    """Steady shear viscosity in eta_0; same shape as `shear_rate`, which is in Ubar/D."""
    eta = np.full_like(shear_rate, fluid.solvent)
    for mode in fluid.modes:
        W_squared = (deborah * mode.relaxation_time * shear_rate) ** 2
        f = viscometric(W_squared, mode.mobility).f
        eta += mode.viscosity * (1 - f) ** 2 / (1 + (1 - 2 * mode.mobility) * f)
    return eta
