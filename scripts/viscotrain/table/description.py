"""The table in words: ranges, pairs, holes, errors and where it is from."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from viscotrain.table.attributes import ERRORS
from viscotrain.table.check import layers
from viscotrain.table.interpolation import TripletVelocities, name_geometries
from viscotrain.table.memory import largest, remark
from viscotrain.table.pairs import pair_velocity
from viscotrain.table.points import (
    count,
    fallback_points,
    holes,
    inaccurate_points,
    interpolated_points,
    point_error,
)
from viscotrain.words import (
    BEYOND_QUASI_STEADY,
    MIDDLE,
    NEGLIGIBLE,
)


def summary(table: xr.Dataset) -> str:
    """What a person wants to know about a table, as text."""
    sections = [_grid_lines(table), _velocity_lines(table), _pair_lines(table)]
    sections += [_memory_lines(table)]
    sections += [_hole_lines(table), _error_lines(table), _check_lines(table)]
    sections.append(_size_lines(table))
    sections.append(_source_lines(table))
    return "\n\n".join("\n".join(lines) for lines in sections)


def _grid_lines(table) -> Iterator[str]:
    yield str(table.attrs.get("title", "velocity table"))
    names = (("deborah", "De"), ("sp", "sp"), ("sf", "sf"), ("pair_distance", "pair"))
    for name, text in names:
        values = table[name].values
        yield f"  {text:<4} {values.size:>2} values: " + " ".join(f"{value:g}" for value in values)
    if number := interpolated_points(table):
        yield f"  {number} points follow from those on lines of the grid, which are simulated"


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
    for De, velocities in zip(table["deborah"].values, layers(table), strict=True):
        text = "the table has holes" if velocities is None else _pair_behaviour(velocities)
        yield f"  De {De:g}: {text}"


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


def _memory_lines(table) -> Iterator[str]:
    yield "Memory number: diameters that a gap changes within a relaxation time, at most"
    for k, De in enumerate(table["deborah"].values):
        layer = table.isel(deborah=k)
        yield f"  De {De:g}: {largest(layer):.2g}  {remark(layer)}".rstrip()


def memory_headline(table: xr.Dataset) -> str:
    """The largest memory number and the Deborah numbers that are beyond the range, in words."""
    layers = [table.isel(deborah=k) for k in range(table.sizes["deborah"])]
    beyond = [f"{float(layer['deborah']):g}" for layer in layers if remark(layer)]
    words = f"; {BEYOND_QUASI_STEADY}: De {', '.join(beyond)}" if beyond else ""
    return f"memory number up to {largest(table):.2g}{words}"


def _hole_lines(table) -> Iterator[str]:
    found = list(holes(table))
    yield f"Holes: {len(found)} of {count(table)} points"
    for De in dict.fromkeys(De for De, _, _ in found):
        yield f"  De {De:g}: " + name_geometries((sp, sf) for d, sp, sf in found if d == De)


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
    rough = inaccurate_points(table)
    yield (
        f"Estimated error of the simulations, in relative velocities, in mean velocities; "
        f"points not accurate: {rough}, by the fall-back: {fallback_points(table)}"
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


def _size_lines(table) -> Iterator[str]:
    if "size_response" not in table:
        yield "Velocity of a single sphere and its diameter: not in this table"
        return
    yield "Change of a single sphere's velocity with its diameter, per 1 %, in mean velocities"
    for De, per_one, error in zip(
        table["deborah"].values,
        table["size_response"].values / 100,
        table["size_response_error"].values / 100,
        strict=True,
    ):
        known = f"{per_one:+.2e}, error {error:.0e}"
        yield f"  De {De:g}: " + ("not solved" if np.isnan(per_one) else known)


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
    for name in ("source", "software_versions", "git_commit", "simulations_digest"):
        if name in table.attrs:
            yield f"  {name}: {table.attrs[name]}"
