"""Verification: velocities of equally spaced spheres, simulated directly.

python scripts/closure_gap.py --configfile config/config.yaml --gap 0.5 OUTPUT
"""

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Gap, Job, Result, run
from viscotrain.studies.closure import velocities_at_gap


def main(job: Job, gap: Gap, result: Result):
    """Solve at one gap."""
    datasets.write_csv(velocities_at_gap(job.settings, gap, report=print), result, digits=9)


run(main, settings=stages.closure_gap, solves=True)
