"""Dns stage, for a figure: mesh and fields around one triplet of the table.

python scripts/field.py --configfile config/config.yaml OUTPUT
"""

from viscotrain.config import stages
from viscotrain.jobs.entry import Job, Result, run
from viscotrain.studies.dns import field


def main(job: Job, result: Result):
    """Solve the triplet that the config names and write its fields."""
    own = job.settings
    job.write(field(own, own.sp, own.sf, report=print), result)


run(main, settings=stages.field, solves=True)
