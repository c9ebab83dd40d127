r"""Physical units of a study: what one of its dimensionless numbers is in mm, s, uL/min and Pa.

Results are in D, Ubar, D/Ubar and eta_0 Ubar/D (`parameters`). In a channel of D in m, with a fluid
of eta_0 in Pa s and lambda_1 in s, these are at De = lambda_1 Ubar/D

    Ubar = De D/lambda_1,    D/Ubar,    eta_0 Ubar/D,    and    Q = A Ubar,

with the area A of the section, (pi/4) D^2 of a tube (`channel`; D of a duct is its smaller side).
Multiply a result by its factor; divide a rate, such as the spheres per D/Ubar that enter, by the
time. The factors that contain a velocity are NaN at De = 0, with or
without modes: creeping Newtonian flow has no velocity scale of its own.
"""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from viscotrain.fluid.channel import ROUND, CrossSection
from viscotrain.fluid.parameters import DimensionlessFluid, Fluid
from viscotrain.words import DEBORAH_NUMBERS

MICROLITRES_PER_MINUTE = 60e9  # of one m^3/s
MILLIMETRES = 1e3  # of one m
CENTIMETRES, MICROMETRES = 0.1, 1e3  # of one mm

WORDS = ("units", "long_name")
FACTORS = {name: ("1", text) for name, text in DEBORAH_NUMBERS.items()} | {
    "channel_diameter": ("mm", "channel diameter, unit of lengths along the channel"),
    "particle_diameter": ("mm", "particle diameter, unit of distances"),
    "mean_velocity": ("m s-1", "mean velocity of the flow, unit of velocities"),
    "time": ("s", "channel diameter over mean velocity, unit of times; spheres/s: rate over it"),
    "flow_rate": ("uL min-1", "flow rate"),
    "stress": (
        "Pa",
        "zero-shear viscosity times mean velocity over channel diameter, unit of stresses",
    ),
}


def physical_units(
    fluid: Fluid,
    longest_modes: Mapping[float, float],
    *,
    channel_diameter: float,
    particle_diameter: float,
    section: CrossSection = ROUND,
) -> xr.Dataset:
    """All factors at the Deborah numbers of a study.

    Args:
        fluid: In physical units.
        longest_modes: lambda_1 Ubar/D by the Deborah number as the study defines it.
        channel_diameter: D in m.
        particle_diameter: d in m.
        section: Of the channel.

    Returns:
        Dataset over `deborah` with the variables of `FACTORS`.
    """
    D, lambda_1 = channel_diameter, fluid.longest_relaxation_time
    scaled = DimensionlessFluid.from_physical(fluid.solvent_viscosity, fluid.modes)
    De = np.array(list(longest_modes.values()), dtype=float)
    flowing = De > 0
    Ubar = np.where(flowing, De * D / lambda_1, math.nan)
    factors: dict[str, ArrayLike] = {
        "deborah": list(longest_modes),
        "deborah_longest_mode": De,
        "deborah_mean_relaxation_time": np.where(flowing, De * scaled.mean_relaxation_time, 0.0),
        "channel_diameter": D * MILLIMETRES,
        "particle_diameter": particle_diameter * MILLIMETRES,
        "mean_velocity": Ubar,
        "time": D / Ubar,
        "flow_rate": section.area * D**2 * Ubar * MICROLITRES_PER_MINUTE,
        "stress": fluid.zero_shear_viscosity * Ubar / D,
    }
    variables = {
        name: (["deborah"] * np.ndim(values), values, dict(zip(WORDS, FACTORS[name], strict=True)))
        for name, values in factors.items()
    }
    return xr.Dataset(variables, attrs=section.attributes).set_coords("deborah")
