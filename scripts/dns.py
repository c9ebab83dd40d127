"""Dns stage: one geometry (sp, sf) at all Deborah numbers at which the study needs it.

From the command line:
python scripts/dns.py --configfile config/config.yaml --sp 1.5 --sf inf OUTPUT [TIMING]
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported

from pathlib import Path

from viscotrain.config.models import (
    Study,
    geometry_name,
    load_study,
    parse_distance,
    parse_study,
    with_fitted_fluid,
)
from viscotrain.flow.process import use_one_core
from viscotrain.jobs import datasets, progress, provenance
from viscotrain.jobs.command import announce, reporting
from viscotrain.studies.dns import solve_geometry


def main(study: Study, sp: float, sf: float, output: str, timing: str | None = None):
    """Solve, write the dataset and, beside it, the CPU time."""
    use_one_core()
    folder = Path(output).with_suffix("") if study.dns.save_fields else None
    result, seconds = solve_geometry(study, sp, sf, report=print, vtu_folder=folder)
    datasets.write(provenance.stamped(result, study.resolved_yaml()), output)
    if timing:
        Path(timing).parent.mkdir(parents=True, exist_ok=True)
        seconds.to_csv(timing, index=False)
    announce(progress.line(study, geometry_name(sp, sf), result, Path(output).parent.parent))


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("--sp", type=parse_distance, required=True, help="in d, or inf")
    parser.add_argument("--sf", type=parse_distance, required=True, help="in d, or inf")
    parser.add_argument("output", help="netCDF file to write")
    parser.add_argument("timing", nargs="?", help="CSV file for CPU times")
    arguments = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(arguments.configfile))
        main(study, arguments.sp, arguments.sf, arguments.output, arguments.timing)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(
            with_fitted_fluid(parse_study(snakemake.config)),  # noqa: F821
            parse_distance(snakemake.wildcards.sp),  # noqa: F821
            parse_distance(snakemake.wildcards.sf),  # noqa: F821
            snakemake.output.result,  # noqa: F821
            snakemake.output.timing,  # noqa: F821
        )
elif __name__ == "__main__":
    _command_line()
