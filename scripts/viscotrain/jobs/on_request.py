"""What costs on request: the jobs of `verification` and `design`, with their files and CPU seconds.

Checks were measured in the verification of the demo, on two cores, start-up of a job included. That
of the full study, up to De = 62, took 1.6 times as long as these numbers say. This module imports
neither numpy nor pandas: the workflow reads it before it plans.
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

from viscotrain.config import stages
from viscotrain.config.names import geometry_name, number_name, point_name
from viscotrain.config.study import Study
from viscotrain.jobs.resources import OTHERS, flow_seconds, train_seconds
from viscotrain.trains.design_conditions import volume_fractions
from viscotrain.words import FASTEST

# CPU seconds of a check over those of a geometry through all its Deborah numbers.
OVER_A_FLOW = {
    "transient": 5.1,
    "start_up": 4.9,
    "closure_gap": 1.6,
    "mesh": 4.0,
    "order": 2.0,
    "box": 5.5,
}
TIME_STEP = 20.0  # CPU seconds of a study of the time step
SHORT_TRAIN = 0.035  # CPU seconds of a train that is simulated directly, per sphere and D/Ubar
SLOWEST = 0.8 * FASTEST  # Ubar, of a single sphere: slower ones are closer at a rate, and cost more


class Request(NamedTuple):
    """A job of something that is made on request.

    Attributes:
        stage: Its rule.
        file: One that it makes, below the results of the study.
        seconds: CPU.
    """

    stage: str
    file: str
    seconds: float


def of_verification(study: Study) -> Iterator[Request]:
    """Jobs of `snakemake verification` beside the table."""
    check = study.verification
    for point in check.transient:
        name = point_name(point.sp, point.sf, point.deborah)
        seconds = flow_seconds(_longest(study, point))
        yield Request("transient", f"transient/{name}.nc", OVER_A_FLOW["transient"] * seconds)
        file = f"verification/start_up/{name}.nc"
        yield Request("start_up", file, OVER_A_FLOW["start_up"] * seconds)
    yield from _of_closure(study)
    most = flow_seconds(_longest(study))
    for triplet in check.convergence.geometries:
        for kind in ("mesh", "order", "box", "time_step"):
            file = f"verification/convergence/{kind}_{geometry_name(triplet.sp, triplet.sf)}.csv"
            seconds = TIME_STEP if kind == "time_step" else OVER_A_FLOW[kind] * most
            yield Request("convergence", file, seconds)
    yield Request("report", "verification/accuracy.md", OTHERS["verification_report"][0])


def _of_closure(study: Study) -> Iterator[Request]:
    closure, deborahs = study.verification.closure, study.closure_deborahs
    spheres = len(closure.distances) + 1
    for De in deborahs:
        file = f"verification/closure/train_De{number_name(De)}.nc"
        yield Request("closure_train", file, SHORT_TRAIN * spheres * closure.duration)
    for gap in closure.gaps if deborahs else ():
        file = f"verification/closure/gap{number_name(gap)}.csv"
        highest = flow_seconds(max(map(study.deborah_longest_mode, deborahs)))
        yield Request("closure_gap", file, OVER_A_FLOW["closure_gap"] * highest)


def _longest(study: Study, point=None) -> float:
    """De of the longest mode, of a point or the largest one of the study."""
    return study.deborah_longest_mode(point.deborah if point else max(study.deborah.values))


def of_design(study: Study) -> Iterator[Request]:
    """Jobs of `snakemake design` beside the table."""
    duct = study.channel.section.is_duct
    yield Request("units", "units.nc", 0.0)
    yield Request("channel_flow", "channel_flow.nc", duct * OTHERS["channel_flow"][0])
    for De in (De for De in study.deborah.values if De > 0):
        tried = (phi for phi in _fractions(study, De) if not math.isnan(phi))
        seconds = sum(train_seconds(study, phi, study.design) for phi in tried)
        file = f"design/De{number_name(De)}_s{number_name(study.design.spacing[0])}.nc"
        yield Request("design_trains", file, seconds)
    yield Request("design", "design/design.txt", OTHERS["design"][0])


def _fractions(study: Study, deborah: float) -> list[float]:
    """Of the trains that are tried; a wanted rate is left out while the fluid is not known."""
    rate = stages.encapsulation(study).bead_rate
    if rate is not None:
        longest = study.deborah_longest_mode(deborah)
        known = study.fluid.modes is not None
        rate = rate * study.fluid.physical().longest_relaxation_time / longest if known else None
    return volume_fractions(
        study.design.spacing,
        rate=rate,
        isolated=SLOWEST,
        confinement=study.confinement,
        section=study.channel.section,
    )


REQUESTS: dict[str, Callable[[Study], Iterator[Request]]] = {
    "verification": of_verification,
    "design": of_design,
}
