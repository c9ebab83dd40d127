"""Check of the table: its interpolation error, at geometries between the nodes."""

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from viscotrain.errors import TableError
from viscotrain.table.assembly import combine, spread, triplet_of
from viscotrain.table.attributes import ERRORS, PRESENT, described
from viscotrain.table.interpolation import TripletVelocities, VelocityTable
from viscotrain.table.points import incomplete
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
    pair: Sequence[float] | None = None,
    line_spacing: int = 1,
    accuracy: float = math.inf,
    relative_accuracy: float = 0.0,
    max_holes: int = 0,
) -> xr.Dataset:
    """Combine the results of the grid's geometries; those off the grid check the interpolation.

    Args:
        results: One dataset per geometry, as for `combine`.
        sp: Distances of the grid in d.
        sf: The same on the other axis.
        deborah: Deborah numbers of the grid.
        pair: Distances of pairs alone in d; None for those of the grid.
        line_spacing: As for `combine`.
        accuracy: Error of relative velocities in Ubar that points between the lines may cost.
        relative_accuracy: The same as a share of the largest relative velocity of a geometry; the
            larger one of both counts.
        max_holes: Points that may be without a solution.

    Raises:
        TableError: As `combine` does, or what lies between the lines is not accurate enough.
    """
    nodes = set(itertools.product(sp, sf)) | {(s, math.inf) for s in pair or ()}
    on_grid = [result for result in results if triplet_of(result) in nodes]
    between = [result for result in results if triplet_of(result) not in nodes]
    table = combine(
        on_grid,
        sp=sp,
        sf=sf,
        deborah=deborah,
        pair=pair,
        line_spacing=line_spacing,
        max_holes=max_holes,
    )
    if not between:
        return table
    table = check_errors(table, between)
    if line_spacing > 1:
        for De in table["deborah"].values:
            _refuse_error(table.sel(deborah=De), accuracy, relative_accuracy)
    return table


def _refuse_error(layer: xr.Dataset, accuracy: float, relative_accuracy: float):
    """Raise TableError where interpolation at one De is worse than the simulations are asked for.

    A check cannot tell more than simulations can: the estimated error of its own counts as what is
    asked for, if it is larger. One that was not solved, or where the table has holes, says nothing.
    """
    U = layer["check_velocity"].transpose("check", "particle").values
    error = np.abs(layer["check_error"].transpose("check", "pair").values).max(axis=-1)
    allowed = np.maximum(accuracy, relative_accuracy * np.abs(np.diff(U, axis=-1)).max(axis=-1))
    allowed = np.fmax(allowed, layer["check_simulation_error"].values)
    De, wrong = float(layer["deborah"]), error > allowed
    if not wrong.any():
        return
    lines = [
        f"  sp {layer['check_sp'].values[n]:g}, sf {layer['check_sf'].values[n]:g}: "
        f"{error[n]:.1e} Ubar; allowed: {allowed[n]:.1e}"
        for n in np.flatnonzero(wrong)
    ]
    raise TableError(
        f"relative velocities at De {De:g}, between lines of the grid that are simulated, are "
        f"wrong at {wrong.sum()} of {wrong.size} geometries between the nodes\n"
        + "\n".join(lines)
        + "\nMake table.line_spacing smaller, or add distances to `table`: simulations that are "
        "there are kept."
    )


def check_errors(table: xr.Dataset, results: Sequence[xr.Dataset]) -> xr.Dataset:
    """The table with its interpolation error at geometries between the nodes.

    Args:
        table: What `combine` made.
        results: One dataset per geometry, as for `combine`.

    Returns:
        The table with check_sp, check_sf (check), check_velocity (deborah, check, particle) and
        check_error (deborah, check, pair), the relative velocity interpolated minus simulated, and
        check_simulation_error (deborah, check), the estimated error of the latter.
        Errors are NaN where the table has holes or the geometry was not solved.
    """
    geometries = sorted({triplet_of(result) for result in results})
    sp, sf = np.array(geometries).T
    De = table["deborah"].values
    shape = De.size, len(geometries), len(PARTICLES)
    simulated, interpolated = np.full(shape, np.nan), np.full(shape, np.nan)
    estimated = np.full(shape[:-1], np.nan)
    interpolants = list(layers(table))
    for result in spread(results, geometries):
        n = geometries.index(triplet_of(result))
        for k in np.flatnonzero(np.isin(De, result["deborah"])):
            point = result.sel(deborah=De[k], particle=list(PARTICLES))
            simulated[k, n] = point["velocity"].values
            if ERRORS[1] in point:
                estimated[k, n] = point[ERRORS[1]].max()
            interpolant = interpolants[k]
            if interpolant is not None and has_solution(point["status"]):
                interpolated[k, n] = interpolant(*_distances(point))
    errors = np.diff(interpolated, axis=-1) - np.diff(simulated, axis=-1)
    return described(
        table.assign(
            check_velocity=(("deborah", "check", "particle"), simulated),
            check_error=(("deborah", "check", "pair"), errors),
            check_simulation_error=(("deborah", "check"), estimated),
        ).assign_coords(check_sp=("check", sp), check_sf=("check", sf))
    )


def _distances(point: xr.Dataset) -> tuple[float, float]:
    """Those at which the velocities of a result hold."""
    sp, sf = PRESENT if PRESENT[0] in point else ("sp", "sf")
    return float(point[sp]), float(point[sf])


def layers(table: xr.Dataset) -> Iterator[TripletVelocities | None]:
    """The interpolant at every Deborah number, None where the table has holes."""
    velocities = VelocityTable(table)
    broken = incomplete(table)
    for De in velocities.deborah:
        yield None if De in broken else velocities.at(De)
