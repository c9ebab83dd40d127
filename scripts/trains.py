"""Trains stage: velocity table -> trains at one Deborah number, one file per volume fraction.

From the command line:
python scripts/trains.py --configfile config/config.yaml --deborah 5 --volume-fraction 0.004 \
    TABLE OUTPUT
"""

import argparse
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from viscotrain.config.models import Study, load_study, parse_study, with_fitted_fluid
from viscotrain.jobs import datasets, provenance
from viscotrain.jobs.command import reporting
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import repeats


def main(
    study: Study,
    settings: Mapping[str, Any],
    deborah: float,
    volume_fraction: float,
    table: str | Path,
    output: str | Path,
):
    """Simulate all repeats and write them with their statistics.

    The settings are `Study.trains_settings`, or `Study.map_settings` for the design map.
    """
    started = time.process_time()
    velocities = VelocityTable.open(table)
    result = repeats.run_repeats(
        velocities.at(deborah),
        confinement=study.confinement,
        volume_fraction=volume_fraction,
        centreline_velocity=velocities.centreline_velocity(deborah),
        length=settings["length"],
        stations=settings["stations"],
        passages=settings["passages"],
        repeats=settings["repeats"],
        seed=settings["seed"],
        factors=[
            ("deborah", deborah, "1", "Deborah number, as the study defines it"),
            *study.scales(deborah).quantities(),
        ],
        attributes=provenance.attributes(
            f"trains of study {study.study} at De = {deborah:g}, phi = {volume_fraction:g}",
            study.resolved_yaml(),
        )
        | {"trains_digest": provenance.digest(provenance.TRAINS)},
    )
    datasets.write(result, output)
    print(repeats.summary(result))
    print(f"{time.process_time() - started:.1f} CPU s")


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("--deborah", type=float, required=True, help="one of the table's")
    parser.add_argument("--volume-fraction", type=float, required=True)
    parser.add_argument("table", help="velocity table")
    parser.add_argument("output", help="netCDF file to write")
    parser.add_argument(
        "--design-map", action="store_true", help="with the stations and repeats of design_map"
    )
    a = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(a.configfile))
        settings = study.map_settings() if a.design_map else study.trains_settings()
        main(study, settings, a.deborah, a.volume_fraction, a.table, a.output)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        study = with_fitted_fluid(parse_study(snakemake.config))  # noqa: F821
        fractions = map(float, snakemake.params.volume_fraction)  # noqa: F821
        for phi, output in zip(fractions, snakemake.output, strict=True):  # noqa: F821
            main(
                study,
                snakemake.params.settings,  # noqa: F821
                float(snakemake.wildcards.deborah),  # noqa: F821
                phi,
                snakemake.input[0],  # noqa: F821
                output,
            )
elif __name__ == "__main__":
    _command_line()
