"""Transient results as points of the table: velocities carried from present distances to nodes.

Transient results hold at the distances that the spheres have when the start-up is over, not quite
those of the nodes they started from. Cubic radial basis functions in 1/s through these points
(scipy's RBFInterpolator) carry the velocities to the nodes. Where gaps have opened at the closest
node, or closed at the farthest, this extrapolates by as much as they have moved.
"""

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import RBFInterpolator

from viscotrain.table.attributes import DEBORAH_COORDINATES, PRESENT, PRESENT_PAIR
from viscotrain.table.interpolation import coordinate
from viscotrain.words import (
    PARTICLES,
    has_solution,
)

FEWEST_POINTS = 3  # that determine a plane


def after_start_up(trajectory: xr.Dataset) -> xr.Dataset:
    """The end of a transient simulation of a triplet, as a result for `combine`.

    Args:
        trajectory: What the transient stage writes: velocity (time, sphere), distance (time, gap),
            pressure_gradient (time), status and the initial sp and sf.
    """
    end = trajectory.isel(time=-1)
    solved = bool(has_solution(end["status"]))
    U = end["velocity"].rename(sphere="particle").reindex(particle=list(PARTICLES))
    distances = iter(end["distance"].values)
    present = [next(distances) if np.isfinite(end[name]) else np.inf for name in ("sp", "sf")]
    result = xr.Dataset(
        {"velocity": U, "pressure_gradient": end["pressure_gradient"]}
        | dict(zip(PRESENT, present, strict=True))
    )
    result = result.where(solved).assign(
        {name: end[name] for name in ("status", "reason", "centreline_velocity")}
    )
    result = result.drop_vars("time").expand_dims(deborah=[float(end["deborah"])])
    return result.assign(
        {name: end[name].drop_vars("time") for name in ("sp", "sf", "confinement")}
    ).assign_coords({name: ("deborah", [float(end[name])]) for name in DEBORAH_COORDINATES})


def at_end(result: xr.Dataset) -> xr.Dataset:
    """A result of either method, as one for `combine`."""
    return after_start_up(result) if "time" in result.dims else result


def to_nodes(table: xr.Dataset) -> xr.Dataset:
    """Velocities at the nodes, from those at the present distances."""
    table = table.copy(deep=True)
    grid = np.stack(np.meshgrid(coordinate(table["sp"]), coordinate(table["sf"]), indexing="ij"))
    pair = coordinate(table["pair_distance"])[None]
    for k in range(table.sizes["deborah"]):
        layer = table.isel(deborah=k)
        now = np.stack([layer[name].transpose("sp", "sf") for name in PRESENT])
        U = layer["velocity"].transpose("sp", "sf", "particle").values
        table["velocity"][k] = _carried(coordinate(now), grid, U)
        now = layer[PRESENT_PAIR].values[None]
        U = layer["pair_velocity"].transpose("pair_distance", "particle_of_pair").values
        table["pair_velocity"][k] = _carried(coordinate(now), pair, U)
    return table


def _carried(now: NDArray, nodes: NDArray, velocity: NDArray) -> NDArray:
    """Velocities at nodes from those at other points, where there are some.

    Args:
        now: Coordinates of the points, shape (n, ...) for n distances.
        nodes: The same of the nodes.
        velocity: At the points, shape (..., spheres).
    """
    known = np.isfinite(velocity).all(axis=-1) & np.isfinite(now).all(axis=0)
    if known.sum() < FEWEST_POINTS or (now == nodes)[:, known].all():
        return velocity
    carry = RBFInterpolator(now[:, known].T, velocity[known], kernel="cubic", degree=1)
    velocity = velocity.copy()
    velocity[known] = carry(nodes[:, known].T)
    return velocity
