"""What a study will cost: what is done already; jobs, core-hours and memory by stage, wall time.

python scripts/estimate_cost.py --configfile config/paper.yaml --cores 2
"""

from pathlib import Path
from typing import Annotated

import pandas as pd

from viscotrain.config.study import Study
from viscotrain.jobs.costs import MEASURED, estimate
from viscotrain.jobs.entry import Job, option, run
from viscotrain.jobs.grouping import MINUTES


def whole(study: Study) -> Study:
    """It is about all stages."""
    return study


def main(
    job: Job,
    job_minutes: Annotated[
        float, option("work in a job of several geometries, as the profile says; 30 on a cluster")
    ] = MINUTES,
    cores: Annotated[int, option("that Snakemake will be given; 2 unless given")] = 2,
    results: Annotated[Path, option("folder of all runs; results/ unless given")] = Path("results"),
):
    """Print the estimate."""
    study = job.settings
    folder, measured = results / study.study, pd.read_csv(MEASURED)
    print(estimate(study, folder, max(1, cores), measured, job_minutes))


run(main, settings=whole)
