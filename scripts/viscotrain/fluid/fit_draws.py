"""Fluids drawn from the uncertainty of a fit, and what each does in the channel at a flow rate.

Parameters of a fit are normally distributed about its best values with its covariance: viscosities
and times in their logarithms, mobilities themselves (`fit_problem`). Vectors that leave the range
in which the fit looked for them are drawn again, as a mobility below 0: a truncated normal
distribution. One draw after the other, so that fewer draws are the first ones of more.

A pump sets the flow rate, not De. So each fluid flows with the same Ubar, and has its own

    De = lambda_1 Ubar/D,    U_max,    dp = (-dp/dz) L,    gamma_w,

by `pipe` and `wall`.
"""

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from viscotrain.errors import FluidError
from viscotrain.fluid.fit_parameters import with_values
from viscotrain.fluid.parameters import DimensionlessFluid, Fluid
from viscotrain.fluid.pipe import pipe_flow
from viscotrain.fluid.wall import wall_shear_rate
from viscotrain.words import DEBORAH_NUMBERS

SEED = 2026  # of all draws
MOST_TRIES = 1000  # per draw
BAR = 1e-5  # of one Pa
FLOW = {  # variables of a flow: units and meaning
    "deborah_longest_mode": ("1", DEBORAH_NUMBERS["deborah_longest_mode"]),
    "deborah_mean_relaxation_time": ("1", DEBORAH_NUMBERS["deborah_mean_relaxation_time"]),
    "centreline_velocity": ("1", "velocity on the axis over mean velocity"),
    "pressure_drop": ("bar", "pressure drop along the channel, without spheres"),
    "wall_shear_rate": ("s-1", "shear rate at the wall"),
    "weissenberg_number": ("1", "longest relaxation time times shear rate at the wall"),
}


def drawn_fluids(fit: xr.Dataset, central: Fluid, count: int) -> list[Fluid]:
    """Fluids whose fitted parameters are drawn.

    Args:
        fit: Of `fit_report.dataset`.
        central: The fitted fluid, which gives what was not fitted.
        count: How many.

    Raises:
        FluidError: The fit is at the edge of what it may find, and draws do not hit it.
    """
    names = [str(name) for name in fit["parameter"].values]
    draws = _draws(fit)
    return [with_values(central, names, next(draws)) for _ in range(count)]


def _draws(fit: xr.Dataset) -> Iterator[NDArray]:
    """Vectors of values, shape (p,)."""
    value, error = fit["value"].values, fit["uncertainty"].values
    low, high, logs = fit["lowest"].values, fit["highest"].values, fit["relative"].values == 1
    centre = np.where(logs, np.log(np.where(logs, value, 1.0)), value)
    variances, axes = np.linalg.eigh(fit["correlation"].values)
    root = error[:, None] * axes * np.sqrt(np.maximum(variances, 0.0))
    random = np.random.default_rng(SEED)
    while True:
        for _ in range(MOST_TRIES):
            vector = centre + root @ random.standard_normal(value.size)
            drawn = np.where(logs, np.exp(vector), vector)
            if np.all((low <= drawn) & (drawn <= high)):
                break
        else:
            raise FluidError(
                f"of {MOST_TRIES} draws of the fit none is in the range in which it was sought"
            )
        yield drawn


def flow_in_channel(
    fluid: Fluid, mean_velocity: float, diameter: float, length: float
) -> dict[str, float]:
    """Numbers of `FLOW` of the undisturbed flow; NaN where it is not unique, or slow.

    Args:
        fluid: In physical units.
        mean_velocity: Ubar in m/s; 0 for De = 0, which has no velocity scale.
        diameter: D in m.
        length: L in D.
    """
    scaled = DimensionlessFluid.from_physical(fluid.solvent_viscosity, fluid.modes)
    rate = mean_velocity / diameter
    De = fluid.longest_relaxation_time * rate if rate > 0 else 0.0
    found = dict.fromkeys(FLOW, math.nan)
    found["deborah_longest_mode"] = De
    found["deborah_mean_relaxation_time"] = De * scaled.mean_relaxation_time if De > 0 else 0.0
    if De == 0:
        return found
    try:
        flow = pipe_flow(scaled, De)
    except FluidError:
        return found
    stress = fluid.zero_shear_viscosity * rate
    at_wall = wall_shear_rate(scaled, De, flow)
    return found | {
        "centreline_velocity": flow.centreline_velocity,
        "pressure_drop": flow.pressure_gradient * stress * length * BAR,
        "wall_shear_rate": at_wall * rate,
        "weissenberg_number": at_wall * De,
    }
