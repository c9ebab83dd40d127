r"""Operating conditions stage: numbers of all conditions, and which limits they exceed.

python scripts/operating_conditions.py --configfile config/config.yaml OUTPUT CSV \
    UNITS FLOW TRAIN...
"""

from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Flow, Job, Result, Trains, Units, made, run
from viscotrain.trains import operating_conditions

Csv = Annotated[Path, made("CSV file to write", key="csv")]


def main(job: Job, result: Result, csv: Csv, units: Units, flow: Flow, trains: Trains):
    """Find the numbers and write them."""
    own = job.settings
    found = operating_conditions.operating_conditions(
        [datasets.read(path) for path in trains],
        units=datasets.read(units),
        flow=datasets.read(flow),
        fluid=own.known_fluid,
        fluid_density=own.fluid_density,
        particle_density=own.particle_density,
        section=own.section,
    )
    job.write(found, result, "operating conditions")
    datasets.write_csv(operating_conditions.table(found), csv)
    print(*operating_conditions.summary(found), sep="\n")


run(main, settings=stages.operating_conditions)
