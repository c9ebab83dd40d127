"""Verification of a study: start-up against quasi-steady, and studies of convergence.

Start-up. Along a transient simulation the quasi-steady velocities at the present distances are
computed anew, on a mesh of their own; what remains between both after the start-up is the error of
dropping the time derivative.

Convergence. Relative velocities U_2 - U_1 and U_3 - U_2 of a few triplets with other settings:

    mesh       sizes of the first mesh times a factor, its accuracy times the cube of the factor
    order      polynomial order of the velocity
    box        distance of the outer spheres to the periodic ends
    time_step  fixed steps of a start-up of one relaxation time, and the controlled steps

The error of a setting is its difference from the finest one of the study. The observed order is the
slope of log(error) over log(size) for mesh and time step; for order and box, whose errors fall
exponentially, the factor per order or per D. Where errors are at the noise of the mesh, about 1e-6
Ubar, no order can be observed.

Meshes are refined until the estimated error is as small as asked for. So a study of the mesh asks
for other accuracies, and begins with other sizes where the first mesh is accurate enough already.
The elements that a mesh may have follow the sizes.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
import xarray as xr

from viscotrain.config import DnsConfig, Study
from viscotrain.dns import LOWEST_ORDER
from viscotrain.errors import SolutionError
from viscotrain.geometry import Geometry
from viscotrain.interpolation import PARTICLES
from viscotrain.simulation import Report, solutions, triplet
from viscotrain.trajectories import flow_maker, time_options
from viscotrain.transient import Transient

CHECK_TIMES = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0)  # after the start, in lambda_1
MESH_FACTORS = (1.6, 1.0, 0.63)
ACCURACY_POWER = 3  # accuracies over sizes: factors of about 4, 1 and 1/4
ORDER_CHANGES = (-1, 0, 1, 2)
BOX_FACTORS = (1.0, 2.0, 3.0)
STEPS = (10, 20, 40, 80)  # per relaxation time
CONTROLLED = 0.0  # in place of a step size: the default, controlled steps
KINDS = ("mesh", "order", "box", "time_step")
PAIRS = ["middle_minus_trailing", "leading_minus_middle"]
NOISE = 1e-6  # Ubar, of relative velocities between meshes

# ------------------------------------------------------------------------------------- start-up


def compare_start_up(study: Study, trajectory: xr.Dataset, report: Report) -> xr.Dataset:
    """A transient simulation of a triplet with quasi-steady velocities at the present distances.

    Returns:
        The trajectory with quasi_steady_velocity (check, sphere) at check_time (check).

    Raises:
        SolutionError: A quasi-steady simulation did not converge.
    """
    deborah = float(trajectory["deborah"])
    lambda_1 = float(trajectory["deborah_longest_mode"])
    end = float(trajectory["time"][-1]) / lambda_1
    wanted = [time for time in CHECK_TIMES if time <= end * (1 + 1e-9)]
    instants = [
        int(np.abs(trajectory["time"].values / lambda_1 - time).argmin()) for time in wanted
    ]
    velocities = []
    for n in instants:
        now = trajectory.isel(time=n)
        U = _quasi_steady(study, _present(study, now), deborah)
        velocities.append(U)
        difference = np.diff(now["velocity"].values) - np.diff(U)
        report(
            f"t = {float(now['time']) / lambda_1:.3g} relaxation times: relative velocities, "
            "transient minus quasi-steady: " + " ".join(f"{value:+.2e}" for value in difference)
        )
    return trajectory.assign(
        quasi_steady_velocity=(
            ("check", "sphere"),
            np.array(velocities).reshape(len(instants), trajectory.sizes["sphere"]),
            {
                "long_name": "quasi-steady velocity at the present distances, over mean velocity",
                "units": "1",
            },
        ),
        check_time=(
            "check",
            trajectory["time"].values[instants],
            {"long_name": "time times mean velocity over channel diameter", "units": "1"},
        ),
    )


def _present(study: Study, now: xr.Dataset) -> Geometry:
    """The triplet at one time of its trajectory."""
    distances = iter(now["distance"].values)
    sp, sf = (next(distances) if math.isfinite(now[name]) else math.inf for name in ("sp", "sf"))
    return triplet(study, float(sp), float(sf))


def _quasi_steady(study: Study, geometry: Geometry, deborah: float) -> np.ndarray:
    for De, solution in solutions(study, geometry, up_to=deborah):
        if not solution.solved:
            raise SolutionError(f"De {De:g}: {solution.convergence.reason}")
    return np.array(list(solution.velocities.values()))


def remaining_differences(comparison: xr.Dataset) -> np.ndarray:
    """Relative velocities, transient minus quasi-steady, in Ubar, shape (check, gap)."""
    at = comparison.sel(time=comparison["check_time"])["velocity"].values
    return np.diff(at - comparison["quasi_steady_velocity"].values, axis=-1)


# ---------------------------------------------------------------------------------- convergence


def settings(study: Study, kind: str) -> Iterator[tuple[float, bool, Study]]:
    """(value, whether it is the default, study) of every setting of one kind, coarse to fine."""
    dns = study.dns

    def changed(**settings) -> Study:
        return study.model_copy(update={"dns": dns.model_copy(update=settings)})

    if kind == "mesh":
        for factor in MESH_FACTORS:
            yield factor, factor == 1, changed(**_refined(dns, factor))
    elif kind == "order":
        for change in ORDER_CHANGES:
            order = dns.velocity_order + change
            if order >= LOWEST_ORDER:
                yield order, change == 0, changed(velocity_order=order)
    elif kind == "box":
        for factor in BOX_FACTORS:
            margin = factor * dns.margin
            yield margin, factor == 1, changed(margin=margin)


def _refined(dns: DnsConfig, factor: float) -> dict:
    """Settings with other sizes at the start and other accuracies."""
    accuracy = factor**ACCURACY_POWER
    return {
        "sphere_elements": round(dns.sphere_elements / factor),
        "axis_size": dns.axis_size * factor,
        "wall_size": dns.wall_size * factor,
        "accuracy": dns.accuracy * accuracy,
        "relative_accuracy": dns.relative_accuracy * accuracy,
        "max_elements": round(dns.max_elements / factor**2),
    }


def convergence_rows(study: Study, kind: str, sp: float, sf: float, report: Report) -> pd.DataFrame:
    """Relative velocities of one triplet with all settings of one kind, one row each per De."""
    rows = []
    point = {"sp": sp, "sf": sf}
    if kind == "time_step":
        rows = [point | row for row in _time_step_rows(study, sp, sf)]
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


def _time_step_rows(study: Study, sp: float, sf: float) -> Iterator[dict]:
    """A start-up of one relaxation time at the smallest De above 0."""
    De = min((value for value in study.deborah.values if value > 0), default=0.0)
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
    return dict(zip(PAIRS, map(float, np.diff(U)), strict=True))


def with_errors(rows: pd.DataFrame, kind: str) -> pd.DataFrame:
    """Add `error`: the largest difference of a relative velocity from the finest setting.

    For the time step the limit is extrapolated from the two smallest fixed ones (order two).
    """
    point = ["sp", "sf", "deborah"]
    finest = {"mesh": min, "order": max, "box": max, "time_step": min}[kind]
    parts = []
    for _, part in rows.groupby(point, sort=False):
        fixed = part[part["value"] > 0].sort_values("value", ascending=finest is min)
        limit = fixed[PAIRS].iloc[0]
        if kind == "time_step" and len(fixed) > 1:
            limit = limit + (limit - fixed[PAIRS].iloc[1]) / 3
        parts.append(part.assign(error=(part[PAIRS] - limit).abs().max(axis=1)))
    return pd.concat(parts, ignore_index=True)


def observed_orders(table: pd.DataFrame, kind: str) -> pd.DataFrame:
    """One row per De: observed order over all geometries, and largest error of the default.

    The order is the slope of log(error) over log(value), or over value for order and box, by least
    squares through the settings whose errors are above the noise; NaN with less than two of them.
    """
    rows = []
    for De, part in table.groupby("deborah"):
        worst = part.groupby("value")["error"].max()
        worst = worst[(worst.index > 0) & (worst > (NOISE if De > 0 else 1e-9))]
        x = np.log(worst.index) if kind in ("mesh", "time_step") else np.asarray(worst.index)
        slope = np.polyfit(x, np.log(worst), 1)[0] if len(worst) > 1 else math.nan
        default = part[part["default"]]
        sizes = default[PAIRS].abs().max(axis=1)
        rows.append(
            {
                "deborah": De,
                "observed": slope if kind in ("mesh", "time_step") else math.exp(-slope),
                "default_error": default["error"].max(),
                "default_error_share": (default["error"] / sizes).max(),
            }
        )
    return pd.DataFrame(rows)
