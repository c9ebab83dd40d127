"""Dns stage, for a figure: mesh and fields at one point of the table.

python scripts/field.py --configfile config/config.yaml OUTPUT
"""

from viscotrain.config import stages
from viscotrain.jobs.entry import Job, Result, run
from viscotrain.studies.dns import field


def main(job: Job, result: Result):
    """Solve the point that the config names and write its fields."""
    point = job.settings
    job.write(field(point, point.sp, point.sf, point.deborah[0], report=print), result)


run(main, settings=stages.field, solves=True)
