"""Figures stage, for the fluid: moduli and viscosity as PNG, PDF and CSV.

From the command line: python scripts/rheology.py --configfile config/config.yaml FOLDER [FIT]
"""

import argparse
from pathlib import Path

import xarray as xr

from viscotrain import figures
from viscotrain.command import reporting
from viscotrain.config import Study, load_study, parse_study, with_fitted_fluid
from viscotrain.rheology_figure import rheology


def main(study: Study, folder: str | Path, fit: str | Path | None = None):
    """Draw the fluid of the study, with the data that it was fitted to, if any."""
    measured = None
    if fit is not None:
        numbers = xr.load_dataset(fit)[["quantity", "abscissa", "measured"]]
        measured = numbers.drop_vars(["parameter", "other_parameter", "modes"], errors="ignore")
        measured = measured.to_dataframe()
    drawing = rheology(study.fluid, measured, study.shear_rates())
    for path in figures.save(drawing, Path(folder) / "rheology"):
        print(path)


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("folder", help="where to write")
    parser.add_argument("fit", nargs="?", help="netCDF file of the fit, for its data")
    arguments = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(arguments.configfile))
        main(study, arguments.folder, arguments.fit)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(
            with_fitted_fluid(parse_study(snakemake.config)),  # noqa: F821
            Path(snakemake.output[0]).parent,  # noqa: F821
            snakemake.input.get("fit"),  # noqa: F821
        )
elif __name__ == "__main__":
    _command_line()
