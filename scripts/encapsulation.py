r"""Encapsulation stage: trains and points of the design map -> beads in droplets, and a figure.

python scripts/encapsulation.py --configfile config/config.yaml OUTPUT UNITS TRAIN... \
    [--points POINT...] [--table CSV] [--feeds CSV] [--figure FOLDER]
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.drawing.encapsulation_figure import draw_encapsulation
from viscotrain.jobs import datasets, drawings
from viscotrain.jobs.entry import Job, Result, Trains, Units, folder_of, made, run, taken
from viscotrain.trains import encapsulation

Points = Annotated[Sequence[Path], taken("files that trains.py --design-map wrote", named=True)]
Table = Annotated[Path | None, made("CSV file of all conditions", named=True)]
Feeds = Annotated[Path | None, made("CSV file of what gives the wanted bead rate", named=True)]
Folder = Annotated[Path | None, made("folder to draw into", convert=folder_of, named=True)]


def main(
    job: Job,
    result: Result,
    units: Units,
    trains: Trains,
    points: Points = (),
    table: Table = None,
    feeds: Feeds = None,
    figure: Folder = None,
):
    """Count beads in droplets, write and draw what was found."""
    conditions = [[datasets.read(path) for path in paths] for paths in (trains, points)]
    found = encapsulation.combine(*conditions, datasets.read(units), **dict(job.settings))
    job.write(found, result, "beads in droplets")
    print(*encapsulation.headline(found), sep="\n")
    datasets.write_csv(encapsulation.table(found), table, digits=6)
    datasets.write_csv(encapsulation.inverse_table(found), feeds, digits=6)
    if figure:
        attributes = job.attributes("data of the figure encapsulation")
        note = found.attrs.get("channel", "")
        drawings.save(draw_encapsulation(found), figure / "encapsulation", attributes, note)


run(main, settings=stages.encapsulation)
