"""Variables of the table: names, codes, and what they mean."""

from typing import Any

import numpy as np
import xarray as xr

from viscotrain.words import (
    BEYOND_QUASI_STEADY,
    INACCURATE,
    NOT_ATTEMPTED,
    NOT_CONVERGED,
    QUASI_STEADY_LIMIT,
    SOLVED,
)

ITSELF, SAME_PAIR, MIRROR, INTERPOLATED = map(np.int8, range(4))
ERRORS = ("velocity_error", "relative_velocity_error")  # estimated by the simulation
PRESENT = ("present_sp", "present_sf")  # of transient results: distances at that time
PRESENT_PAIR = "present_pair_distance"
DEBORAH_COORDINATES = ("deborah_longest_mode", "deborah_mean_relaxation_time")
BEYOND = f"above {QUASI_STEADY_LIMIT:g}: {BEYOND_QUASI_STEADY}"  # comment of memory numbers
ATTRIBUTES: dict[str, dict[str, Any]] = {
    "deborah": {"long_name": "Deborah number, as the study defines it", "units": "1"},
    "sp": {
        "long_name": "distance of middle to trailing sphere, centre to centre over diameter",
        "units": "1",
        "comment": "inf: no trailing sphere",
    },
    "sf": {
        "long_name": "distance of leading to middle sphere, centre to centre over diameter",
        "units": "1",
        "comment": "inf: no leading sphere",
    },
    "particle": {"long_name": "sphere of the triplet, named along the flow"},
    "pair": {"long_name": "spheres whose relative velocity it is"},
    "velocity": {
        "long_name": "velocity of the sphere over mean velocity of the flow",
        "units": "1",
        "comment": "a sphere that is not there has the velocity of a single sphere",
    },
    "pressure_gradient": {
        "long_name": "minus far pressure gradient, in zero-shear viscosity times mean velocity "
        "over squared channel diameter",
        "units": "1",
    },
    "centreline_velocity": {
        "long_name": "centreline velocity of the undisturbed flow over its mean velocity",
        "units": "1",
    },
    "status": {
        "long_name": "outcome of the simulation",
        "flag_values": np.array([SOLVED, NOT_CONVERGED, NOT_ATTEMPTED, INACCURATE], np.int8),
        "flag_meanings": "solved not_converged not_attempted inaccurate",
        "comment": "inaccurate: solved, with an estimated error above what is allowed, or none",
    },
    "velocity_error": {
        "long_name": "estimated discretisation error of the velocity of the middle sphere of the "
        "simulation, over mean velocity of the flow",
        "units": "1",
    },
    "relative_velocity_error": {
        "long_name": "estimated discretisation error of the relative velocity of two spheres, "
        "over mean velocity of the flow",
        "units": "1",
        "comment": "NaN: no such pair, no solution or no estimate",
    },
    "origin": {
        "long_name": "simulation that the velocities are from",
        "flag_values": np.array([ITSELF, SAME_PAIR, MIRROR, INTERPOLATED]),
        "flag_meanings": "itself same_pair_with_other_names mirror_image_at_deborah_0 "
        "interpolated_change_from_the_deborah_number_before",
    },
    "pair_distance": {
        "long_name": "distance of two spheres without other neighbours, centre to centre over "
        "diameter",
        "units": "1",
    },
    "particle_of_pair": {"long_name": "sphere of the pair, named along the flow"},
    "pair_velocity": {
        "long_name": "velocity of a sphere of a pair over mean velocity of the flow",
        "units": "1",
    },
    "pair_status": {"long_name": "outcome of the simulation of the pair", "comment": "as status"},
    "pair_error": {
        "long_name": "estimated discretisation error of the relative velocity of the pair, over "
        "mean velocity of the flow",
        "units": "1",
    },
    "memory_number": {
        "long_name": "diameters that a gap changes within the longest relaxation time",
        "units": "1",
        "comment": f"of the faster gap; {BEYOND}",
    },
    "pair_memory_number": {
        "long_name": "diameters that the gap of a pair changes within the longest relaxation time",
        "units": "1",
        "comment": BEYOND,
    },
    "fallback": {
        "long_name": "1 where the iteration was stuck, and the mesh of the start was taken in "
        "short steps of the Deborah number",
        "units": "1",
    },
    "present_sp": {
        "long_name": "distance of middle to trailing sphere after the start-up, over diameter",
        "units": "1",
    },
    "present_sf": {
        "long_name": "distance of leading to middle sphere after the start-up, over diameter",
        "units": "1",
    },
    "present_pair_distance": {
        "long_name": "distance of two spheres alone after the start-up, over diameter",
        "units": "1",
    },
    "check_sp": {
        "long_name": "distance of middle to trailing sphere of a geometry between the nodes",
        "units": "1",
    },
    "diameter_ratio": {
        "long_name": "diameter of a single sphere over that of the spheres of the table",
        "units": "1",
    },
    "single_velocity": {
        "long_name": "velocity of a single sphere over mean velocity of the flow",
        "units": "1",
    },
    "single_velocity_error": {
        "long_name": "estimated discretisation error of single_velocity",
        "units": "1",
    },
    "size_response": {
        "long_name": "change of a single sphere's velocity with the logarithm of its diameter, "
        "over mean velocity of the flow",
        "units": "1",
        "comment": "from the two diameters next to that of the table; NaN: not solved",
    },
    "size_response_error": {
        "long_name": "error of size_response, over mean velocity of the flow",
        "units": "1",
        "comment": "its difference from that of the two farther diameters, and the estimated "
        "errors of the simulations",
    },
    "check_sf": {
        "long_name": "distance of leading to middle sphere of a geometry between the nodes",
        "units": "1",
    },
    "check_velocity": {
        "long_name": "simulated velocity of the sphere over mean velocity of the flow",
        "units": "1",
    },
    "check_simulation_error": {
        "long_name": "estimated error of the simulated relative velocities, over mean velocity of "
        "the flow",
        "units": "1",
    },
    "check_error": {
        "long_name": "relative velocity of two spheres over mean velocity of the flow, "
        "interpolated minus simulated",
        "units": "1",
    },
}


def described(table: xr.Dataset) -> xr.Dataset:
    """Add attributes to the variables that have none."""
    for name, variable in table.variables.items():
        if not variable.attrs:
            variable.attrs.update(ATTRIBUTES.get(str(name), {}))
    return table
