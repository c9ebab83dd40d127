"""Verification: a start-up, with the quasi-steady velocities at its distances.

python scripts/start_up.py --configfile config/config.yaml --input TRAJECTORY OUTPUT
"""

from pathlib import Path

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Job, made, run, taken
from viscotrain.studies.start_up import compare_start_up


def main(job: Job, trajectory: Path, result: Path):
    """Solve for the quasi-steady velocities along the trajectory."""
    compared = compare_start_up(job.settings, datasets.read(trajectory), report=print)
    job.write(compared, result, "start-up and quasi-steady velocities")


run(
    main,
    solves=True,
    settings=stages.start_up,
    arguments=[
        taken("trajectory", "file of the transient stage", flag="--input"),
        made("result", "netCDF file to write"),
    ],
)
