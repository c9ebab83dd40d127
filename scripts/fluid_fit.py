"""Fluid_fit stage: measured moduli and viscosities -> Giesekus modes and solvent viscosity.

From the command line, without a config: writes fluid.yaml (a section to paste into a config),
fit.nc (uncertainties, residuals) and the figure rheology into a folder:
python scripts/fluid_fit.py oscillation.csv shear.csv --modes 2 FOLDER
"""

import argparse
import math
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported

from collections.abc import Sequence
from pathlib import Path

import yaml

from viscotrain.config.models import FluidConfig, parse_study
from viscotrain.drawing.rheology_figure import rheology
from viscotrain.fluid import fit_report, fluid_fit, measurements
from viscotrain.jobs import datasets, drawings, provenance
from viscotrain.jobs.command import reporting


def main(fluid: FluidConfig, files: Sequence[str | Path], output: str | Path, details: str | Path):
    """Fit to the files as the section `fluid` says; write the fluid and the details."""
    result = fluid_fit.fit(measurements.read(files), fluid.fit.modes, fluid.solvent_viscosity)
    print(fit_report.summary(result))
    section = yaml.safe_dump({"fluid": fluid.model_dump(mode="json")}, sort_keys=False)
    attributes = provenance.attributes("fluid fitted to measured data", section)
    attributes["fluid_fit_digest"] = provenance.digest(provenance.FLUID_FIT)
    attributes["fluid"] = fit_report.as_yaml(result.chosen)
    datasets.write(fit_report.dataset(result, attributes), details)
    Path(output).write_text(fit_report.as_yaml(result.chosen), encoding="utf-8")
    return result.chosen


def _positive(text: str) -> float:
    value = float(text)
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: number > 0")
    return value


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("files", nargs="+", help="CSV files; columns: config/README.md")
    parser.add_argument(
        "--modes", type=int, choices=range(7), help="number of modes; without it, chosen"
    )
    parser.add_argument("--solvent-viscosity", type=_positive, help="in Pa s; without it, fitted")
    parser.add_argument("folder", type=Path, help="where to write")
    a = parser.parse_intermixed_args()
    with reporting():
        fluid = FluidConfig(
            solvent_viscosity=a.solvent_viscosity, data=tuple(a.files), fit={"modes": a.modes}
        )
        a.folder.mkdir(parents=True, exist_ok=True)
        fitted = main(fluid, a.files, a.folder / "fluid.yaml", a.folder / "fit.nc")
        drawings.save(rheology(fitted.fluid, fitted.data), a.folder / "rheology")


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(
            parse_study(snakemake.config).fluid,  # noqa: F821
            snakemake.input,  # noqa: F821
            snakemake.output.fluid,  # noqa: F821
            snakemake.output.fit,  # noqa: F821
        )
elif __name__ == "__main__":
    _command_line()
