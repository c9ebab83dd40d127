"""The velocity table: results of all geometries on one grid, checked between its nodes.

Dimensions are (deborah, sp, sf, particle): sp and sf are the distances of the middle sphere to the
trailing and to the leading one, centre to centre in d; infinity means no such neighbour. A point
(De, sp, sf) without a solution is a hole: NaN with a status, never filled.

Triplets that are the same flow (`triplets`) are simulated once; `spread` gives the result to both,
and `origin` tells which points these are.

Transient results hold at the distances that the spheres have when the start-up is over, not quite
those of the nodes they started from. Cubic radial basis functions in 1/s through these points
(scipy's RBFInterpolator) carry the velocities to the nodes. Where gaps have opened at the closest
node, or closed at the farthest, this extrapolates by as much as they have moved.
"""

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
import xarray as xr
from scipy.interpolate import RBFInterpolator

from viscotrain.errors import TableError
from viscotrain.table.interpolation import (
    MOST_NAMED,
    TripletVelocities,
    VelocityTable,
    coordinate,
    name_geometries,
)
from viscotrain.table.triplets import Triplet, twin
from viscotrain.words import (
    INACCURATE,
    LEADING,
    MIDDLE,
    NEGLIGIBLE,
    NOT_ATTEMPTED,
    NOT_CONVERGED,
    PAIRS,
    PARTICLES,
    SOLVED,
    TRAILING,
    has_solution,
)

FEWEST_POINTS = 3  # that determine a plane
ITSELF, SAME_PAIR, MIRROR = np.int8([0, 1, 2])
ERRORS = ("velocity_error", "relative_velocity_error")  # estimated by the simulation
PRESENT = ("present_sp", "present_sf")  # of transient results: distances at that time
DEBORAH_COORDINATES = ("deborah_longest_mode", "deborah_mean_relaxation_time")
ATTRIBUTES = {
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
        "flag_values": np.int8([SOLVED, NOT_CONVERGED, NOT_ATTEMPTED, INACCURATE]),
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
        "flag_values": np.int8([ITSELF, SAME_PAIR, MIRROR]),
        "flag_meanings": "itself same_pair_with_other_names mirror_image_at_deborah_0",
    },
    "present_sp": {
        "long_name": "distance of middle to trailing sphere after the start-up, over diameter",
        "units": "1",
    },
    "present_sf": {
        "long_name": "distance of leading to middle sphere after the start-up, over diameter",
        "units": "1",
    },
    "check_sp": {
        "long_name": "distance of middle to trailing sphere of a geometry between the nodes",
        "units": "1",
    },
    "check_sf": {
        "long_name": "distance of leading to middle sphere of a geometry between the nodes",
        "units": "1",
    },
    "check_velocity": {
        "long_name": "simulated velocity of the sphere over mean velocity of the flow",
        "units": "1",
    },
    "check_error": {
        "long_name": "relative velocity of two spheres over mean velocity of the flow, "
        "interpolated minus simulated",
        "units": "1",
    },
}


def combine(
    results: Iterable[xr.Dataset],
    *,
    sp: Sequence[float],
    sf: Sequence[float],
    deborah: Sequence[float],
    max_holes: int = 0,
    attributes: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """Put the results of all geometries on the grid of the table.

    Args:
        results: One dataset per geometry as the dns stage writes it, in any order: velocity
            (deborah, particle), pressure_gradient, centreline_velocity and status (deborah), and
            the scalars sp and sf; velocity_error (deborah) and relative_velocity_error (deborah,
            pair) if errors are estimated. A point that is missing is that of its twin, or a hole.
            Transient ones, as `after_start_up` makes them, come one per geometry and De.
        sp: Distances of the grid in d, ascending, the last one infinite.
        sf: The same on the other axis.
        deborah: Deborah numbers of the grid, ascending, in the definition of the study.
        max_holes: Points (De, sp, sf) that may be without a solution.
        attributes: Global attributes.

    Raises:
        TableError: A geometry is not on the grid or comes twice, or there are too many holes.
    """
    table = _empty(sp, sf, deborah, attributes or {})
    reasons: dict[tuple[float, float, float], str] = {}
    seen = set()
    for result in spread(results, itertools.product(sp, sf)):
        geometry = _triplet(result)
        points = {(*geometry, De) for De in result["deborah"].values}
        if points & seen:
            raise TableError(f"{name_geometries([geometry])} comes twice; allowed: once")
        seen |= points
        _insert(table, result, reasons)
    _complete(table)
    if PRESENT[0] in table:
        table = _to_nodes(table)
    _refuse_holes(table, max_holes, reasons)
    return table


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
    known = {(*_triplet(part), De): part for part in results for De in part["deborah"].values}
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
    present = {
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


def _triplet(result: xr.Dataset) -> Triplet:
    return float(result["sp"]), float(result["sf"])


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
        {name: end[name].drop_vars("time") for name in ("sp", "sf")}
    ).assign_coords({name: ("deborah", [float(end[name])]) for name in DEBORAH_COORDINATES})


def _to_nodes(table: xr.Dataset) -> xr.Dataset:
    """Velocities at the nodes, from those at the present distances."""
    table = table.copy(deep=True)
    nodes = np.stack(np.meshgrid(coordinate(table["sp"]), coordinate(table["sf"]), indexing="ij"))
    for k in range(table.sizes["deborah"]):
        U = table["velocity"][k].transpose("sp", "sf", "particle").values
        now = coordinate(np.stack([table[name][k].transpose("sp", "sf") for name in PRESENT]))
        known = np.isfinite(U).all(axis=-1) & np.isfinite(now).all(axis=0)
        if known.sum() < FEWEST_POINTS or (now == nodes)[:, known].all():
            continue
        carry = RBFInterpolator(now[:, known].T, U[known], kernel="cubic", degree=1)
        U[known] = carry(nodes[:, known].T)
        table["velocity"][k] = U
    return table


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


def _empty(sp, sf, deborah, attributes) -> xr.Dataset:
    grid = ("deborah", "sp", "sf")
    shape = len(deborah), len(sp), len(sf)
    table = xr.Dataset(
        {
            "velocity": ((*grid, "particle"), np.full((*shape, len(PARTICLES)), np.nan)),
            "pressure_gradient": (grid, np.full(shape, np.nan)),
            "velocity_error": (grid, np.full(shape, np.nan)),
            "relative_velocity_error": ((*grid, "pair"), np.full((*shape, len(PAIRS)), np.nan)),
            "status": (grid, np.full(shape, NOT_ATTEMPTED, dtype=np.int8)),
            "origin": (grid, np.full(shape, ITSELF)),
            "centreline_velocity": ("deborah", np.full(len(deborah), np.nan)),
        },
        coords={
            "deborah": np.asarray(deborah, dtype=float),
            "sp": np.asarray(sp, dtype=float),
            "sf": np.asarray(sf, dtype=float),
            "particle": list(PARTICLES),
            "pair": list(PAIRS),
        }
        | {name: ("deborah", np.full(len(deborah), np.nan)) for name in DEBORAH_COORDINATES},
        attrs=attributes,
    )
    return _described(table)


def _described(table: xr.Dataset) -> xr.Dataset:
    """Add attributes to the variables that have none."""
    for name, variable in table.variables.items():
        if not variable.attrs:
            variable.attrs.update(ATTRIBUTES.get(name, {}))
    return table


def _insert(table: xr.Dataset, result: xr.Dataset, reasons: dict):
    """Write one geometry's results into the table, in place."""
    sp, sf = float(result["sp"]), float(result["sf"])
    there = np.flatnonzero(table["sp"] == sp), np.flatnonzero(table["sf"] == sf)
    if not all(index.size for index in there):
        raise TableError(
            f"{name_geometries([(sp, sf)])} is not on the grid; allowed: "
            f"sp in {table['sp'].values.tolist()}, sf in {table['sf'].values.tolist()}"
        )
    i, j = (int(index[0]) for index in there)
    result = result.sel(particle=list(PARTICLES))
    if "pair" in result.dims:
        result = result.sel(pair=list(PAIRS))
    for k, De in enumerate(table["deborah"].values):
        if De not in result["deborah"]:
            continue
        point = result.sel(deborah=De)
        table["velocity"][k, i, j] = point["velocity"]
        table["pressure_gradient"][k, i, j] = point["pressure_gradient"]
        table["status"][k, i, j] = point["status"]
        table["origin"][k, i, j] = point.get("origin", ITSELF)
        if np.isnan(table["centreline_velocity"][k]):
            table["centreline_velocity"][k] = point["centreline_velocity"]
        for name in ERRORS:
            if name in point:
                table[name][k, i, j] = point[name]
        for name in PRESENT:
            if name in point:
                _present(table, name)[k, i, j] = point[name]
        for name in DEBORAH_COORDINATES:
            if name in point.coords:
                table[name][k] = point[name]
                table[name].attrs = dict(result[name].attrs)
        if "reason" in point and str(point["reason"].item()):
            reasons[De, sp, sf] = str(point["reason"].item())


def _present(table: xr.Dataset, name: str) -> xr.DataArray:
    """The variable of present distances, made when first needed."""
    if name not in table:
        table[name] = xr.full_like(table["pressure_gradient"], np.nan)
        table[name].attrs = ATTRIBUTES[name]
    return table[name]


def holes(table: xr.Dataset) -> Iterator[tuple[float, float, float]]:
    """Every (De, sp, sf) that has no solution: a status says so, or a velocity is not finite."""
    good = np.isfinite(table["velocity"]).all("particle") & has_solution(table["status"])
    for k, i, j in np.argwhere(~good.transpose("deborah", "sp", "sf").values):
        yield float(table["deborah"][k]), float(table["sp"][i]), float(table["sf"][j])


def _refuse_holes(table: xr.Dataset, allowed: int, reasons: Mapping[tuple, str]):
    found = list(holes(table))
    if len(found) <= allowed:
        return
    solved = has_solution(table["status"])
    lines = []
    for De, sp, sf in found[:MOST_NAMED]:
        incomplete = bool(solved.sel(deborah=De, sp=sp, sf=sf))
        why = "needs the single sphere, which is not solved" if incomplete else "not attempted"
        lines.append(f"  De {De:g}, sp {sp:g}, sf {sf:g}: {reasons.get((De, sp, sf), why)}")
    if len(found) > MOST_NAMED:
        lines.append(f"  and {len(found) - MOST_NAMED} more")
    points = table["status"].size
    raise TableError(
        f"{len(found)} of {points} points have no solution; allowed: {allowed} (table.max_holes)\n"
        + "\n".join(lines)
        + "\nSolve them with other settings in `dns`, take their distances or De out of the "
        "study, or raise table.max_holes: holes stay empty, and trains at their De will not run."
    )


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
    geometries = sorted({_triplet(result) for result in results})
    sp, sf = np.array(geometries).T
    De = table["deborah"].values
    shape = De.size, len(geometries), len(PARTICLES)
    simulated, interpolated = np.full(shape, np.nan), np.full(shape, np.nan)
    layers = list(_layers(table))
    for result in spread(results, geometries):
        n = geometries.index(_triplet(result))
        for k in np.flatnonzero(np.isin(De, result["deborah"])):
            point = result.sel(deborah=De[k], particle=list(PARTICLES))
            simulated[k, n] = point["velocity"].values
            if layers[k] is not None and has_solution(point["status"]):
                interpolated[k, n] = layers[k](*_distances(point))
    errors = np.diff(interpolated, axis=-1) - np.diff(simulated, axis=-1)
    return _described(
        table.assign(
            check_velocity=(("deborah", "check", "particle"), simulated),
            check_error=(("deborah", "check", "pair"), errors),
        ).assign_coords(check_sp=("check", sp), check_sf=("check", sf))
    )


def _distances(point: xr.Dataset) -> tuple[float, float]:
    """Those at which the velocities of a result hold."""
    names = PRESENT if PRESENT[0] in point else ("sp", "sf")
    return tuple(float(point[name]) for name in names)


def _layers(table: xr.Dataset) -> Iterator[TripletVelocities | None]:
    """The interpolant at every Deborah number, None where the table has holes."""
    velocities = VelocityTable(table)
    broken = {De for De, _, _ in holes(table)}
    for De in velocities.deborah:
        yield None if De in broken else velocities.at(De)


# -------------------------------------------------------------------------------------- summary


def summary(table: xr.Dataset) -> str:
    """What a person wants to know about a table, as text."""
    sections = [_grid_lines(table), _velocity_lines(table), _pair_lines(table)]
    sections += [_hole_lines(table), _error_lines(table), _check_lines(table)]
    sections.append(_source_lines(table))
    return "\n\n".join("\n".join(lines) for lines in sections)


def _grid_lines(table) -> Iterator[str]:
    yield str(table.attrs.get("title", "velocity table"))
    for name, text in (("deborah", "De"), ("sp", "sp"), ("sf", "sf")):
        values = table[name].values
        yield f"  {text:<3} {values.size:>3} values: " + " ".join(f"{value:g}" for value in values)


def _velocity_lines(table) -> Iterator[str]:
    yield "Velocities in units of the mean velocity (smallest ... largest)"
    yield "      De   centreline    single sphere   middle - trailing          leading - middle"
    for k, De in enumerate(table["deborah"].values):
        U = table["velocity"][k].transpose("sp", "sf", "particle").values
        ranges = []
        for relative in np.moveaxis(np.diff(U, axis=-1), -1, 0):
            known = relative[np.isfinite(relative)]
            text = f"{known.min():+.3e} ... {known.max():+.3e}" if known.size else "no solution"
            ranges.append(f"{text:<25}")
        centreline = float(table["centreline_velocity"][k])
        single = U[-1, -1, MIDDLE]
        yield f"  {De:>6g}   {centreline:<10.6f}    {single:<13.6f}   {'  '.join(ranges)}".rstrip()


def _pair_lines(table) -> Iterator[str]:
    yield "A pair alone: where attraction (distance shrinks) and repulsion (it grows) meet"
    for De, velocities in zip(table["deborah"].values, _layers(table), strict=True):
        text = "the table has holes" if velocities is None else _pair_behaviour(velocities)
        yield f"  De {De:g}: {text}"


def pair_velocity(velocities: TripletVelocities, distance: np.ndarray) -> np.ndarray:
    """Velocity of the leading minus the trailing sphere of a pair alone, in Ubar.

    Positive: they repel each other. Both spheres in turn are the triplet's middle one.
    """
    infinity = np.full_like(distance, np.inf)
    leading, trailing = velocities(distance, infinity), velocities(infinity, distance)
    return leading[..., MIDDLE] - trailing[..., MIDDLE]


def _pair_behaviour(velocities: TripletVelocities) -> str:
    """Attraction, repulsion and their crossings over the distance, in words."""
    s = np.geomspace(velocities.smallest_distance, 50.0, 2000)
    relative = pair_velocity(velocities, s)
    weak = np.abs(relative) < NEGLIGIBLE
    if weak.all():
        return f"no relative motion above {NEGLIGIBLE:g} Ubar"
    s, relative = s[~weak], relative[~weak]
    flips = np.flatnonzero(np.sign(relative[1:]) != np.sign(relative[:-1]))
    slopes = (s[flips + 1] - s[flips]) / (relative[flips + 1] - relative[flips])
    crossings = s[flips] - relative[flips] * slopes
    kinds = ["repulsion" if value > 0 else "attraction" for value in relative[[*flips, -1]]]
    words = kinds[:1]
    for crossing, kind in zip(crossings, kinds[1:], strict=True):
        words.append(f"until s = {crossing:.2f}, then {kind}")
    strongest = int(np.argmax(np.abs(relative)))
    return f"{' '.join(words)}; strongest {relative[strongest]:+.2e} Ubar at s = {s[strongest]:.2f}"


def _hole_lines(table) -> Iterator[str]:
    found = list(holes(table))
    yield f"Holes: {len(found)} of {table['status'].size} points"
    for De in dict.fromkeys(De for De, _, _ in found):
        yield f"  De {De:g}: " + name_geometries((sp, sf) for d, sp, sf in found if d == De)


def point_error(table: xr.Dataset) -> xr.DataArray:
    """Estimated error that counts, in Ubar: of relative velocities, of U without a neighbour.

    Args:
        table: The table, or a part of it.

    Returns:
        Of the shape of its status; NaN without an estimate.
    """
    relative = table["relative_velocity_error"].max("pair")
    return relative.where(np.isfinite(relative), table["velocity_error"])


def inaccurate_points(table: xr.Dataset) -> int:
    """Points whose estimated error is above what the study allows, or that have no estimate."""
    return int((table["status"] == INACCURATE).sum())


def largest_error(table: xr.Dataset) -> str:
    """The largest estimated error of the simulations and its place, in words."""
    if ERRORS[1] not in table or not np.isfinite(error := point_error(table)).any():
        return "not estimated"
    error = error.transpose("deborah", "sp", "sf")
    k, i, j = np.unravel_index(int(np.nanargmax(error)), error.shape)
    where = name_geometries([(float(table["sp"][i]), float(table["sf"][j]))])
    return (
        f"{float(error[k, i, j]):.1e} mean velocities at De {table['deborah'].values[k]:g}, {where}"
    )


def _error_lines(table) -> Iterator[str]:
    count = inaccurate_points(table)
    yield (
        f"Estimated error of the simulations, in relative velocities, in mean velocities; "
        f"points not accurate: {count}"
    )
    for k, De in enumerate(table["deborah"].values):
        layer = table.isel(deborah=[k])
        text = f"  De {De:g}: {largest_error(layer).replace(f' at De {De:g},', ', at')}"
        own = inaccurate_points(layer)
        yield text + (f"; {own} not accurate" if own else "")


def _check_lines(table) -> Iterator[str]:
    if "check_error" not in table:
        yield "Interpolation error: not measured (table.check is 0)"
        return
    error = np.abs(table["check_error"])
    yield (
        f"Interpolation error of relative velocities, in mean velocities, "
        f"at {table.sizes['check']} geometries between the nodes"
    )
    for k, De in enumerate(table["deborah"].values):
        values = error[k].transpose("check", "pair").values
        if np.isnan(values).all():
            yield f"  De {De:g}: not known"
            continue
        worst = int(np.nanargmax(values.max(axis=-1)))
        where = float(table["check_sp"][worst]), float(table["check_sf"][worst])
        yield f"  De {De:g}: at most {np.nanmax(values):.1e}, at {name_geometries([where])}"


def largest_check_error(table: xr.Dataset) -> str:
    """The interpolation error in one line of text."""
    if "check_error" not in table:
        return "error not measured (table.check is 0)"
    error = np.abs(table["check_error"].values)
    return (
        f"error up to {np.nanmax(error):.1e} mean velocities in relative velocities, "
        f"at {table.sizes['check']} geometries between the nodes"
        if np.isfinite(error).any()
        else "error not known: no check geometry was solved"
    )


def _source_lines(table) -> Iterator[str]:
    yield "Provenance"
    for name in ("source", "software_versions", "git_commit", "physics_digest"):
        if name in table.attrs:
            yield f"  {name}: {table.attrs[name]}"
