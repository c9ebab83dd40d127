"""Design map stage: trains of all conditions -> the map in physical units, and its figures.

From the command line:
python scripts/design_map.py --configfile config/config.yaml OUTPUT POINT... [--figures FOLDER]
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from viscotrain.config.models import Study, load_study, parse_study, with_fitted_fluid
from viscotrain.drawing import figures
from viscotrain.jobs import datasets, drawings, provenance
from viscotrain.jobs.command import reporting
from viscotrain.trains import design_map


def main(
    study: Study,
    points: Sequence[str | Path],
    output: str | Path,
    figures_folder: str | Path | None = None,
):
    """Combine the trains of all conditions, write the map and draw it."""
    result = design_map.combine(
        [xr.load_dataset(path) for path in points],
        fluid=study.dimensionless_fluid,
        ordered_variation=study.design_map.ordered_variation,
        attributes=provenance.attributes(
            f"design map of study {study.study}", study.resolved_yaml()
        ),
    )
    datasets.write(result, output)
    print(design_map.headline(result))
    if figures_folder:
        for name in ("spacing_law", "design_map"):
            drawing = figures.draw(name, result, study.confinement)
            drawings.save(drawing, Path(figures_folder) / name)


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("output", help="netCDF file to write")
    parser.add_argument("points", nargs="+", help="files that trains.py --design-map wrote")
    parser.add_argument("--figures", help="folder to draw into")
    arguments = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(arguments.configfile))
        main(study, arguments.points, arguments.output, arguments.figures)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        study = with_fitted_fluid(parse_study(snakemake.config))  # noqa: F821
        figures_folder = Path(snakemake.output.figure).parent  # noqa: F821
        main(study, snakemake.input.points, snakemake.output.map, figures_folder)  # noqa: F821
elif __name__ == "__main__":
    _command_line()
