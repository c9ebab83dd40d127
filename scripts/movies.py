"""Movies stage: a film -> movies of all cameras, and all stations at a moment.

python scripts/movies.py --configfile config/config.yaml FILM UNITS FOLDER [FIGURES]
"""

from pathlib import Path

import xarray as xr

from viscotrain.config import stages
from viscotrain.config.names import train_name
from viscotrain.drawing import design_figures, encoding, movies
from viscotrain.jobs import drawings
from viscotrain.jobs.entry import Job, folder_of, made, run, taken


def main(job: Job, film: Path, units: Path, folder: Path, figures_folder: Path | None):
    """Make the movies, and draw what all cameras see at one moment."""
    seen, physical = xr.load_dataset(film), xr.load_dataset(units)
    if figures_folder:
        name = f"stations_{train_name(float(seen['deborah']), float(seen['volume_fraction']))}"
        drawing = design_figures.stations(seen, physical)
        drawings.save(drawing, figures_folder / name, job.attributes(f"data of the figure {name}"))
    if not encoding.ffmpeg():
        print("no ffmpeg found: movies are GIF, larger and coarser than MP4")
    for path in movies.make(seen, physical, folder, **dict(job.settings)):
        print(path)


run(
    main,
    settings=stages.movies,
    arguments=[
        taken("film", "netCDF file with positions, of film.py"),
        taken("units", "physical units of the study"),
        made("folder", "where to write movies", key="movies"),
        made(
            "figures_folder",
            "where to write the figure of all stations",
            key="stations",
            convert=folder_of,
            optional=True,
        ),
    ],
)
