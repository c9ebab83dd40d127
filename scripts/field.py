"""Dns stage, for a figure: mesh and fields at one point of the table.

From the command line: python scripts/field.py --configfile config/config.yaml OUTPUT
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported


from viscotrain.config.models import Study, load_study, parse_study, with_fitted_fluid
from viscotrain.flow.process import use_one_core
from viscotrain.jobs import datasets, provenance
from viscotrain.jobs.command import reporting
from viscotrain.studies.dns import field


def main(study: Study, output: str):
    """Solve the point that the config names and write its fields."""
    use_one_core()
    point = study.field_point()
    sampled = field(study, point.sp, point.sf, point.deborah, report=print)
    datasets.write(provenance.stamped(sampled, study.resolved_yaml()), output)


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("output", help="netCDF file to write")
    arguments = parser.parse_args()
    with reporting():
        main(with_fitted_fluid(load_study(arguments.configfile)), arguments.output)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        study = with_fitted_fluid(parse_study(snakemake.config))  # noqa: F821
        main(study, snakemake.output[0])  # noqa: F821
elif __name__ == "__main__":
    _command_line()
