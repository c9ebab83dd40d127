r"""Flow through the channel without spheres, at each Deborah number: what a pump and a wall see.

Of a tube by integrals over the shear rate (`fluid.pipe`, `fluid.wall`), of a duct by finite
elements (`flow.duct`). In units of D, Ubar and eta_0: multiply by the factors of `fluid.units`.
"""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

from viscotrain.errors import FluidError
from viscotrain.flow.duct import DuctFlow, rectangle_flow
from viscotrain.fluid.channel import CrossSection
from viscotrain.fluid.parameters import DimensionlessFluid
from viscotrain.fluid.pipe import pipe_flow
from viscotrain.fluid.shear import shear_viscosity
from viscotrain.fluid.wall import wall_shear_rate
from viscotrain.trains.variables import described
from viscotrain.words import DEBORAH_NUMBERS

QUANTITIES = {
    "centreline_velocity": "largest velocity, on the axis, over mean velocity",
    "pressure_gradient": "minus pressure gradient, in zero-shear viscosity times mean velocity "
    "over squared channel diameter",
    "largest_wall_shear_rate": "largest shear rate at the wall, in mean velocity over channel "
    "diameter",
    "mean_wall_shear_rate": "shear rate at the wall, mean over its perimeter, in mean velocity "
    "over channel diameter",
}
WALL_VISCOSITY = "viscosity at the largest shear rate at the wall over zero-shear viscosity"
UNKNOWN = DuctFlow(math.nan, math.nan, math.nan, math.nan)


def channel_flow(
    fluid: DimensionlessFluid, longest_modes: Mapping[float, float], section: CrossSection
) -> xr.Dataset:
    """The flow at all Deborah numbers of a study.

    Args:
        fluid: In eta_0 and lambda_1.
        longest_modes: lambda_1 Ubar/D by the Deborah number as the study defines it.
        section: Of the channel.

    Returns:
        Dataset over `deborah` with the variables of `QUANTITIES`, `wall_viscosity` and `reason`;
        NaN with a reason where the flow is not unique.
    """
    flows, reasons, thinned = [], [], []
    for De in longest_modes.values():
        flow, reason = _one(fluid, De, section)
        flows.append(flow)
        reasons.append(reason)
        rate = np.array(flow.largest_wall_shear_rate)
        thinned.append(float(shear_viscosity(rate, fluid, De)))
    dims = ["deborah"]
    values = dict(zip(QUANTITIES, np.array(flows).T, strict=True))
    found = {name: described(values[name], dims, text) for name, text in QUANTITIES.items()}
    found["wall_viscosity"] = described(thinned, dims, WALL_VISCOSITY)
    found["deborah_longest_mode"] = described(
        list(longest_modes.values()), dims, DEBORAH_NUMBERS["deborah_longest_mode"]
    )
    found["reason"] = xr.Variable(dims, reasons, {"long_name": "why there is no flow"})
    found["deborah"] = described(list(longest_modes), dims, DEBORAH_NUMBERS["deborah"])
    return xr.Dataset(found, attrs=section.attributes).set_coords("deborah")


def _one(fluid: DimensionlessFluid, De: float, section: CrossSection) -> tuple[DuctFlow, str]:
    """The flow and an empty reason, or no flow and why."""
    try:
        if section.is_duct:
            return rectangle_flow(fluid, De, section.aspect_ratio), ""
        flow = pipe_flow(fluid, De)
        at_wall = wall_shear_rate(fluid, De, flow)
    except FluidError as error:
        return UNKNOWN, str(error)
    return DuctFlow(*flow, at_wall, at_wall), ""


def summary(found: xr.Dataset) -> str:
    """The flow in lines of text."""
    lines = ["De        U_max/Ubar  -dp/dz/(eta_0 Ubar/D^2)  wall rate/(Ubar/D): largest, mean"]
    for n, De in enumerate(found["deborah"].values):
        own = found.isel(deborah=n)
        u, G, largest, mean = (float(own[name]) for name in QUANTITIES)
        words = f"{u:<12.6f}{G:<25.6g}{largest:.5g}, {mean:.5g}"
        lines.append(f"{De:<10g}" + (str(own["reason"].values) or words))
    return "\n".join([*filter(None, [found.attrs.get("channel")]), *lines])
