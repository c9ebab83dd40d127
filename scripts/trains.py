r"""Trains stage: velocity table -> trains at one Deborah number, one file per volume fraction.

python scripts/trains.py --configfile config/config.yaml --deborah 5 --volume-fraction 0.004 \
    TABLE OUTPUT
"""

import time
from pathlib import Path

from viscotrain.config import stages
from viscotrain.config.settings import TrainsSettings
from viscotrain.jobs.entry import DEBORAH, Job, made, option, run, taken
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import repeats


def settings(study, design_map: bool) -> TrainsSettings:
    """Trains as the study asks for them, or those of its design map."""
    return stages.design_points(study) if design_map else stages.trains(study)


def main(job: Job, deborah: float, volume_fraction: list[float], table: Path, trains: list[Path]):
    """Simulate all repeats and write them with their statistics."""
    velocities = VelocityTable.open(table)
    for phi, output in zip(volume_fraction, trains, strict=True):
        started = time.process_time()
        result = repeats.run_repeats(
            velocities.at(deborah),
            volume_fraction=phi,
            centreline_velocity=velocities.centreline_velocity(deborah),
            **dict(job.settings),
        ).assign(repeats.deborah_numbers(velocities, deborah))
        job.write(result, output, f"trains at De = {deborah:g}, phi = {phi:g}")
        print(repeats.summary(result))
        print(f"{time.process_time() - started:.1f} CPU s")


run(
    main,
    settings=settings,
    arguments=[
        DEBORAH,
        option("volume_fraction", "of the spheres, one per output", float, many=True, single=True),
        option("design_map", "with stations and repeats of the design map", bool),
        taken("table", "velocity table"),
        made("trains", "netCDF files to write", many=True, single=True),
    ],
)
