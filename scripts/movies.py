"""Movies stage: a film -> movies of all cameras, and all stations at a moment.

python scripts/movies.py --configfile config/config.yaml FILM UNITS FOLDER [FIGURES]
"""

from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.config.names import train_name
from viscotrain.drawing import encoding, movies
from viscotrain.jobs import datasets, drawings
from viscotrain.jobs.entry import Film, Job, Units, folder_for, made, run

Movies = Annotated[Path, made("folder to write movies to", key="movies")]
Figures = Annotated[Path | None, folder_for("stations")]


def main(job: Job, film: Film, units: Units, folder: Movies, figures: Figures = None):
    """Make the movies, and draw what all cameras see at one moment."""
    seen, physical = datasets.read(film), datasets.read(units)
    if figures:
        given = seen.attrs["given"]
        train = train_name(float(seen["deborah"]), float(seen[given]), given.startswith("feed"))
        name = f"stations_{train}"
        drawing = movies.stations(seen, physical)
        made_by = job.attributes(f"data of the figure {name}")
        drawings.save(drawing, figures / name, made_by, note=seen.attrs.get("channel", ""))
    if not encoding.ffmpeg():
        print("no ffmpeg found: movies are GIF, larger and coarser than MP4")
    for path in movies.make(seen, physical, folder, **dict(job.settings)):
        print(path)


run(main, settings=stages.movies)
