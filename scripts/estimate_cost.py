"""What a study will cost: what it consists of, what is done already, CPU and wall time.

python scripts/estimate_cost.py --configfile config/paper.yaml --cores 2
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import pandas as pd

from viscotrain.config.study import Study
from viscotrain.jobs.costs import MEASURED, of_all
from viscotrain.jobs.entry import Job, option, run


def whole(studies: Sequence[Study]) -> Sequence[Study]:
    """It is about all stages, of all diameters."""
    return studies


def main(
    job: Job,
    cores: Annotated[int, option("that Snakemake will be given; 2 unless given")] = 2,
    results: Annotated[Path, option("folder of all runs; results/ unless given")] = Path("results"),
):
    """Print the estimate."""
    print(of_all(job.settings, results, max(1, cores), pd.read_csv(MEASURED)))


run(main, settings=whole)
