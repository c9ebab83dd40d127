"""Verification: a short train, directly and by the train model.

python scripts/closure_train.py --configfile config/config.yaml --input TABLE --deborah 5 OUTPUT
"""

from pathlib import Path

from viscotrain.config import stages
from viscotrain.jobs.entry import DEBORAH, Job, made, run, taken
from viscotrain.studies.accuracy import largest_difference
from viscotrain.studies.closure import follow_train
from viscotrain.table.interpolation import VelocityTable


def main(job: Job, table: Path, deborah: float, result: Path):
    """Simulate and compare; a killed run goes on."""
    velocities = VelocityTable.open(table).at(deborah)
    with job.checkpoint(result) as checkpoint:
        compared = follow_train(
            job.settings, velocities, deborah, report=print, checkpoint=checkpoint, code=job.code
        )
        print(f"largest difference: {largest_difference(compared):.3g} d")
        job.write(compared, result)


run(
    main,
    solves=True,
    settings=stages.closure_train,
    arguments=[
        taken("table", "velocity table", flag="--input"),
        DEBORAH,
        made("result", "netCDF file to write"),
    ],
)
