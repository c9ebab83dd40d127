"""Start-up against quasi-steady velocities: what dropping the time derivative costs.

Along a transient simulation the quasi-steady velocities at the present distances are computed
anew, on a mesh of their own; what remains between both after the start-up is the error of dropping
the time derivative.
"""

import math

import numpy as np
import xarray as xr

from viscotrain.config.settings import FlowSettings
from viscotrain.errors import SolutionError
from viscotrain.flow.geometry import Geometry
from viscotrain.studies.dns import Report, solutions, triplet

CHECK_TIMES = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0)  # after the start, in lambda_1


def compare_start_up(study: FlowSettings, trajectory: xr.Dataset, report: Report) -> xr.Dataset:
    """A transient simulation of a triplet with quasi-steady velocities at the present distances.

    Returns:
        The trajectory with quasi_steady_velocity (check, sphere) at check_time (check).

    Raises:
        SolutionError: A quasi-steady simulation did not converge.
    """
    deborah = float(trajectory["deborah"])
    lambda_1 = float(trajectory["deborah_longest_mode"])
    end = float(trajectory["time"][-1]) / lambda_1
    # A start-up that ends before the first of these times is compared at its end.
    wanted = [time for time in CHECK_TIMES if time <= end * (1 + 1e-9)] or [end]
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


def _present(study: FlowSettings, now: xr.Dataset) -> Geometry:
    """The triplet at one time of its trajectory."""
    distances = iter(now["distance"].values)
    sp, sf = (next(distances) if math.isfinite(now[name]) else math.inf for name in ("sp", "sf"))
    return triplet(study, float(sp), float(sf))


def _quasi_steady(study: FlowSettings, geometry: Geometry, deborah: float) -> np.ndarray:
    for De, solution in solutions(study, geometry, up_to=deborah):
        if not solution.solved:
            raise SolutionError(f"De {De:g}: {solution.convergence.reason}")
    return np.array(list(solution.velocities.values()))
