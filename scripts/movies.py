"""Movies stage, second half: positions at the times of the frames -> movies of all cameras.

From the command line:
python scripts/movies.py --configfile config/config.yaml FILM FOLDER
"""

import argparse
from pathlib import Path

import xarray as xr

from viscotrain import movies
from viscotrain.command import reporting
from viscotrain.config import Study, load_study, parse_study, with_fitted_fluid


def main(study: Study, film: str | Path, folder: str | Path):
    """Draw and encode the movies of one train."""
    if not movies.ffmpeg():
        print("no ffmpeg found: movies are GIF, larger and coarser than MP4")
    look = {"width": study.movies.width, "frame_rate": study.movies.frame_rate}
    for path in movies.make(xr.load_dataset(film), folder, **look):
        print(path)


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("film", help="netCDF file that film.py wrote")
    parser.add_argument("folder", help="where to write")
    arguments = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(arguments.configfile))
        main(study, arguments.film, arguments.folder)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        study = with_fitted_fluid(parse_study(snakemake.config))  # noqa: F821
        main(study, snakemake.input[0], snakemake.output[0])  # noqa: F821
elif __name__ == "__main__":
    _command_line()
