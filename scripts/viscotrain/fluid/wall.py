"""Shear at the wall of a tube, which is the largest of its flow: from the pressure gradient.

The wall carries the stress T_w = (R/2)(-dp/dz) (`pipe`), and gamma_w is the rate at which the fluid
has it, eta(gamma_w) gamma_w = T_w. From the axis to the wall the flow covers 0 to gamma_w, and
Weissenberg numbers lambda_1 gamma of 0 to lambda_1 gamma_w.
"""

import numpy as np
from scipy.optimize import brentq

from viscotrain.fluid.parameters import CHANNEL_RADIUS, DimensionlessFluid
from viscotrain.fluid.pipe import LARGEST_WALL_SHEAR_RATE, PipeFlow, pipe_flow
from viscotrain.fluid.shear import shear_viscosity

SCANNED = 2000  # rates among which the first with the stress of the wall is sought


def wall_shear_rate(
    fluid: DimensionlessFluid, deborah: float, flow: PipeFlow | None = None
) -> float:
    """Shear rate at the wall in Ubar/D, at De = lambda_1 Ubar/D; 8 of a Newtonian fluid.

    Args:
        fluid: In units of its own.
        deborah: Of the longest relaxation time.
        flow: Of `pipe_flow` there, if it is known.

    Raises:
        FluidError: The flow is not unique.
    """
    pressure_gradient = (flow or pipe_flow(fluid, deborah)).pressure_gradient

    def excess(rate):
        stress = shear_viscosity(np.asarray(rate), fluid, deborah) * rate
        return stress - pressure_gradient * CHANNEL_RADIUS / 2

    rates = np.geomspace(1.0, LARGEST_WALL_SHEAR_RATE, SCANNED)
    first = int(np.argmax(excess(rates) > 0))
    return float(brentq(excess, rates[first - 1], rates[first], xtol=1e-12))
