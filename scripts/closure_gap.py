"""Verification: velocities of equally spaced spheres, simulated directly.

python scripts/closure_gap.py --configfile config/config.yaml --gap 0.5 OUTPUT
"""

from pathlib import Path

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Job, made, run, wildcard
from viscotrain.studies.closure import velocities_at_gap


def main(job: Job, gap: float, result: Path):
    """Solve at one gap."""
    rows = velocities_at_gap(job.settings, gap, report=print)
    datasets.write_csv(rows, result, digits=9)


run(
    main,
    solves=True,
    settings=stages.closure_gap,
    arguments=[wildcard("gap", "between surfaces, in d"), made("result", "CSV file to write")],
)
