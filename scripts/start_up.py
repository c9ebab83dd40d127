"""Verification: a start-up, with the quasi-steady velocities at its distances.

python scripts/start_up.py --configfile config/config.yaml TRAJECTORY OUTPUT
"""

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Job, Result, Trajectory, run
from viscotrain.studies.start_up import compare_start_up


def main(job: Job, trajectory: Trajectory, result: Result):
    """Solve for the quasi-steady velocities along the trajectory."""
    compared = compare_start_up(job.settings, datasets.read(trajectory), report=print)
    job.write(compared, result, "start-up and quasi-steady velocities")


run(main, settings=stages.start_up, solves=True)
