"""Verification: a short train, simulated directly.

python scripts/closure_train.py --configfile config/config.yaml --deborah 5 OUTPUT
"""

from viscotrain.config import stages
from viscotrain.jobs.entry import Deborah, Job, Result, run
from viscotrain.studies.closure import follow_train


def main(job: Job, deborah: Deborah, result: Result):
    """Simulate; a killed run goes on."""
    with job.checkpoint(result) as checkpoint:
        trajectory = follow_train(
            job.settings, deborah, report=print, checkpoint=checkpoint, code=job.code
        )
        job.write(trajectory, result)


run(main, settings=stages.closure_train, solves=True)
