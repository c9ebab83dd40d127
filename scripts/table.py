"""Table stage: results of all geometries -> velocity table, with its interpolation error.

From the command line: python scripts/table.py --configfile config/config.yaml OUTPUT DNS_FILE...
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from viscotrain.config.models import Study, load_study, parse_study, with_fitted_fluid
from viscotrain.jobs import datasets, provenance
from viscotrain.jobs.command import reporting
from viscotrain.table import assembly, check, description, present


def main(study: Study, results: Sequence[str | Path], output: str | Path):
    """Combine the files of the grid's geometries; those off the grid check the interpolation."""
    on_grid, between = [], []
    for path in results:
        result = xr.load_dataset(path)
        if "time" in result.dims:
            result = present.after_start_up(result)
        geometry = float(result["sp"]), float(result["sf"])
        (on_grid if geometry in study.geometries else between).append(result)
    velocities = assembly.combine(
        on_grid,
        sp=study.table.sp,
        sf=study.table.sf,
        deborah=study.deborah.values,
        max_holes=study.table.max_holes,
        attributes=provenance.attributes(
            f"velocity table of study {study.study}", study.resolved_yaml()
        ),
    )
    if between:
        velocities = check.check_errors(velocities, between)
    datasets.write(velocities, output)
    print(description.summary(velocities))


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("output", help="velocity table to write")
    parser.add_argument("results", nargs="+", help="netCDF files of the dns stage")
    arguments = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(arguments.configfile))
        main(study, arguments.results, arguments.output)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(
            with_fitted_fluid(parse_study(snakemake.config)),  # noqa: F821
            snakemake.input.results,  # noqa: F821
            snakemake.output[0],  # noqa: F821
        )
elif __name__ == "__main__":
    _command_line()
