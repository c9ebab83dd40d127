"""Transient stage: one geometry (sp, sf) at one Deborah number, from rest to after the start-up.

From the command line:
python scripts/transient.py --configfile config/config.yaml --sp 1.5 --sf 2.5 --deborah 5 OUTPUT
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported

from pathlib import Path

import pandas as pd

from viscotrain.config.models import (
    Study,
    load_study,
    parse_distance,
    parse_study,
    point_name,
    with_fitted_fluid,
)
from viscotrain.flow.process import use_one_core
from viscotrain.jobs import datasets, progress, provenance
from viscotrain.jobs.command import announce, reporting
from viscotrain.studies.dns import triplet
from viscotrain.studies.transient import follow_from_rest, start_up_time


def main(
    study: Study, sp: float, sf: float, deborah: float, output: str, timing: str | None = None
):
    """Simulate, write the dataset and, beside it, the CPU time; a killed run goes on."""
    use_one_core()
    checkpoint = Path(output).with_name(Path(output).name + ".checkpoint.npz")
    checkpoint.parent.mkdir(parents=True, exist_ok=True)
    result, steps = follow_from_rest(
        study,
        triplet(study, sp, sf),
        deborah,
        until=start_up_time(study, deborah),
        report=print,
        checkpoint=checkpoint,
        code=provenance.digest(provenance.TRANSIENT),
    )
    result = provenance.stamped(result.assign({"sp": sp, "sf": sf}), study.resolved_yaml())
    datasets.write(result, output)
    if timing:
        Path(timing).parent.mkdir(parents=True, exist_ok=True)
        seconds = round(sum(step.seconds for step in steps), 3)
        row = {"sp": sp, "sf": sf, "deborah": deborah, "steps": len(steps), "cpu_seconds": seconds}
        pd.DataFrame([row]).to_csv(timing, index=False)
    checkpoint.unlink(missing_ok=True)
    name = point_name(sp, sf, deborah)
    announce(progress.line(study, name, result, Path(output).parent.parent))


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("--sp", type=parse_distance, required=True, help="in d, or inf")
    parser.add_argument("--sf", type=parse_distance, required=True, help="in d, or inf")
    parser.add_argument("--deborah", type=float, required=True, help="Deborah number")
    parser.add_argument("output", help="netCDF file to write")
    parser.add_argument("timing", nargs="?", help="CSV file for CPU times")
    given = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(given.configfile))
        main(study, given.sp, given.sf, given.deborah, given.output, given.timing)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(
            with_fitted_fluid(parse_study(snakemake.config)),  # noqa: F821
            parse_distance(snakemake.wildcards.sp),  # noqa: F821
            parse_distance(snakemake.wildcards.sf),  # noqa: F821
            float(snakemake.wildcards.deborah),  # noqa: F821
            snakemake.output.result,  # noqa: F821
            snakemake.output.timing,  # noqa: F821
        )
elif __name__ == "__main__":
    _command_line()
