"""Verification: a short train, directly and by the train model.

python scripts/closure_train.py --configfile config/config.yaml --deborah 5 TABLE OUTPUT
"""

from viscotrain.config import stages
from viscotrain.jobs.entry import Deborah, Job, Result, Table, run
from viscotrain.studies.accuracy import largest_difference
from viscotrain.studies.closure import follow_train
from viscotrain.table.interpolation import VelocityTable


def main(job: Job, table: Table, deborah: Deborah, result: Result):
    """Simulate and compare; a killed run goes on."""
    velocities = VelocityTable.open(table).at(deborah)
    with job.checkpoint(result) as checkpoint:
        compared = follow_train(
            job.settings, velocities, deborah, report=print, checkpoint=checkpoint, code=job.code
        )
        print(f"largest difference: {largest_difference(compared):.3g} d")
        job.write(compared, result)


run(main, settings=stages.closure_train, solves=True)
