"""Verification: velocities of equally spaced spheres, simulated directly.

python scripts/closure_gap.py --configfile config/config.yaml --gap 0.5 OUTPUT
"""

from typing import Annotated

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Job, Result, run, wildcard
from viscotrain.studies.closure import velocities_at_gap


def main(job: Job, gap: Annotated[float, wildcard("between surfaces, in d")], result: Result):
    """Solve at one gap."""
    rows = velocities_at_gap(job.settings, gap, report=print)
    datasets.write_csv(rows, result, digits=9)


run(main, settings=stages.closure_gap, solves=True)
