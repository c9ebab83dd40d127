"""Which geometries one job of the dns stage solves.

A job starts in a second and a half of CPU, as long as a geometry takes at small De, so it solves
several, and few enough for all cores to be busy to the end. A cluster wants half an hour in a job.
Geometries of one job have the same settings, so what a file is made with does not depend on the
others of its job. Which these are follows from the config and the measured costs alone: every
process that reads the rules finds the same.
"""

import math

from viscotrain.config.geometries import simulated
from viscotrain.config.study import Study
from viscotrain.jobs.resources import flow_seconds
from viscotrain.table.triplets import Triplet

MINUTES = 1 / 3  # of work in a job where the profile says nothing
MOST = 400  # jobs of the same settings: enough for any machine, and Snakemake's time is by the job


def jobs(study: Study, minutes: float = MINUTES) -> list[list[Triplet]]:
    """Geometries (sp, sf) of every job, the single sphere first.

    Args:
        study: The config.
        minutes: Work of a job by the measured costs, unless the config says how many geometries.
    """
    alike: dict[tuple[float, ...], list[Triplet]] = {}
    for geometry, deborahs in sorted(simulated(study).items(), key=_has_neighbours):
        alike.setdefault(deborahs, []).append(geometry)
    found = []
    for deborahs, geometries in alike.items():
        size = study.dns.geometries_per_job
        if size is None:
            fewest = math.ceil(len(geometries) / MOST)
            size = max(fewest, _filling(study, max(deborahs), minutes))
        count = math.ceil(len(geometries) / size)
        # Dealt out like cards: near ones and far ones, pairs and triplets, in every job.
        found += [geometries[first::count] for first in range(count)]
    return found


def _has_neighbours(item: tuple[Triplet, tuple[float, ...]]) -> bool:
    return any(map(math.isfinite, item[0]))


def _filling(study: Study, deborah: float, minutes: float) -> int:
    known = study.fluid.modes is not None
    seconds = flow_seconds(study.deborah_longest_mode(deborah) if known else deborah)
    return max(1, round(60 * minutes / seconds))
