r"""Confinement stage: tables, orders and design maps of several diameters -> what compares them.

python scripts/confinement.py --configfile config/confinement.yaml RESULT SUMMARY PAGE FOLDER \
    --tables TABLE... --orders ORDER... --units UNITS... [--maps MAP...]
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.drawing import confinement_figure, confinement_page
from viscotrain.jobs import datasets, drawings
from viscotrain.jobs.entry import Job, Result, folder_for, run, taken
from viscotrain.studies import confinement
from viscotrain.table.interpolation import VelocityTable


def main(
    job: Job,
    *,
    result: Result,
    summary: Result,
    page: Result,
    folder: Annotated[Path, folder_for("figures")],
    tables: Annotated[Sequence[Path], taken("velocity tables", named=True)],
    orders: Annotated[Sequence[Path], taken("files of order.py", named=True)],
    units: Annotated[Sequence[Path], taken("units.nc", named=True)],
    maps: Annotated[Sequence[Path], taken("design maps", named=True)] = (),
):
    """Compare, draw, sum up and link."""
    own, trains = job.settings, [datasets.read(path) for path in orders]
    velocities = [VelocityTable.open(path) for path in tables]
    found = confinement.compare(velocities, trains, own.accuracy)
    job.write(found, result, "comparison of diameters")
    devices, of_maps = ([datasets.read(path) for path in paths] for paths in (units, maps))
    lines = confinement.summary(job.study, found, devices, of_maps, own)
    drawn = confinement_figure.draw_all(found, trains, of_maps, own.length)
    captions = {}
    for name, (caption, drawing) in drawn.items():
        captions[caption] = drawings.save(drawing, folder / name)[0]
    rows = list(confinement.rows(found, devices, of_maps))
    summary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    text = confinement_page.page(job.study, own.diameters, rows, captions, "\n".join(lines))
    page.write_text(text, encoding="utf-8")
    print(*lines, sep="\n")


run(main, settings=stages.confinement)
