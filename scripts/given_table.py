"""Table stage of a study that takes a finished table: checked, and cut to its Deborah numbers.

python scripts/given_table.py --configfile CONFIG FINISHED_TABLE OUTPUT
"""

from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.agreement import refuse_other_case
from viscotrain.jobs.entry import Job, Result, run, taken
from viscotrain.table import description


def main(job: Job, source: Annotated[Path, taken("finished velocity table")], table: Result):
    """Take the velocities at the Deborah numbers of the study."""
    finished = datasets.read(source)
    refuse_other_case(str(source), finished, job.settings)
    velocities = finished.sel(deborah=list(job.settings.deborah))
    made = {"given_table": f"{finished.attrs['title']}, {finished.attrs['history']}"}
    job.write(velocities.assign_attrs(made), table, "velocity table")
    print(description.summary(velocities))


run(main, settings=stages.given_table)
