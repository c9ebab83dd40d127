"""Figures stage: what a stage has made -> figures as PNG, PDF and their data.

One job draws the figures that have the same input: a figure takes less time than the start of a
job. From the command line, with the name of a figure as in results/<study>/figures/:

python scripts/figures.py --configfile config/config.yaml relative_velocities_De5 INPUT FOLDER
python scripts/figures.py --configfile config/config.yaml schematic FOLDER
"""

from pathlib import Path

import xarray as xr

from viscotrain.config import stages
from viscotrain.config.settings import FiguresSettings
from viscotrain.drawing import figures, rheology_figure, schematic
from viscotrain.drawing.style import Drawing
from viscotrain.jobs import drawings
from viscotrain.jobs.entry import Job, folder_of, made, run, taken


def settings(study, name: list[str]) -> FiguresSettings:
    """What the figure of this name needs."""
    return stages.figures(study, *name)


def draw(own: FiguresSettings, name: str, source: Path | None, units: Path | None) -> Drawing:
    """The figure of this name, from a file if it shows one."""
    if name == "schematic":
        return schematic.draw(schematic.geometry(own.schematic))
    if name == "rheology":
        measured = rheology_figure.measured(source) if source else None
        return rheology_figure.rheology(own.rheology.fluid, measured, own.rheology.shear_rates())
    physical = xr.load_dataset(units) if units else None
    return figures.draw(name, xr.load_dataset(source), own.confinement, physical)


def main(
    job: Job,
    name: list[str],
    source: Path | None,
    folder: Path,
    field: Path | None,
    units: Path | None,
):
    """Draw the figures of these names and write them with their data."""
    for figure in name:
        shown = field if field and figure == "stress_field" else source
        own = job.attributes(f"data of the figure {figure}")
        for path in drawings.save(draw(job.settings, figure, shown, units), folder / figure, own):
            print(path)


def name_of(path: str) -> str:
    """The name of a figure, of its file or as it is."""
    return path.rpartition("/")[2].removesuffix(".png")


run(
    main,
    settings=settings,
    arguments=[
        made("name", "of the figure", key="png", convert=name_of, many=True, single=True),
        taken("source", "velocity table, trains or what else it shows", optional=True),
        made("folder", "where to write", key="png", convert=folder_of),
        taken("field", "fields, for the figure that shows them", flag="--field", optional=True),
        taken("units", "units.nc, for the figure of all stations", flag="--units", optional=True),
    ],
)
