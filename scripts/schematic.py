"""Figures stage: config -> schematic of the triplet and of the train, to scale.

From the command line: python scripts/schematic.py --configfile config/config.yaml FOLDER
"""

import argparse
import os
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported

from viscotrain import figures, provenance, schematic
from viscotrain.command import reporting
from viscotrain.config import Study, load_study, parse_study


def main(study: Study, folder: str | Path):
    """Draw the schematic and write it with its data."""
    drawing = schematic.draw(schematic.geometry(study))
    drawing.data.attrs = provenance.attributes(
        f"data of the schematic of study {study.study}", study.resolved_yaml()
    )
    for path in figures.save(drawing, Path(folder) / "schematic"):
        print(path)


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("folder", help="where to write")
    arguments = parser.parse_args()
    with reporting():
        main(load_study(arguments.configfile), arguments.folder)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(parse_study(snakemake.config), Path(snakemake.output[0]).parent)  # noqa: F821
elif __name__ == "__main__":
    _command_line()
