"""Figures stage: what a stage has made -> figures as PNG, PDF and their data.

One job draws the figures that have the same input: a figure takes less time than the start of a
job. From the command line, with the name of a figure as in results/<study>/figures/:
python scripts/figures.py --configfile config/config.yaml relative_velocities_De5 INPUT FOLDER
python scripts/figures.py --configfile config/config.yaml schematic FOLDER
"""

import argparse
from pathlib import Path

import xarray as xr

from viscotrain.config.models import Study, load_study, parse_study, with_fitted_fluid
from viscotrain.drawing import figures
from viscotrain.drawing.style import Drawing
from viscotrain.jobs import drawings, provenance
from viscotrain.jobs.command import reporting

# What a figure shows, by the beginning of its name; the first that fits counts.
SOURCES = {
    "relative_velocities": "table",
    "pair_velocity": "table",
    "stress_field": "field",
    "spacing_law": "design_map",
    "spacing": "train",
    "train": "train",
    "stations": "film",
    "design_map": "design_map",
    "rheology": "fit",
}


def draw(study: Study, name: str, source: str | Path | None) -> Drawing:
    """The figure of this name, from a file if it shows one."""
    if name == "schematic":
        from viscotrain.drawing import schematic

        return schematic.draw(schematic.geometry(study))
    if name == "rheology":
        from viscotrain.drawing import rheology_figure

        measured = rheology_figure.measured(source) if source else None
        return rheology_figure.rheology(study.physical_fluid, measured, study.shear_rates())
    return figures.draw(name, xr.load_dataset(source), study.confinement)


def main(study: Study, name: str, source: str | Path | None, folder: str | Path):
    """Draw the figure of this name and write it with its data."""
    drawing = draw(study, name, source)
    if isinstance(drawing.data, xr.Dataset):
        drawing.data.attrs = provenance.attributes(
            f"data of the figure {name} of study {study.study}", study.resolved_yaml()
        )
    for path in drawings.save(drawing, Path(folder) / name):
        print(path)


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("name", help="of the figure, such as relative_velocities_De5")
    parser.add_argument("source", nargs="?", help="velocity table, trains or what else it shows")
    parser.add_argument("folder", help="where to write")
    arguments = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(arguments.configfile))
        main(study, arguments.name, arguments.source, arguments.folder)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        study = with_fitted_fluid(parse_study(snakemake.config))  # noqa: F821
        for png in map(Path, snakemake.output):  # noqa: F821
            if png.suffix == ".png":
                fitting = (shown for start, shown in SOURCES.items() if png.stem.startswith(start))
                source = snakemake.input.get(next(fitting, None))  # noqa: F821
                main(study, png.stem, source, png.parent)
elif __name__ == "__main__":
    _command_line()
