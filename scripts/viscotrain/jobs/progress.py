"""How far a study's simulations are: which points are there, how many holes, each in a line.

A file counts if it was made with the present settings and code.
"""

import math
from pathlib import Path

import numpy as np
import xarray as xr

from viscotrain.config import stages
from viscotrain.config.geometries import simulated, wanted
from viscotrain.config.names import geometry_name, point_name
from viscotrain.config.study import Study
from viscotrain.jobs.digests import digest
from viscotrain.jobs.provenance import made_with
from viscotrain.table.points import point_error
from viscotrain.table.triplets import simulated_as
from viscotrain.words import INACCURATE, SOLVED, has_solution

Point = tuple[float, float, float]  # sp, sf, De


class Simulations:
    """Files of a study's simulations, each read once, and again when it has changed.

    Args:
        study: The config.
        folder: Of its results.
    """

    def __init__(self, study: Study, folder: Path):
        self._study, self._files = study, _files(study, folder)
        self._code = digest("transient" if study.dns.method == "transient" else "dns")
        self._known: dict[Path, tuple[int, dict[Point, int]]] = {}

    def outcomes(self) -> dict[Point, int]:
        """Status of every point that is simulated already."""
        found: dict[Point, int] = {}
        for path, points in self._files.items():
            time = path.stat().st_mtime_ns if path.exists() else 0
            if self._known.get(path, (0, {}))[0] != time:
                self._known[path] = time, self._read(path, points)
            if time:
                found |= self._known[path][1]
        return found

    def _read(self, path: Path, points: list[Point]) -> dict[Point, int]:
        """Status of the points of a file; none if it is of other settings, points or code."""
        sp, sf, De = points[0]
        quasi_steady = self._study.dns.method == "quasi_steady"
        of_stage = stages.dns(self._study, sp, sf) if quasi_steady else None
        if not made_with(path, of_stage or stages.transient(self._study, De), self._code):
            return {}
        with xr.open_dataset(path) as result:
            own = zip(result["deborah"].values.flat, result["status"].values.flat, strict=True)
            status = dict(own)
        if set(status) != {De for *_, De in points}:
            return {}
        return {point: int(status[point[2]]) for point in points}


def outcomes(study: Study, folder: Path) -> dict[Point, int]:
    """Status of every point that is simulated already, in a folder of results."""
    return Simulations(study, folder).outcomes()


def _files(study: Study, folder: Path) -> dict[Path, list[Point]]:
    """Files of the simulations, each with the points that it holds."""
    files: dict[Path, list[Point]] = {}
    for geometry, deborahs in simulated(study).items():
        for De in deborahs:
            path = folder / "dns" / f"{geometry_name(*geometry)}.nc"
            if study.dns.method == "transient":
                path = folder / "transient" / f"{point_name(*geometry, De)}.nc"
            files.setdefault(path, []).append((*geometry, De))
    return files


def holes(study: Study, found: dict[Point, int]) -> int:
    """Points of the table that have no solution, by what is simulated already.

    A neighbour that is not there needs the velocity of the single sphere. What follows
    from others is not counted.
    """
    missing, triplets = 0, wanted(study)
    own = set(triplets)
    for De in study.deborah.values:
        failed = {
            triplet
            for triplet in own
            if not has_solution(found.get((*simulated_as(*triplet, De, own), De), SOLVED))
        }
        single = (math.inf, math.inf) in failed
        missing += sum(each in failed or (single and math.inf in each) for each in triplets)
    return missing


def line(name: str, result: xr.Dataset) -> str:
    """One line about a finished simulation.

    Args:
        name: Of the simulation.
        result: With the status at each De or at the only one.
    """
    status, deborahs = result["status"].values.ravel(), result["deborah"].values.ravel()
    solved = deborahs[has_solution(status)]
    text = f"{name}: solved {solved.size} of {deborahs.size} De"
    if solved.size:
        text += f", up to {solved.max():g}"
    text += _inaccurate(result, deborahs[status == INACCURATE])
    reasons = result["reason"].values.ravel()[~has_solution(status)]
    reason = next(filter(None, map(str, reasons)), "")
    return f"{text}; {reason}" if reason else text


def _inaccurate(result: xr.Dataset, deborahs: np.ndarray) -> str:
    """How many points are not accurate, and the largest estimated error among them."""
    if not deborahs.size:
        return ""
    text = f"; not accurate: {deborahs.size}"
    error = point_error(result.sel(deborah=deborahs))
    if not np.isfinite(error).any():
        return text + ", errors not estimated"
    worst = int(np.nanargmax(error))
    return (
        text + f", largest estimated error {float(error[worst]):.1e} Ubar at De {deborahs[worst]:g}"
    )
