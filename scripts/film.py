"""Movies stage: velocity table and trains -> positions of spheres in the windows of all cameras.

python scripts/film.py --configfile config/config.yaml TABLE TRAINS OUTPUT
"""

from pathlib import Path

import xarray as xr

from viscotrain.config import stages
from viscotrain.jobs.entry import Job, made, run, taken
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import films


def main(job: Job, table: Path, trains: Path, result: Path):
    """Film the first repeat of a train."""
    train = xr.load_dataset(trains)
    deborah, phi = float(train["deborah"]), float(train["volume_fraction"])
    velocities = VelocityTable.open(table).at(deborah)
    title = f"positions of spheres in movies at De = {deborah:g}, phi = {phi:g}"
    job.write(films.film(velocities, train, **dict(job.settings)), result, title)


run(
    main,
    settings=stages.film,
    arguments=[
        taken("table", "velocity table"),
        taken("trains", "netCDF file of the trains stage"),
        made("result", "netCDF file to write"),
    ],
)
