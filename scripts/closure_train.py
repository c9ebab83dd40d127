"""Verification: a short train, simulated directly.

python scripts/closure_train.py --configfile config/config.yaml --deborah 5 OUTPUT
"""

from pathlib import Path

from viscotrain.config import stages
from viscotrain.jobs.entry import DEBORAH, Job, made, run
from viscotrain.studies.closure import follow_train


def main(job: Job, deborah: float, result: Path):
    """Simulate; a killed run goes on."""
    with job.checkpoint(result) as checkpoint:
        trajectory = follow_train(
            job.settings, deborah, report=print, checkpoint=checkpoint, code=job.code
        )
        job.write(trajectory, result)


run(
    main,
    solves=True,
    settings=stages.closure_train,
    arguments=[DEBORAH, made("result", "netCDF file to write")],
)
