r"""What a transient point costs against the quasi-steady one and against steps of a fixed size.

    python scripts/tools/benchmark_transient.py                    # sp = 1.5, sf = 2.5, De = 1

on the same mesh, in CPU seconds of one thread. The error of a step control is that of relative
velocities one relaxation time after the start, when they change most, against the limit of fixed
steps extrapolated from two sizes (order two). The march with fixed steps of the same error is not
run to its end: its cost is that of its steps so far, times their number.
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from viscotrain.config import stages
from viscotrain.config.names import parse_distance
from viscotrain.config.reading import load_study
from viscotrain.config.settings import TransientSettings
from viscotrain.flow.process import use_one_core
from viscotrain.flow.time_stepping import Instant, Transient
from viscotrain.jobs.command import reporting
from viscotrain.studies.dns import solutions, triplet
from viscotrain.studies.transient import flow_maker, start_up_time, time_options

ROOT = Path(__file__).parents[2]
ASKED = 75.0  # CPU s of a transient point
FIXED = (20, 40)  # steps per relaxation time


def seconds(instants: Sequence[Instant]) -> float:
    """CPU time of steps."""
    return sum(instant.seconds for instant in instants)


def relative(instant: Instant) -> np.ndarray:
    """Relative velocities of neighbours in Ubar."""
    return np.diff(instant.velocities)


def main(study: TransientSettings, sp: float, sf: float, deborah: float):
    """Measure and print."""
    use_one_core()
    lambda_1 = study.deborah_longest_mode(deborah)
    ((_, quasi_steady),) = solutions(study, triplet(study, sp, sf))

    def march(until: float, steps: int | None = None) -> list[Instant]:
        options = time_options(study, deborah)
        if steps:
            options = replace(options, fixed_step=lambda_1 / steps)
        geometry = triplet(study, sp, sf)
        return list(Transient(geometry, flow_maker(study, deborah), lambda_1, options).run(until))

    whole = march(start_up_time(study, deborah))
    controlled = march(lambda_1)
    coarse, fine = (march(lambda_1, steps) for steps in FIXED)
    limit = relative(fine[-1]) + (relative(fine[-1]) - relative(coarse[-1])) / 3
    errors = [np.abs(relative(run[-1]) - limit).max() for run in (controlled, fine)]
    equal = FIXED[1] * math.sqrt(errors[1] / errors[0])
    steps = equal * start_up_time(study, deborah) / lambda_1
    fixed = steps * seconds(fine) / len(fine)
    cost = seconds(whole)
    verdict = "met" if cost <= ASKED else "NOT MET"
    print(f"sp = {sp:g}, sf = {sf:g}, De = {deborah:g}")
    print(f"quasi-steady                {quasi_steady.seconds:8.1f} CPU s")
    print(
        f"transient, controlled steps {cost:8.1f} CPU s, {len(whole) - 1} steps "
        f"(asked: at most {ASKED:g}, {verdict}), error {errors[0]:.1e} Ubar after lambda_1"
    )
    print(
        f"transient, fixed steps      {fixed:8.1f} CPU s, {steps:.0f} steps at the same error "
        f"({FIXED[1]} steps per lambda_1: {errors[1]:.1e} Ubar)"
    )
    print(
        f"controlled over quasi-steady {cost / quasi_steady.seconds:.1f}, "
        f"fixed over controlled {fixed / cost:.1f}"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", default=ROOT / "config" / "config.yaml")
    parser.add_argument("--sp", type=parse_distance, default=1.5)
    parser.add_argument("--sf", type=parse_distance, default=2.5)
    parser.add_argument("--deborah", type=float, default=1.0)
    given = parser.parse_args()
    with reporting():
        study = stages.transient(load_study(given.configfile), given.deborah)
        main(study, given.sp, given.sf, given.deborah)
