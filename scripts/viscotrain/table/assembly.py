"""Assembly of the velocity table: results of all geometries on one grid.

Dimensions are (deborah, sp, sf, particle): sp and sf are the distances of the middle sphere to the
trailing and to the leading one, centre to centre in d; infinity means no such neighbour. A point
(De, sp, sf) without a solution is a hole: NaN with a status, never filled.

Two spheres alone are simulated at more distances (`pair_distance`); at the distances of the grid
they are the same simulations.

Triplets that are the same flow (`triplets`) are simulated once; `spread` gives the result to both,
and `origin` tells which points these are.
"""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from viscotrain.errors import TableError
from viscotrain.table.attributes import (
    ATTRIBUTES,
    DEBORAH_COORDINATES,
    ERRORS,
    ITSELF,
    MIRROR,
    PRESENT,
    PRESENT_PAIR,
    SAME_PAIR,
    described,
)
from viscotrain.table.cross_approximation import fill_between
from viscotrain.table.interpolation import MOST_NAMED, name_geometries
from viscotrain.table.memory import with_memory_numbers
from viscotrain.table.points import count, holes
from viscotrain.table.present import to_nodes
from viscotrain.table.triplets import Triplet, twin
from viscotrain.words import (
    LEADING,
    MIDDLE,
    NOT_ATTEMPTED,
    OF_A_PAIR,
    PAIRS,
    PARTICLES,
    TRAILING,
    has_solution,
)

OF_PAIRS = ("deborah", "pair_distance")


def combine(
    results: Iterable[xr.Dataset],
    *,
    sp: Sequence[float],
    sf: Sequence[float],
    deborah: Sequence[float],
    pair: Sequence[float] | None = None,
    line_spacing: int = 1,
    max_holes: int = 0,
) -> xr.Dataset:
    """Put the results of all geometries on the grid of the table.

    Args:
        results: One dataset per geometry as the dns stage writes it, in any order: velocity
            (deborah, particle), pressure_gradient, centreline_velocity and status (deborah), and
            the scalars sp, sf and confinement; velocity_error (deborah) and
            relative_velocity_error (deborah, pair) if errors are estimated. A point that is missing
            is that of its twin, or a hole. Transient ones, as `after_start_up` makes them, come one
            per geometry and De.
        sp: Distances of the grid in d, ascending, the last one infinite.
        sf: The same on the other axis.
        deborah: Deborah numbers of the grid, ascending, in the definition of the study.
        pair: Distances of pairs alone in d, ascending; None for those of the grid.
        line_spacing: Distances from one line of the grid that is simulated to the next, see
            `cross_approximation`.
        max_holes: Points (De, sp, sf) that may be without a solution.

    Raises:
        TableError: A geometry is not on the grid or comes twice, or there are too many holes.
    """
    finite = sorted({s for s in (*sp, *sf) if math.isfinite(s)})
    table = _empty(sp, sf, deborah, finite if pair is None else pair)
    wanted = [*itertools.product(sp, sf), *((s, math.inf) for s in table["pair_distance"].values)]
    reasons: dict[tuple[float, float, float], str] = {}
    seen: set[tuple[float, ...]] = set()
    parts = spread(results, wanted)
    for result in parts:
        geometry = triplet_of(result)
        points = {(*geometry, De) for De in result["deborah"].values}
        if points & seen:
            raise TableError(f"{name_geometries([geometry])} comes twice; allowed: once")
        seen |= points
        _insert(table, result, reasons)
    _complete(table)
    if PRESENT[0] in table:
        table = to_nodes(table)
    if line_spacing > 1:
        fill_between(table, line_spacing)
    _refuse_holes(table, max_holes, reasons)
    return with_memory_numbers(table, float(parts[0]["confinement"]))


def spread(results: Iterable[xr.Dataset], grid: Iterable[Triplet]) -> list[xr.Dataset]:
    """Results, and what they are for the twins of their triplets.

    Args:
        results: As for `combine`.
        grid: Triplets (sp, sf) whose velocities are wanted.

    Returns:
        The results as they are, and one per point of the grid that has no simulation of its own
        but a twin that has: the twin's result under other names, with an `origin`.
    """
    results = list(results)
    known = {(*triplet_of(part), De): part for part in results for De in part["deborah"].values}
    deborahs = sorted({De for *_, De in known})
    turned = []
    for (sp, sf), De in itertools.product(grid, deborahs):
        other = twin(sp, sf, De)
        if other and (sp, sf, De) not in known and (*other, De) in known:
            turned.append(_turned(known[*other, De].sel(deborah=[De]), sp, sf))
    return results + turned


def _turned(result: xr.Dataset, sp: float, sf: float) -> xr.Dataset:
    """The result of a triplet's twin, with the names that the spheres have in the triplet."""
    U = result["velocity"].sel(particle=list(PARTICLES)).transpose("deborah", "particle").values
    if np.isfinite([sp, sf]).all():
        U, origin = U[:, ::-1], MIRROR
    else:
        # Trailing and middle become middle and leading, or back; the third is not there.
        U, origin = np.roll(U, 1 if np.isinf(sp) else -1, axis=-1), SAME_PAIR
    present: dict[str, Any] = {
        name: result[other]
        for name, other in zip(PRESENT, PRESENT[::-1], strict=True)
        if other in result
    }
    turned = result.assign(
        velocity=(("deborah", "particle"), U), sp=sp, sf=sf, origin=origin, **present
    ).assign_coords(particle=list(PARTICLES))
    if ERRORS[1] in result:
        error = result[ERRORS[1]].sel(pair=list(PAIRS)).transpose("deborah", "pair").values
        turned[ERRORS[1]] = (("deborah", "pair"), error[:, ::-1])
        turned = turned.assign_coords(pair=list(PAIRS))
    return turned


def triplet_of(result: xr.Dataset) -> Triplet:
    """Distances (sp, sf) of a result, in d."""
    return float(result["sp"]), float(result["sf"])


def _complete(table: xr.Dataset):
    """Give spheres that are not there the velocity of a single sphere, in place.

    So the table has values everywhere, and leads continuously to pairs and single spheres.
    """
    single = table["velocity"].isel(sp=-1, sf=-1, particle=MIDDLE)
    U = table["velocity"]
    for particle, axis in ((TRAILING, "sp"), (LEADING, "sf")):
        solved = has_solution(table["status"].isel({axis: -1}))
        at = {axis: -1, "particle": particle}
        U[at] = U.isel(at).where(~solved, single)


def _empty(sp, sf, deborah, pair) -> xr.Dataset:
    grid = ("deborah", "sp", "sf")
    shape = len(deborah), len(sp), len(sf)
    pairs = len(deborah), len(pair)
    table = xr.Dataset(
        {
            "velocity": ((*grid, "particle"), np.full((*shape, len(PARTICLES)), np.nan)),
            "pressure_gradient": (grid, np.full(shape, np.nan)),
            "velocity_error": (grid, np.full(shape, np.nan)),
            "relative_velocity_error": ((*grid, "pair"), np.full((*shape, len(PAIRS)), np.nan)),
            "status": (grid, np.full(shape, NOT_ATTEMPTED, dtype=np.int8)),
            "origin": (grid, np.full(shape, ITSELF)),
            "fallback": (grid, np.zeros(shape, dtype=np.int8)),
            "pair_velocity": ((*OF_PAIRS, "particle_of_pair"), np.full((*pairs, 2), np.nan)),
            "pair_error": (OF_PAIRS, np.full(pairs, np.nan)),
            "pair_status": (OF_PAIRS, np.full(pairs, NOT_ATTEMPTED, dtype=np.int8)),
            "centreline_velocity": ("deborah", np.full(len(deborah), np.nan)),
        },
        coords={
            "deborah": np.asarray(deborah, dtype=float),
            "sp": np.asarray(sp, dtype=float),
            "sf": np.asarray(sf, dtype=float),
            "pair_distance": np.asarray(pair, dtype=float),
            "particle": list(PARTICLES),
            "particle_of_pair": list(OF_A_PAIR),
            "pair": list(PAIRS),
        }
        | {name: ("deborah", np.full(len(deborah), np.nan)) for name in DEBORAH_COORDINATES},
    )
    return described(table)


def _insert(table: xr.Dataset, result: xr.Dataset, reasons: dict):
    """Write one geometry's results into the table, in place."""
    sp, sf = triplet_of(result)
    i, j, n = (
        np.flatnonzero(table[name] == value)
        for name, value in (("sp", sp), ("sf", sf), ("pair_distance", min(sp, sf)))
    )
    on_grid, pair = i.size and j.size, n.size and math.isinf(max(sp, sf))
    if not (on_grid or pair):
        raise TableError(
            f"{name_geometries([(sp, sf)])} is not on the grid; allowed: "
            f"sp in {table['sp'].values.tolist()}, sf in {table['sf'].values.tolist()}, "
            f"pairs at {table['pair_distance'].values.tolist()}"
        )
    result = result.sel(particle=list(PARTICLES))
    if "pair" in result.dims:
        result = result.sel(pair=list(PAIRS))
    for k, De in enumerate(table["deborah"].values):
        if De not in result["deborah"]:
            continue
        point = result.sel(deborah=De)
        if on_grid:
            _insert_point(table, (k, int(i[0]), int(j[0])), point)
        if pair:
            _insert_pair(table, (k, int(n[0])), point)
        if np.isnan(table["centreline_velocity"][k]):
            table["centreline_velocity"][k] = point["centreline_velocity"]
        for name in DEBORAH_COORDINATES:
            if name in point.coords:
                table[name][k] = point[name]
                table[name].attrs = dict(result[name].attrs)
        if "reason" in point and str(point["reason"].item()):
            reasons[De, sp, sf] = str(point["reason"].item())


def _insert_point(table: xr.Dataset, at: tuple[int, int, int], point: xr.Dataset):
    """Write the result of a triplet at one De into the grid, in place."""
    for name in ("velocity", "pressure_gradient", "status"):
        table[name][at] = point[name]
    table["origin"][at] = point.get("origin", ITSELF)
    table["fallback"][at] = point.get("fallback", 0)
    for name in ERRORS:
        if name in point:
            table[name][at] = point[name]
    for name in PRESENT:
        if name in point:
            _present(table, name, "status")[at] = point[name]


def _insert_pair(table: xr.Dataset, at: tuple[int, int], point: xr.Dataset):
    """Write the result of two spheres alone at one De, in place."""
    behind = TRAILING if math.isfinite(point["sp"]) else MIDDLE
    table["pair_velocity"][at] = point["velocity"].values[behind : behind + 2]
    table["pair_status"][at] = point["status"]
    if ERRORS[1] in point:
        table["pair_error"][at] = point[ERRORS[1]].values[behind]
    if PRESENT[0] in point:
        present = min(float(point[name]) for name in PRESENT)
        _present(table, PRESENT_PAIR, "pair_status")[at] = present


def _present(table: xr.Dataset, name: str, like: str) -> xr.DataArray:
    """The variable of present distances, made when first needed."""
    if name not in table:
        table[name] = xr.full_like(table[like], np.nan, dtype=float)
        table[name].attrs = ATTRIBUTES[name]
    return table[name]


def _refuse_holes(table: xr.Dataset, allowed: int, reasons: Mapping[tuple, str]):
    found = list(holes(table))
    if len(found) <= allowed:
        return
    lines = []
    for De, sp, sf in sorted(found, key=lambda point: point not in reasons)[:MOST_NAMED]:
        why = "not attempted"
        if sp in table["sp"] and sf in table["sf"]:
            at = {"deborah": De, "sp": sp, "sf": sf}
            if has_solution(table["status"].sel(at)):
                why = "needs the single sphere, which is not solved"
        lines.append(f"  De {De:g}, sp {sp:g}, sf {sf:g}: {reasons.get((De, sp, sf), why)}")
    if len(found) > MOST_NAMED:
        lines.append(f"  and {len(found) - MOST_NAMED} more")
    raise TableError(
        f"{len(found)} of {count(table)} points have no solution; "
        f"allowed: {allowed} (table.max_holes)\n"
        + "\n".join(lines)
        + "\nSolve them with other settings in `dns`, take their distances or De out of the "
        "study, or raise table.max_holes: holes stay empty, and trains at their De will not run."
    )
