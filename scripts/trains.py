r"""Trains stage: velocity table -> trains at one Deborah number, one file per volume fraction.

python scripts/trains.py --configfile config/config.yaml --deborah 5 --volume-fraction 0.004 \
    TABLE OUTPUT
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.config.settings import TrainsSettings
from viscotrain.jobs.entry import Deborah, Job, Table, made, option, run
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import repeats

Fractions = Annotated[Sequence[float], option("of the spheres, one per output", single=True)]
OfTheMap = Annotated[bool, option("with stations and repeats of the design map")]


def settings(study, design_map: OfTheMap = False) -> TrainsSettings:
    """Trains as the study asks for them, or those of its design map."""
    return stages.design_points(study) if design_map else stages.trains(study)


def main(
    job: Job,
    deborah: Deborah,
    volume_fraction: Fractions,
    table: Table,
    trains: Annotated[Sequence[Path], made("files to write", single=True)],
):
    """Simulate all repeats and write them with their statistics."""
    velocities = VelocityTable.open(table)
    own = dict(job.settings)
    De = velocities.deborah_longest_mode(deborah)
    strength = own.pop("memory") * De / own["confinement"]
    for phi, output in zip(volume_fraction, trains, strict=True):
        result = repeats.run_repeats(
            velocities.at(deborah),
            volume_fraction=phi,
            memory_strength=strength,
            centreline_velocity=velocities.centreline_velocity(deborah),
            **own,
        ).assign(repeats.deborah_numbers(velocities, deborah))
        result = repeats.with_memory_numbers(result)
        job.write(result, output, f"trains at De = {deborah:g}, phi = {phi:g}")
        print(repeats.summary(result))


run(main, settings=settings)
