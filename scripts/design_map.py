"""Design map stage: trains of all conditions -> the map in physical units.

From the command line:
python scripts/design_map.py --configfile config/config.yaml OUTPUT POINT...
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from viscotrain import datasets, design_map, provenance
from viscotrain.command import reporting
from viscotrain.config import Study, load_study, parse_study, with_fitted_fluid


def main(study: Study, points: Sequence[str | Path], output: str | Path):
    """Combine the trains of all conditions and write the map."""
    result = design_map.combine(
        [xr.load_dataset(path) for path in points],
        fluid=study.dimensionless_fluid,
        ordered_variation=study.design_map.ordered_variation,
        attributes=provenance.attributes(
            f"design map of study {study.study}", study.resolved_yaml()
        ),
    )
    datasets.write(result, output)
    print(design_map.headline(result))


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("output", help="netCDF file to write")
    parser.add_argument("points", nargs="+", help="files that trains.py --design-map wrote")
    arguments = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(arguments.configfile))
        main(study, arguments.points, arguments.output)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        study = with_fitted_fluid(parse_study(snakemake.config))  # noqa: F821
        main(study, snakemake.input.points, snakemake.output[0])  # noqa: F821
elif __name__ == "__main__":
    _command_line()
