"""Points of the table: which are holes, which are not accurate, and their errors."""

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr

from viscotrain.table.attributes import ERRORS, INTERPOLATED
from viscotrain.words import INACCURATE, has_solution


def holes(table: xr.Dataset) -> Iterator[tuple[float, float, float]]:
    """Every (De, sp, sf) that has no solution: a status says so, or a velocity is not finite.

    Pairs at distances between those of triplets follow, as (De, s, inf).
    """
    good = (abs(table["velocity"]) < np.inf).all("particle") & has_solution(table["status"])
    for k, i, j in np.argwhere(~good.transpose("deborah", "sp", "sf").values):
        yield float(table["deborah"][k]), float(table["sp"][i]), float(table["sf"][j])
    good = has_solution(table["pair_status"])
    good &= (abs(table["pair_velocity"]) < np.inf).all("particle_of_pair")
    nodes = {*table["sp"].values, *table["sf"].values}
    for k, n in np.argwhere(~good.transpose("deborah", "pair_distance").values):
        if (s := float(table["pair_distance"][n])) not in nodes:
            yield float(table["deborah"][k]), s, math.inf


def incomplete(table: xr.Dataset) -> frozenset[float]:
    """The Deborah numbers at which there is no interpolant, since the table has holes."""
    return frozenset(De for De, *_ in holes(table))


def count(table: xr.Dataset) -> int:
    """Points (De, sp, sf) of the grid, and pairs at distances between its own."""
    nodes = {*table["sp"].values, *table["sf"].values}
    between = [s for s in table["pair_distance"].values if s not in nodes]
    return table["status"].size + table.sizes["deborah"] * len(between)


def point_error(table: xr.Dataset) -> xr.DataArray:
    """Estimated error that counts, in Ubar: of relative velocities, of U without a neighbour.

    Args:
        table: The table, or a part of it.

    Returns:
        Of the shape of its status; NaN without an estimate.
    """
    relative = table["relative_velocity_error"].max("pair")
    return relative.where(np.isfinite(relative), table["velocity_error"])


def fallback_points(table: xr.Dataset) -> int:
    """Points that were solved on the mesh of the start only, since the iteration was stuck."""
    return int((table["fallback"] == 1).sum()) if "fallback" in table else 0


def interpolated_points(table: xr.Dataset) -> int:
    """Points between the lines of the grid that are simulated."""
    return int((table["origin"] == INTERPOLATED).sum())


def inaccurate_points(table: xr.Dataset) -> int:
    """Points whose estimated error is above what the study allows, or that have no estimate."""
    return int((table["status"] == INACCURATE).sum())


def largest_error(layer: xr.Dataset) -> float:
    """Largest error of relative velocities at one De, in Ubar; NaN if it was not measured.

    That of the interpolation, found between the nodes, plus that of the simulations, as far as it
    is estimated.
    """
    if "check_error" not in layer or not np.isfinite(layer["check_error"]).any():
        return math.nan
    discretisation = float(layer[ERRORS[1]].max()) if ERRORS[1] in layer else 0.0
    return float(np.abs(layer["check_error"]).max()) + np.nan_to_num(discretisation)
