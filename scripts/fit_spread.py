"""Fit_spread stage: fluids drawn from the fit -> De, velocity, pressure, order and config of each.

python scripts/fit_spread.py --configfile config/mine.yaml --draws 20 FIT ORDER OUTPUT CONFIGS...
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain import files
from viscotrain.config import stages
from viscotrain.config.device_settings import (
    FitSpreadSettings,
)
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Job, Result, made, option, run, taken
from viscotrain.studies import fit_spread

Draws = Annotated[int, option("how many fluids are drawn")]


def settings(study, draws: Draws = 20) -> FitSpreadSettings:
    """Those of the study, which no longer says how many once its fluid is fitted."""
    return stages.fit_spread(study).model_copy(update={"draws": draws})


def main(
    job: Job,
    fit: Annotated[Path, taken("fit.nc of the stage fluid_fit")],
    order: Annotated[Path, taken("order.nc of the stage order")],
    result: Result,
    configs: Annotated[Sequence[Path], made("a config for each draw to write")] = (),
):
    """Write and print the spread, and configs of the draws."""
    own, fitted = job.settings, datasets.read(fit)
    fluids = fit_spread.fluids_of(fitted, own)
    names = [str(name) for name in fitted["parameter"].values]
    found = fit_spread.spread(fluids, names, datasets.read(order), own)
    job.write(found, result, "spread of the fit")
    print("\n".join(fit_spread.headline(found)))
    for path, text in zip(configs, fit_spread.configs(fluids, own), strict=False):
        files.write_text(text, path)


run(main, settings=settings)
