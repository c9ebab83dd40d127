"""What a study will cost: what is done already; jobs, core-hours and memory by stage, wall time.

The last lines are of targets that are asked for by name, alone: `snakemake -- design`.

python scripts/estimate_cost.py --configfile config/paper.yaml --cores 2
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import pandas as pd

from viscotrain.config.study import Study
from viscotrain.jobs.costs import MEASURED
from viscotrain.jobs.entry import Job, option, run
from viscotrain.jobs.grouping import MINUTES
from viscotrain.jobs.sweep_costs import estimate_all


def whole(studies: Sequence[Study]) -> Sequence[Study]:
    """It is about all stages, of all diameters."""
    return studies


def main(
    job: Job,
    job_minutes: Annotated[
        float, option("work in a job of several geometries, as the profile says; 30 on a cluster")
    ] = MINUTES,
    cores: Annotated[int, option("that Snakemake will be given; 2 unless given")] = 2,
    results: Annotated[Path, option("folder of all runs; results/ unless given")] = Path("results"),
):
    """Print the estimate."""
    print(estimate_all(job.settings, results, max(1, cores), pd.read_csv(MEASURED), job_minutes))


run(main, settings=whole, fitted=False)
