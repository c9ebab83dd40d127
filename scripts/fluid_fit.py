"""Fluid_fit stage: measured moduli, viscosities, N1 -> Giesekus modes and solvent viscosity.

From the command line, without a config: writes fluid.yaml (a section to paste into a config),
fit.nc (uncertainties, residuals) and the figure rheology into a folder:

python scripts/fluid_fit.py oscillation.csv shear.csv --modes 2 FOLDER
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain.config.settings import FluidFitSettings
from viscotrain.files import write_text
from viscotrain.fluid import fit_report, fluid_fit, measurements
from viscotrain.fluid.fit_parameters import Known
from viscotrain.jobs import datasets, drawings
from viscotrain.jobs.entry import Job, folder_for, number_or_none, option, positive, run, taken

Modes = Annotated[int | None, option("number of modes; chosen unless given", choices=range(7))]
Solvent = Annotated[float | None, option("in Pa s; fitted unless given", convert=positive)]
LONGEST_FIRST = option("known ones, longest relaxation time first, or none", convert=number_or_none)


def settings(
    modes: Modes = None,
    solvent_viscosity: Solvent = None,
    relaxation_times: Annotated[Sequence[float], LONGEST_FIRST] = (),
    mobilities: Annotated[Sequence[float], LONGEST_FIRST] = (),
) -> FluidFitSettings:
    """As they are asked for."""
    known = {"relaxation_times": relaxation_times, "mobilities": mobilities}
    return FluidFitSettings(modes=modes, solvent_viscosity=solvent_viscosity, **known)


def main(
    job: Job,
    files: Annotated[Sequence[Path], taken("CSV files; columns: config/README.md")],
    folder: Annotated[Path, folder_for("fluid")],
):
    """Fit to the files; write the fluid and the details, and by hand draw them."""
    own = job.settings
    known = Known(own.solvent_viscosity, own.relaxation_times, own.mobilities)
    result = fluid_fit.fit(measurements.read(files), own.modes, known)
    print(fit_report.summary(result))
    text = fit_report.as_yaml(result.chosen)
    attributes = job.attributes("fluid fitted to measured data") | {"fluid": text}
    folder.mkdir(parents=True, exist_ok=True)
    datasets.write(fit_report.dataset(result, attributes), folder / "fit.nc")
    write_text(text, folder / "fluid.yaml")
    if job.by_hand:
        from viscotrain.drawing.rheology_figure import rheology

        drawings.save(rheology(result.chosen.fluid, result.chosen.data), folder / "rheology")


run(main, settings=settings)
