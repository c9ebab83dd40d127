"""What the studies of several diameters cost together.

Their jobs run side by side, so that the cores are shared by all of them.
"""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from viscotrain.config.study import Study
from viscotrain.jobs.cost_report import counted, estimate, expected
from viscotrain.jobs.costs import Cost, StageCost, cost_of
from viscotrain.jobs.grouping import MINUTES


def estimate_all(
    studies: Sequence[Study],
    results: Path,
    cores: int,
    measured: pd.DataFrame,
    minutes: float = MINUTES,
) -> str:
    """The estimate of each study of a config as text, and of several what they cost together.

    Args:
        studies: One for each diameter.
        results: Folder of all runs.
        cores: That Snakemake is given.
        measured: Times.
        minutes: Work in a job of several geometries.
    """
    folders = [results / study.study for study in studies]
    each = list(zip(studies, folders, strict=True))
    texts = [estimate(*one, cores, measured, minutes) for one in each]
    if len(studies) == 1:
        return texts[0]
    known = [counted(*one) for one in each]
    whole = _together([cost_of(*one, measured, minutes) for one in known])
    return "\n".join([*texts, f"all {len(studies)} diameters", expected(whole, cores)])


def _together(costs: Sequence[Cost]) -> Cost:
    """Studies that run side by side: the same stages, with the jobs of all."""
    stages: dict[str, list[StageCost]] = {}
    for stage in (stage for cost in costs for stage in cost.stages):
        stages.setdefault(stage.name, []).append(stage)
    return Cost(
        tuple(
            StageCost(
                name,
                jobs=sum(stage.jobs for stage in same),
                seconds=sum(stage.seconds for stage in same),
                longest=max(stage.longest for stage in same),
                megabytes=max(stage.megabytes for stage in same),
            )
            for name, same in stages.items()
        )
    )
