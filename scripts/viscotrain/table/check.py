"""Check of the table: its interpolation error, at geometries between the nodes."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from viscotrain.table.assembly import combine, spread, triplet_of
from viscotrain.table.attributes import PRESENT, described
from viscotrain.table.interpolation import TripletVelocities, VelocityTable
from viscotrain.table.points import holes
from viscotrain.words import (
    PARTICLES,
    has_solution,
)


def combine_and_check(
    results: Sequence[xr.Dataset],
    *,
    sp: Sequence[float],
    sf: Sequence[float],
    deborah: Sequence[float],
    max_holes: int = 0,
) -> xr.Dataset:
    """Combine the results of the grid's geometries; those off the grid check the interpolation.

    Args:
        results: One dataset per geometry, as for `combine`.
        sp: Distances of the grid in d.
        sf: The same on the other axis.
        deborah: Deborah numbers of the grid.
        max_holes: Points that may be without a solution.

    Raises:
        TableError: As `combine` does.
    """
    nodes = set(itertools.product(sp, sf))
    on_grid = [result for result in results if triplet_of(result) in nodes]
    between = [result for result in results if triplet_of(result) not in nodes]
    table = combine(on_grid, sp=sp, sf=sf, deborah=deborah, max_holes=max_holes)
    return check_errors(table, between) if between else table


def check_errors(table: xr.Dataset, results: Sequence[xr.Dataset]) -> xr.Dataset:
    """The table with its interpolation error at geometries between the nodes.

    Args:
        table: What `combine` made.
        results: One dataset per geometry, as for `combine`.

    Returns:
        The table with check_sp, check_sf (check), check_velocity (deborah, check, particle) and
        check_error (deborah, check, pair), the relative velocity interpolated minus simulated.
        Errors are NaN where the table has holes or the geometry was not solved.
    """
    geometries = sorted({triplet_of(result) for result in results})
    sp, sf = np.array(geometries).T
    De = table["deborah"].values
    shape = De.size, len(geometries), len(PARTICLES)
    simulated, interpolated = np.full(shape, np.nan), np.full(shape, np.nan)
    interpolants = list(layers(table))
    for result in spread(results, geometries):
        n = geometries.index(triplet_of(result))
        for k in np.flatnonzero(np.isin(De, result["deborah"])):
            point = result.sel(deborah=De[k], particle=list(PARTICLES))
            simulated[k, n] = point["velocity"].values
            interpolant = interpolants[k]
            if interpolant is not None and has_solution(point["status"]):
                interpolated[k, n] = interpolant(*_distances(point))
    errors = np.diff(interpolated, axis=-1) - np.diff(simulated, axis=-1)
    return described(
        table.assign(
            check_velocity=(("deborah", "check", "particle"), simulated),
            check_error=(("deborah", "check", "pair"), errors),
        ).assign_coords(check_sp=("check", sp), check_sf=("check", sf))
    )


def _distances(point: xr.Dataset) -> tuple[float, float]:
    """Those at which the velocities of a result hold."""
    sp, sf = PRESENT if PRESENT[0] in point else ("sp", "sf")
    return float(point[sp]), float(point[sf])


def layers(table: xr.Dataset) -> Iterator[TripletVelocities | None]:
    """The interpolant at every Deborah number, None where the table has holes."""
    velocities = VelocityTable(table)
    broken = {De for De, _, _ in holes(table)}
    for De in velocities.deborah:
        yield None if De in broken else velocities.at(De)
