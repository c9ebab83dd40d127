"""Movies stage, first half: velocity table and trains -> positions at the times of the frames.

From the command line:
python scripts/film.py --configfile config/config.yaml TABLE TRAINS OUTPUT
"""

import argparse
from pathlib import Path

import xarray as xr

from viscotrain import datasets, movies, provenance
from viscotrain.command import reporting
from viscotrain.config import Study, load_study, parse_study, with_fitted_fluid
from viscotrain.interpolation import VelocityTable


def main(study: Study, table: str | Path, trains: str | Path, output: str | Path):
    """Film the first repeat of a train and write what the cameras see."""
    train = xr.load_dataset(trains)
    deborah, phi = float(train["deborah"]), float(train["volume_fraction"])
    result = movies.film(
        VelocityTable.open(table).at(deborah),
        train,
        field_of_view=study.movie_field_of_view(),
        interval=study.movies.interval,
        frames=study.movies.frames,
    )
    result.attrs = provenance.attributes(
        f"positions of spheres in the movies of study {study.study} at De = {deborah:g}, "
        f"phi = {phi:g}",
        study.resolved_yaml(),
    ) | {"movies_digest": provenance.digest(provenance.MOVIES)}
    datasets.write(result, output)
    print(output)


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("table", help="velocity table")
    parser.add_argument("trains", help="netCDF file of the trains stage")
    parser.add_argument("output", help="netCDF file to write")
    a = parser.parse_args()
    with reporting():
        main(with_fitted_fluid(load_study(a.configfile)), a.table, a.trains, a.output)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(
            with_fitted_fluid(parse_study(snakemake.config)),  # noqa: F821
            snakemake.input.table,  # noqa: F821
            snakemake.input.trains,  # noqa: F821
            snakemake.output[0],  # noqa: F821
        )
elif __name__ == "__main__":
    _command_line()
