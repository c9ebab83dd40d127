"""Movies stage: velocity table and trains -> movies of all cameras, and all stations at a moment.

python scripts/movies.py --configfile config/config.yaml TABLE TRAINS FILM FOLDER [FIGURES]
"""

from pathlib import Path

import xarray as xr

from viscotrain.config import stages
from viscotrain.config.names import train_name
from viscotrain.drawing import encoding, figures, movies
from viscotrain.jobs import drawings
from viscotrain.jobs.entry import Job, folder_of, made, run, taken
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import films


def main(
    job: Job, table: Path, trains: Path, film: Path, folder: Path, figures_folder: Path | None
):
    """Film the first repeat of a train, write what the cameras see, and make their movies."""
    train, look = xr.load_dataset(trains), job.settings
    deborah, phi = float(train["deborah"]), float(train["volume_fraction"])
    positions = films.film(
        VelocityTable.open(table).at(deborah),
        train,
        field_of_view=look.field_of_view,
        interval=look.interval,
        frames=look.frames,
    )
    title = f"positions of spheres in movies at De = {deborah:g}, phi = {phi:g}"
    job.write(positions, film, title)
    if figures_folder:
        name = f"stations_{train_name(deborah, phi)}"
        drawing = figures.draw(name, positions, look.confinement)
        drawings.save(drawing, figures_folder / name, job.attributes(f"data of the figure {name}"))
    if not encoding.ffmpeg():
        print("no ffmpeg found: movies are GIF, larger and coarser than MP4")
    for path in movies.make(positions, folder, width=look.width, frame_rate=look.frame_rate):
        print(path)


run(
    main,
    settings=stages.movies,
    arguments=[
        taken("table", "velocity table"),
        taken("trains", "netCDF file of the trains stage"),
        made("film", "netCDF file to write, with positions"),
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
