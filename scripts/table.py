"""Table stage: results of all geometries -> velocity table, with its interpolation error.

python scripts/table.py --configfile config/config.yaml OUTPUT DNS_FILE...
"""

from pathlib import Path

import xarray as xr

from viscotrain.config import stages
from viscotrain.jobs.agreement import refuse_strangers
from viscotrain.jobs.entry import Job, made, run, taken
from viscotrain.table import description, present
from viscotrain.table.check import combine_and_check


def main(job: Job, table: Path, results: list[Path]):
    """Combine the files of the grid's geometries; those off the grid check the interpolation."""
    parts = {str(path): xr.load_dataset(path) for path in results}
    simulations = refuse_strangers(parts)
    velocities = combine_and_check(
        [present.at_end(part) for part in parts.values()], **dict(job.settings)
    )
    velocities = velocities.assign_attrs(simulations)
    job.write(velocities, table, "velocity table")
    print(description.summary(velocities))


run(
    main,
    settings=stages.table,
    arguments=[
        made("table", "velocity table to write"),
        taken("results", "netCDF files of the dns or the transient stage", many=True),
    ],
)
