"""Figures stage: velocity table, field or trains -> one figure as PNG, PDF and its data.

From the command line, with the name of a figure as in results/<study>/figures/:
python scripts/figures.py --configfile config/config.yaml relative_velocities_De5 INPUT FOLDER
"""

import argparse
from pathlib import Path

import xarray as xr

from viscotrain import figures, provenance
from viscotrain.command import reporting
from viscotrain.config import Study, load_study, parse_study, with_fitted_fluid


def main(study: Study, name: str, source: str | Path, folder: str | Path):
    """Draw the figure of this name from a dataset and write it with its data."""
    drawing = figures.draw(name, xr.load_dataset(source), study.confinement)
    if isinstance(drawing.data, xr.Dataset):
        drawing.data.attrs = provenance.attributes(
            f"data of the figure {name} of study {study.study}", study.resolved_yaml()
        )
    for path in figures.save(drawing, Path(folder) / name):
        print(path)


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("name", help="of the figure, such as relative_velocities_De5")
    parser.add_argument("source", help="velocity table, field or trains, whichever it shows")
    parser.add_argument("folder", help="where to write")
    arguments = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(arguments.configfile))
        main(study, arguments.name, arguments.source, arguments.folder)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        png = Path(snakemake.output[0])  # noqa: F821
        study = with_fitted_fluid(parse_study(snakemake.config))  # noqa: F821
        main(study, png.stem, snakemake.input[0], png.parent)  # noqa: F821
elif __name__ == "__main__":
    _command_line()
