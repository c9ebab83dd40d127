r"""Trains stage: velocity table -> trains at one Deborah number, one file per volume fraction.

python scripts/trains.py --configfile config/config.yaml --deborah 5 --volume-fraction 0.004 \
    TABLE OUTPUT [--duct CHANNEL_FLOW]
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.config.settings import TrainsSettings
from viscotrain.jobs.entry import Deborah, Duct, Job, Table, made, option, run
from viscotrain.studies import train_runs
from viscotrain.table.drift import open_table
from viscotrain.trains import repeats

Fractions = Annotated[
    Sequence[float], option("as the study gives them, one per output", single=True)
]
Outputs = Annotated[Sequence[Path], made("files to write", single=True)]
OfTheMap = Annotated[bool, option("with stations and repeats of the design map")]


def settings(study, design_map: OfTheMap = False) -> TrainsSettings:
    """Trains as the study asks for them, or those of its design map."""
    return stages.design_points(study) if design_map else stages.trains(study)


def main(
    job: Job,
    deborah: Deborah,
    volume_fraction: Fractions,
    table: Table,
    trains: Outputs,
    duct: Duct = None,
):
    """Simulate all repeats and write them with their statistics."""
    velocities = open_table(table, duct)
    for fraction, output in zip(volume_fraction, trains, strict=True):
        result = train_runs.simulate(job.settings, velocities, deborah, fraction)
        phi = float(result["volume_fraction"])
        job.write(result, output, f"trains at De = {deborah:g}, phi = {phi:.3g}")
        print(repeats.summary(result))


run(main, settings=settings)
