"""What a study takes at most, counted before anything is listed or planned: core-hours, gigabytes.

`costs` estimates what a study will take, from its geometries one by one. Here a study is to be
refused that would take weeks by mistake (a repeat count with three noughts too many), so numbers
are multiplied and nothing is made a list of. Each geometry counts as the slowest that was measured
at the study's largest Deborah number. This module imports neither numpy nor pandas.
"""

import math
from collections.abc import Sequence

from viscotrain.config.geometries import diameter_ratios
from viscotrain.config.study import Study
from viscotrain.jobs.on_request import REQUESTS
from viscotrain.jobs.resources import (
    DRAW,
    FRAME,
    START_UP,
    TIMES,
    measured_deborahs,
    slowest,
    train_seconds,
    variation_seconds,
)
from viscotrain.table.triplets import on_lines

SLOWER = 2.0  # what is made on request may take, over the mean of what was measured
MOVIE_WIDTH = 1280  # pixels, for which a frame was measured
# Bytes, as measured in the demo: of a geometry, of a point with its fields, of a number of a train
# (spacing and time of a passage), of a sphere in the snapshots of a repeat, of a movie's frame.
GEOMETRY, FIELDS, PASSAGE, SNAPSHOT, FRAME_BYTES = 1e5, 2e6, 16.0, 64.0, 1e3

Shares = dict[str, float]  # by the section of the config that asks for it


def over_budget(studies: Sequence[Study], request: str = "") -> list[str]:
    """A line for each limit of `budget` that the studies of a config exceed, with what takes it.

    Args:
        studies: One for each diameter.
        request: What is made, one of `REQUESTS`, with the table that it needs; empty for a run
            without targets.
    """
    budget = studies[0].budget
    shares = [_requested(study, request) if request else core_seconds(study) for study in studies]
    written = list(map(bytes_written, studies))
    hours = {section: share / 3600 for section, share in _added(shares).items()}
    gigabytes = {section: share / 1e9 for section, share in _added(written).items()}
    return [
        *_line("budget.core_hours", budget.core_hours, hours, "core-hours"),
        *_line("budget.gigabytes", budget.gigabytes, gigabytes, "GB"),
    ]


def _added(shares: Sequence[Shares]) -> Shares:
    return {section: sum(share[section] for share in shares) for section in shares[0]}


def _requested(study: Study, name: str) -> Shares:
    """CPU seconds at most of what is asked for by name."""
    jobs = REQUESTS[name](study)
    seconds = sum(START_UP + request.seconds for request in jobs) * SLOWER
    return {"table": _table_seconds(study), name: seconds}


def _line(key: str, limit: float, shares: Shares, unit: str) -> list[str]:
    total = sum(shares.values())
    if total <= limit:
        return []
    parts = ", ".join(f"{section} {share:.2g}" for section, share in shares.items())
    return [
        f"{key}: found {limit:g}; allowed: {total:.2g} or more, because this study takes up to "
        f"{total:.2g} {unit} ({parts}), or a smaller study"
    ]


def core_seconds(study: Study) -> Shares:
    """CPU seconds at most, by section."""
    runs, design_map = study.trains, study.design_map
    films, frames = _films(study), study.movies.frames
    return {
        "table": _table_seconds(study),
        "trains": variation_seconds(study)
        + sum(
            len(study.train_deborahs) * train_seconds(study, phi, runs, runs.feed)
            for phi in runs.fractions
        ),
        "design_map": sum(
            train_seconds(study, phi, design_map, study.map_feed)
            for _, phi in study.map_conditions()
        ),
        "movies": films * (START_UP + FRAME * frames * (len(study.stations) + 1)),
    }


def bytes_written(study: Study) -> Shares:
    """Bytes of all results at most, by section."""
    runs, design_map = study.trains, study.design_map
    each = GEOMETRY + len(study.deborah.values) * FIELDS * study.dns.save_fields
    trains = len(study.train_deborahs) * len(runs.fractions)
    frame = FRAME_BYTES * max(1.0, (study.movies.width / MOVIE_WIDTH) ** 2)
    return {
        "table": geometries(study) * each,
        "trains": trains * _train_bytes(study, runs, len(study.stations)),
        "design_map": len(study.map_conditions())
        * _train_bytes(study, design_map, design_map.stations),
        "movies": _films(study) * frame * study.movies.frames * (len(study.stations) + 1),
    }


def geometries(study: Study) -> int:
    """How many are simulated at most: on lines of the grid, pairs besides, and the check."""
    table = study.table
    if table.file is not None:
        return 0
    cells, spacing = len(table.sp) * len(table.sf), table.line_spacing
    between = [len(axis) - len(on_lines(axis, spacing)) for axis in (table.sp, table.sf)]
    pairs = 2 * (len(table.sp) + len(table.sf)) + len(table.pair or ())
    return cells - math.prod(between) + pairs + min(table.check, cells)


def _table_seconds(study: Study) -> float:
    """CPU seconds of all geometries, and of single spheres of other diameters."""
    others = 0 if study.table.file is not None else len(diameter_ratios(study))
    draws = DRAW * len(study.deborah.values) * study.fluid.fit.draws if study.fluid.data else 0.0
    return draws + (geometries(study) + others) * _flow_seconds(study)


def _flow_seconds(study: Study) -> float:
    """CPU seconds of a geometry at all Deborah numbers: as many steps as measured, or more."""
    largest = max(study.deborah.values)
    if study.fluid.modes is not None:
        largest = study.deborah_longest_mode(largest)
    steps = max(1.0, len(study.deborah.values) / measured_deborahs(largest))
    stage = "transient" if study.dns.method == "transient" else "dns"
    return START_UP + TIMES[stage] * steps * slowest(largest)


def _films(study: Study) -> int:
    return len(study.movie_conditions())


def _train_bytes(study: Study, runs, stations: int) -> float:
    """Of the densest train of a section."""
    fractions: Sequence[float] = runs.volume_fraction or runs.feed_volume_fraction or ()
    fractions = fractions or study.trains.fractions
    inside = study.channel.length / (study.mean_spacing(max(fractions)) * study.confinement)
    return runs.repeats * (PASSAGE * stations * runs.passages + SNAPSHOT * inside)
