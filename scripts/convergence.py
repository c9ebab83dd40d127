"""Verification: relative velocities of one triplet with other settings of one kind.

python scripts/convergence.py --configfile config/config.yaml --kind mesh --sp 1.5 --sf 2.5 OUTPUT
"""

from typing import Annotated

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import SF, SP, Job, Result, run, wildcard
from viscotrain.studies.accuracy import KINDS
from viscotrain.studies.convergence import convergence_rows

Kind = Annotated[str, wildcard("what is varied", choices=KINDS)]


def main(job: Job, kind: Kind, sp: SP, sf: SF, result: Result):
    """Solve with every setting of the kind."""
    rows = convergence_rows(job.settings, kind, sp, sf, report=print)
    datasets.write_csv(rows, result, digits=9)


run(main, settings=stages.convergence, solves=True)
