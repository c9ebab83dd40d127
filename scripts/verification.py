"""Verification stage: one comparison or study of convergence; what, the rule says.

From the command line, each with --configfile config/config.yaml and an OUTPUT:
python scripts/verification.py start_up --input TRAJECTORY
python scripts/verification.py closure_train --input TABLE --deborah 5
python scripts/verification.py closure_gap --gap 0.5
python scripts/verification.py convergence --kind mesh --sp 1.5 --sf 2.5
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported

from pathlib import Path

import xarray as xr

from viscotrain.config.models import (
    Study,
    load_study,
    parse_distance,
    parse_study,
    with_fitted_fluid,
)
from viscotrain.flow.geometry import Geometry
from viscotrain.flow.process import use_one_core
from viscotrain.jobs import datasets, provenance
from viscotrain.jobs.command import reporting
from viscotrain.studies import closure, transient
from viscotrain.studies.accuracy import KINDS, largest_difference
from viscotrain.studies.convergence import convergence_rows
from viscotrain.studies.start_up import compare_start_up
from viscotrain.table.interpolation import VelocityTable


def start_up(study: Study, output: Path, trajectory: str):
    """Quasi-steady velocities along a start-up."""
    compared = compare_start_up(study, xr.load_dataset(trajectory), report=print)
    datasets.write(compared, output)


def closure_train(study: Study, output: Path, table: str, deborah: float):
    """A short train, directly and by the model; a killed run goes on.

    At De = 0, where it is cheap, once more with smaller elements and time steps.
    """
    settings = study.verification.closure
    checkpoint = output.with_name(output.name + ".checkpoint.npz")
    checkpoint.parent.mkdir(parents=True, exist_ok=True)
    train = Geometry.train(study.confinement, settings.distances, study.dns.margin)
    trajectory, _ = transient.follow_from_rest(
        study,
        train,
        deborah,
        until=settings.duration,
        report=print,
        checkpoint=checkpoint,
        code=provenance.digest(provenance.TRANSIENT),
    )
    trajectory = provenance.stamped(trajectory, study.resolved_yaml())
    if deborah == 0:
        finer, _ = transient.follow_from_rest(
            closure.refined(study), train, deborah, until=settings.duration, report=print
        )
        trajectory = closure.with_refinement(trajectory, finer)
    velocities = VelocityTable.open(table).at(deborah)
    start = transient.start_up_time(study, deborah)
    compared = closure.with_model(trajectory, velocities, start)
    print(f"largest difference: {largest_difference(compared):.3g} d")
    datasets.write(compared, output)
    checkpoint.unlink(missing_ok=True)


def closure_gap(study: Study, output: Path, gap: float):
    """Equally spaced spheres, directly and by the triplets."""
    _write_csv(closure.error_at_gap(study, gap, report=print), output)


def convergence(study: Study, output: Path, kind: str, sp: float, sf: float):
    """One triplet with other settings of one kind."""
    _write_csv(convergence_rows(study, kind, sp, sf, report=print), output)


def _write_csv(table, output: Path):
    output.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(output, index=False, float_format="%.9g", lineterminator="\n")


WORK = {work.__name__: work for work in (start_up, closure_train, closure_gap, convergence)}


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("work", choices=WORK)
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("--input", help="trajectory or velocity table")
    parser.add_argument("--deborah", type=float)
    parser.add_argument("--gap", type=float, help="in d")
    parser.add_argument("--kind", choices=KINDS)
    parser.add_argument("--sp", type=parse_distance, help="in d")
    parser.add_argument("--sf", type=parse_distance, help="in d")
    parser.add_argument("output", type=Path, help="file to write")
    given = vars(parser.parse_args())
    names = ("input", "kind", "sp", "sf", "deborah", "gap")
    values = [given[name] for name in names if given[name] is not None]
    with reporting():
        use_one_core()
        study = with_fitted_fluid(load_study(given["configfile"]))
        WORK[given["work"]](study, given["output"], *values)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        use_one_core()
        wildcards = snakemake.wildcards  # noqa: F821
        values = {
            name: value if name == "kind" else float(value) for name, value in wildcards.items()
        }
        WORK[snakemake.rule](  # noqa: F821
            with_fitted_fluid(parse_study(snakemake.config)),  # noqa: F821
            Path(snakemake.output[0]),  # noqa: F821
            *snakemake.input.get("source", []),  # noqa: F821
            **(values if snakemake.rule != "start_up" else {}),  # noqa: F821
        )
elif __name__ == "__main__":
    _command_line()
