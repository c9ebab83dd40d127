"""Movies stage: velocity table and trains -> positions of spheres in the windows of all cameras.

python scripts/film.py --configfile config/config.yaml TABLE TRAINS OUTPUT [--duct FLOW]
"""

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Duct, Job, Result, Table, Train, run
from viscotrain.table.drift import open_table
from viscotrain.trains import films


def main(job: Job, table: Table, trains: Train, result: Result, duct: Duct = None):
    """Film the first repeat of a train."""
    train = datasets.read(trains)
    velocities = open_table(table, duct).at(float(train["deborah"]))
    job.write(films.film(velocities, train, **dict(job.settings)), result)


run(main, settings=stages.film)
