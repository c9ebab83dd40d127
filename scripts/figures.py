"""Figures stage: what a stage has made -> figures as PNG, PDF and their data.

One job draws the figures that have the same input: a figure takes less time than the start of a
job. From the command line, with the name of a figure as in results/<study>/figures/:

python scripts/figures.py --configfile config/config.yaml relative_velocities_De5 INPUT FOLDER
python scripts/figures.py --configfile config/config.yaml schematic FOLDER
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.config.device_settings import (
    FiguresSettings,
)
from viscotrain.drawing import figures
from viscotrain.jobs import drawings
from viscotrain.jobs.entry import Duct, Job, folder_of, made, run, taken


def settings(study, name: Sequence[str]) -> FiguresSettings:
    """What the figure of this name needs."""
    return stages.figures(study, *name)


def name_of(path: str) -> str:
    """The name of a figure, of its file or as it is."""
    return path.rpartition("/")[2].removesuffix(".png")


def main(
    job: Job,
    *,
    name: Annotated[Sequence[str], made("of the figure", key="png", convert=name_of, single=True)],
    source: Annotated[Path | None, taken("velocity table, trains or what else it shows")] = None,
    folder: Annotated[Path, made("where to write", key="png", convert=folder_of)],
    field: Annotated[Path | None, taken("fields, for stress_field", named=True)] = None,
    units: Annotated[Path | None, taken("units.nc, for trains", named=True)] = None,
    duct: Duct = None,
    measured: Annotated[Path | None, taken("file of measured.py, for spacing", named=True)] = None,
):
    """Draw the figures of these names and write them with their data."""
    for figure in name:
        shown = field if field and figure == "stress_field" else source
        own = job.attributes(f"data of the figure {figure}")
        note = "" if figure in ("rheology", "schematic") else job.settings.section.remark
        drawing = figures.draw_with(job.settings, figure, shown, units, measured, duct)
        for path in drawings.save(drawing, folder / figure, own, note):
            print(path)


run(main, settings=settings)
