"""Design map stage, first half: velocity table -> trains at one condition of the map.

From the command line:
python scripts/design_point.py --configfile config/config.yaml --deborah 5 \
    --volume-fraction 0.004 TABLE OUTPUT
"""

import argparse
from pathlib import Path

import numpy as np

from viscotrain import datasets, provenance, trains
from viscotrain.command import reporting
from viscotrain.config import Study, load_study, parse_study
from viscotrain.interpolation import VelocityTable


def main(
    study: Study, deborah: float, volume_fraction: float, table: str | Path, output: str | Path
):
    """Simulate the trains of one condition and write their statistics along the channel."""
    velocities = VelocityTable.open(table)
    result = trains.run(
        velocities.at(deborah),
        confinement=study.confinement,
        volume_fraction=volume_fraction,
        centreline_velocity=velocities.centreline_velocity(deborah),
        length=study.channel.length,
        stations=np.linspace(0.0, study.channel.length, study.design_map.stations),
        passages=study.design_map.passages,
        repeats=study.design_map.repeats,
        seed=study.trains.seed,
        factors=[
            ("deborah", deborah, "1", "Deborah number, as the study defines it"),
            *study.scales(deborah).quantities(),
        ],
        attributes=provenance.attributes(
            f"trains of the design map of study {study.study} at De = {deborah:g}, "
            f"phi = {volume_fraction:g}",
            study.resolved_yaml(),
        )
        | {"trains_digest": provenance.digest(provenance.TRAINS)},
    )
    datasets.write(result, output)
    print(trains.summary(result))


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("--deborah", type=float, required=True, help="one of the table's")
    parser.add_argument("--volume-fraction", type=float, required=True)
    parser.add_argument("table", help="velocity table")
    parser.add_argument("output", help="netCDF file to write")
    a = parser.parse_args()
    with reporting():
        main(load_study(a.configfile), a.deborah, a.volume_fraction, a.table, a.output)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(
            parse_study(snakemake.config),  # noqa: F821
            float(snakemake.wildcards.deborah),  # noqa: F821
            float(snakemake.wildcards.volume_fraction),  # noqa: F821
            snakemake.input[0],  # noqa: F821
            snakemake.output[0],  # noqa: F821
        )
elif __name__ == "__main__":
    _command_line()
