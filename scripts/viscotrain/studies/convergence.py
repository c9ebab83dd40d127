"""Studies of convergence: relative velocities of a few triplets with other settings.

Relative velocities U_2 - U_1 and U_3 - U_2 of a few triplets with other settings:

    mesh       sizes of the first mesh times a factor, its accuracy times the cube of the factor
    order      polynomial order of the velocity, on the mesh that was found
    box        distance of the outer spheres to the periodic ends
    time_step  fixed steps of a start-up of one relaxation time, and the controlled steps

What errors and orders follow from them stands in `accuracy`.

Meshes are refined until the estimated error is as small as asked for. So a study of the mesh asks
for other accuracies, and begins with other sizes where the first mesh is accurate enough already.
The elements that a mesh may have follow the sizes.

The order is raised until the error is small, too, whatever the lowest one is. So a study of the
order takes one less and one more than the order found, on the mesh found.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from viscotrain.config.models import Resolution
from viscotrain.config.settings import TransientSettings
from viscotrain.flow.quasi_steady import in_order
from viscotrain.flow.time_stepping import Transient
from viscotrain.studies.accuracy import RELATIVE
from viscotrain.studies.dns import Report, solutions, solver_options, triplet
from viscotrain.studies.resolution import with_sizes
from viscotrain.studies.transient import flow_maker, time_options
from viscotrain.words import PARTICLES

MESH_FACTORS = (1.6, 1.0, 0.63)
ACCURACY_POWER = 3  # accuracies over sizes: factors of about 4, 1 and 1/4
ORDER_CHANGES = (-1, 0, 1)  # of the order found
BOX_FACTORS = (1.0, 2.0, 3.0)
STEPS = (10, 20, 40, 80)  # per relaxation time
CONTROLLED = 0.0  # in place of a step size: the default, controlled steps


def settings(
    study: TransientSettings, kind: str
) -> Iterator[tuple[float, bool, TransientSettings]]:
    """(value, whether it is the default, settings) of every setting of one kind, coarse to fine."""
    dns = study.dns

    def changed(**settings) -> TransientSettings:
        return study.model_copy(update={"dns": dns.model_copy(update=settings)})

    if kind == "mesh":
        for factor in MESH_FACTORS:
            yield factor, factor == 1, changed(**_refined(dns, factor))
    elif kind == "box":
        for factor in BOX_FACTORS:
            margin = factor * dns.margin
            yield margin, factor == 1, changed(margin=margin)


def _refined(dns: Resolution, factor: float) -> dict:
    """Settings with other sizes at the start and other accuracies."""
    accuracy = factor**ACCURACY_POWER
    return with_sizes(dns, factor) | {
        "accuracy": dns.accuracy * accuracy,
        "relative_accuracy": dns.relative_accuracy * accuracy,
        "max_unknowns": round(dns.max_unknowns / factor**2),
    }


def convergence_rows(
    study: TransientSettings, kind: str, sp: float, sf: float, report: Report
) -> pd.DataFrame:
    """Relative velocities of one triplet with all settings of one kind, one row each per De."""
    rows = []
    point = {"sp": sp, "sf": sf}
    if kind == "time_step":
        rows = [point | row for row in _time_step_rows(study, sp, sf)]
    elif kind == "order":
        rows = [point | row for row in _order_rows(study, sp, sf)]
    else:
        for value, default, variant in settings(study, kind):
            for De, solution in solutions(variant, triplet(variant, sp, sf)):
                flow = solution.flow
                row = {"deborah": De, "value": value, "default": default}
                row |= {"elements": flow.mesh.ne, "unknowns": flow.space.ndof}
                row |= {
                    "estimated_error": solution.estimated_error,
                    "accurate": solution.accurate,
                }
                rows.append(point | row | _relative(solution.velocities))
                report(str(rows[-1]))
    return pd.DataFrame(rows)


def _order_rows(study: TransientSettings, sp: float, sf: float) -> Iterator[dict]:
    """Orders around the one found, on its mesh."""
    for De, solution in solutions(study, triplet(study, sp, sf)):
        found = solution.flow.velocity_order
        for order in (found + change for change in ORDER_CHANGES) if solution.solved else ():
            default = order == found
            U = solution.velocities
            if not default:
                U = in_order(solution, order, solver_options(study))
            yield {
                "deborah": De,
                "value": order,
                "default": default,
                "elements": solution.flow.mesh.ne,
                **_relative(U),
            }


def _time_step_rows(study: TransientSettings, sp: float, sf: float) -> Iterator[dict]:
    """A start-up of one relaxation time at the smallest De above 0."""
    De = min((value for value in study.deborah if value > 0), default=0.0)
    if De == 0:
        return
    lambda_1 = study.deborah_longest_mode(De)
    own = time_options(study, De)
    for count in (*STEPS, None):
        step = lambda_1 / count if count else None
        options = replace(own, fixed_step=step)
        simulation = Transient(triplet(study, sp, sf), flow_maker(study, De), lambda_1, options)
        *_, end = simulation.run(lambda_1)
        yield {
            "deborah": De,
            "value": 1 / count if count else CONTROLLED,
            "default": count is None,
            "elements": simulation.flow.mesh.ne,
            "unknowns": simulation.flow.space.ndof,
            **_relative(dict(zip(simulation.flow.geometry.spheres, end.velocities, strict=True))),
            "steps": len(simulation.instants) - 1,
            "cpu_seconds": round(sum(instant.seconds for instant in simulation.instants), 1),
        }


def _relative(velocities: Mapping[str, float]) -> dict[str, float]:
    """Relative velocities by name; NaN for those of a sphere that is not there or not solved."""
    U = [velocities.get(name, math.nan) for name in PARTICLES]
    return dict(zip(RELATIVE, map(float, np.diff(U)), strict=True))
