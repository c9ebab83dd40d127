"""What a study will cost: what it consists of, what is done already, CPU and wall time.

python scripts/estimate_cost.py --configfile config/paper.yaml --cores 2
"""

from pathlib import Path

import pandas as pd

from viscotrain.jobs.costs import MEASURED, estimate
from viscotrain.jobs.entry import Job, option, run


def main(job: Job, cores: int | None, results: Path | None):
    """Print the estimate."""
    study = job.whole_study()
    folder = (results or Path("results")) / study.study
    print(estimate(study, folder, 2 if cores is None else max(1, cores), pd.read_csv(MEASURED)))


run(
    main,
    config=True,
    arguments=[
        option("cores", "that Snakemake will be given; 2 unless given", int, optional=True),
        option("results", "folder of all runs; results/ unless given", Path, optional=True),
    ],
)
