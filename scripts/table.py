"""Table stage: results of all geometries -> velocity table, with its interpolation error.

python scripts/table.py --configfile config/config.yaml OUTPUT DNS_FILE...
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.agreement import refuse_strangers
from viscotrain.jobs.entry import Job, Result, run, taken
from viscotrain.table import description, present
from viscotrain.table.check import combine_and_check

Parts = Annotated[Sequence[Path], taken("files of dns.py or transient.py")]


def main(job: Job, table: Result, results: Parts):
    """Combine the files of the grid's geometries; those off the grid check the interpolation."""
    parts = {str(path): datasets.read(path) for path in results}
    simulations = refuse_strangers(parts)
    velocities = combine_and_check(
        [present.at_end(part) for part in parts.values()], **dict(job.settings)
    )
    job.write(velocities.assign_attrs(simulations), table, "velocity table")
    print(description.summary(velocities))


run(main, settings=stages.table)
