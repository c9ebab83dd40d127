"""Verification: relative velocities of one triplet with other settings of one kind.

python scripts/convergence.py --configfile config/config.yaml --kind mesh --sp 1.5 --sf 2.5 OUTPUT
"""

from pathlib import Path

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import DISTANCES, Job, made, run, wildcard
from viscotrain.studies.accuracy import KINDS
from viscotrain.studies.convergence import convergence_rows


def main(job: Job, kind: str, sp: float, sf: float, result: Path):
    """Solve with every setting of the kind."""
    rows = convergence_rows(job.settings, kind, sp, sf, report=print)
    datasets.write_csv(rows, result, digits=9)


run(
    main,
    solves=True,
    settings=stages.convergence,
    arguments=[
        wildcard("kind", "what is varied", str, choices=KINDS),
        *DISTANCES,
        made("result", "CSV file to write"),
    ],
)
