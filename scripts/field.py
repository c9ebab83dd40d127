"""Dns stage, for a figure: mesh and fields at one point of the table.

python scripts/field.py --configfile config/config.yaml OUTPUT
"""

from pathlib import Path

from viscotrain.config import stages
from viscotrain.jobs.entry import Job, made, run
from viscotrain.studies.dns import field


def main(job: Job, result: Path):
    """Solve the point that the config names and write its fields."""
    point = job.settings
    job.write(field(point, point.sp, point.sf, point.deborah[0], report=print), result)


run(
    main,
    solves=True,
    settings=stages.field,
    arguments=[made("result", "netCDF file to write")],
)
