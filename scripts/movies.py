"""Movies stage: velocity table and trains -> movies of all cameras, and all stations at a moment.

From the command line:
python scripts/movies.py --configfile config/config.yaml TABLE TRAINS FILM FOLDER [FIGURES]
"""

import argparse
from pathlib import Path

import xarray as xr

from viscotrain.config.models import Study, load_study, parse_study, train_name, with_fitted_fluid
from viscotrain.drawing import encoding, figures, movies
from viscotrain.jobs import datasets, drawings, provenance
from viscotrain.jobs.command import reporting
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import films


def main(
    study: Study,
    table: str | Path,
    trains: str | Path,
    film: str | Path,
    folder: str | Path,
    figures_folder: str | Path | None = None,
):
    """Film the first repeat of a train, write what the cameras see, and make their movies."""
    positions = positions_of(study, table, trains)
    datasets.write(positions, film)
    print(film)
    if figures_folder:
        name = f"stations_{train_name(positions['deborah'], positions['volume_fraction'])}"
        drawing = figures.draw(name, positions, study.confinement)
        drawing.data.attrs = provenance.attributes(
            f"data of the figure {name} of study {study.study}", study.resolved_yaml()
        )
        drawings.save(drawing, Path(figures_folder) / name)
    if not encoding.ffmpeg():
        print("no ffmpeg found: movies are GIF, larger and coarser than MP4")
    look = {"width": study.movies.width, "frame_rate": study.movies.frame_rate}
    for path in movies.make(positions, folder, **look):
        print(path)


def positions_of(study: Study, table: str | Path, trains: str | Path) -> xr.Dataset:
    """What the cameras see of the first repeat of a train."""
    train = xr.load_dataset(trains)
    deborah, phi = float(train["deborah"]), float(train["volume_fraction"])
    result = films.film(
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
    return result


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("table", help="velocity table")
    parser.add_argument("trains", help="netCDF file of the trains stage")
    parser.add_argument("film", help="netCDF file to write, with positions")
    parser.add_argument("folder", help="where to write movies")
    parser.add_argument("figures", nargs="?", help="where to write the figure of all stations")
    a = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(a.configfile))
        main(study, a.table, a.trains, a.film, a.folder, a.figures)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(
            with_fitted_fluid(parse_study(snakemake.config)),  # noqa: F821
            snakemake.input.table,  # noqa: F821
            snakemake.input.trains,  # noqa: F821
            snakemake.output.film,  # noqa: F821
            snakemake.output.movies,  # noqa: F821
            Path(snakemake.output.stations).parent,  # noqa: F821
        )
elif __name__ == "__main__":
    _command_line()
