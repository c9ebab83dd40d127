"""The closure of the train model: each sphere feels its two neighbours only. How far is it true?

Two comparisons, both with direct simulations of a short train of N spheres:

- in time: distances from rest on a moving mesh, against the model fed by the study's table. The
  model has no start-up, so it begins with the distances that the direct simulation has when the
  start-up is over; at De = 0 that is at once.
- over the spacing: velocities of equally spaced spheres at distances that are held, against those
  of the triplet with these distances, U_1 = U_1(s, s), U_i = U_2(s, s), U_N = U_3(s, s), from the
  same solver without any table in between.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from viscotrain.config.settings import (
    ClosureGapSettings,
    ClosureTrainSettings,
    FlowSettings,
    TransientSettings,
)
from viscotrain.errors import SolutionError
from viscotrain.flow.geometry import Geometry
from viscotrain.studies.dns import Report, solutions, triplet
from viscotrain.studies.resolution import with_sizes
from viscotrain.studies.transient import follow_from_rest, start_up_time
from viscotrain.table.interpolation import TripletVelocities
from viscotrain.trains.motion import chain_motion
from viscotrain.words import CONTACT, LEADING, MIDDLE, TRAILING

REFINEMENT = 0.7  # element sizes over the default ones
TOLERANCE = 1e-9  # of the model's distances, in d


def model_distances(
    velocities: TripletVelocities, confinement: float, distances: NDArray, times: NDArray
) -> NDArray:
    """Distances of successive spheres by the train model, without injection.

    Args:
        velocities: Of triplets.
        confinement: d/D.
        distances: At the first time, in d, trailing first, shape (N - 1,).
        times: In D/Ubar, ascending.

    Returns:
        Distances in d, shape (time, N - 1).
    """

    def rate(_, distance: NDArray) -> NDArray:
        U = chain_motion(velocities, distance - CONTACT).velocity
        return np.diff(U) / confinement

    if len(times) == 1:
        return distances[None]
    solved = solve_ivp(
        rate,
        (times[0], times[-1]),
        distances,
        t_eval=times,
        method="DOP853",
        rtol=TOLERANCE,
        atol=TOLERANCE,
    )
    return solved.y.T


def follow_train(
    settings: ClosureTrainSettings,
    velocities: TripletVelocities,
    deborah: float,
    *,
    report: Report,
    checkpoint: Path,
    code: str = "",
) -> xr.Dataset:
    """A short train from rest, with the distances of the model beside its own.

    At De = 0, where it is cheap, also those at the end with smaller elements and time steps.

    Args:
        settings: The train, and what its flow depends on.
        velocities: Of triplets, at the same De.
        deborah: De in the definition of the study.
        report: Takes a line of text per step.
        checkpoint: File (.npz) to continue from.
        code: Digest of the program, as for `transient.follow_from_rest`.
    """
    study, until = settings.flow, settings.duration
    train = Geometry.train(study.confinement, settings.distances, study.dns.margin)
    trajectory, _ = follow_from_rest(
        study, train, deborah, until=until, report=report, checkpoint=checkpoint, code=code
    )
    if deborah == 0:
        finer, _ = follow_from_rest(refined(study), train, deborah, until=until, report=report)
        trajectory = with_refinement(trajectory, finer)
    return with_model(trajectory, velocities, start_up_time(study, deborah))


def with_model(trajectory: xr.Dataset, velocities: TripletVelocities, start: float) -> xr.Dataset:
    """A direct simulation with the distances of the model beside its own.

    Args:
        trajectory: What `transient.follow_from_rest` returns.
        velocities: Of triplets, at the same De.
        start: When the model begins, in D/Ubar.

    Returns:
        The trajectory with model_distance (time, gap), NaN before the first time from `start` on.
    """
    time, direct = trajectory["time"].values, trajectory["distance"].values
    begun = time >= start * (1 - 1e-9)
    model = np.full_like(direct, np.nan)
    if begun.any():
        confinement = float(trajectory["confinement"])
        model[begun] = model_distances(velocities, confinement, direct[begun][0], time[begun])
    return trajectory.assign(
        model_distance=(
            ("time", "gap"),
            model,
            {"long_name": "distance of neighbours by the train model, over diameter", "units": "1"},
        )
    )


def refined(study: TransientSettings) -> TransientSettings:
    """Settings with smaller elements, and time steps of a tenth of the error."""
    dns, steps = study.dns, study.transient
    finer = with_sizes(dns, REFINEMENT)
    stricter = {
        name: getattr(steps, name) / 10
        for name in ("common_tolerance", "relative_tolerance", "distance_tolerance")
    }
    return study.model_copy(
        update={
            "dns": dns.model_copy(update=finer),
            "transient": steps.model_copy(update=stricter),
        }
    )


def with_refinement(trajectory: xr.Dataset, finer: xr.Dataset) -> xr.Dataset:
    """A direct simulation with the distances at its end of a more accurate one."""
    return trajectory.assign(
        refined_distance=(
            "gap",
            finer["distance"].values[-1],
            {
                "long_name": "distance of neighbours at the end, over diameter, with smaller "
                "elements and time steps",
                "units": "1",
            },
        )
    )


def error_at_gap(settings: ClosureGapSettings, gap: float, report: Report) -> pd.DataFrame:
    """Velocities of equally spaced spheres, directly and by the closure, at distances held.

    Args:
        settings: Number of spheres, Deborah numbers, and what the flows depend on.
        gap: Between the surfaces, in d.
        report: Takes a line of text per Deborah number.

    Returns:
        One row per De and gap between spheres: direct and model relative velocity in Ubar.

    Raises:
        SolutionError: A simulation did not converge.
    """
    study, s = settings.flow, CONTACT + gap
    train = Geometry.train(study.confinement, [s] * (settings.spheres - 1), study.dns.margin)
    three = triplet(study, s, s)
    rows = []
    up_to = max(settings.deborah, default=0.0)
    for (De, many), (_, few) in zip(
        _velocities(study, train, up_to), _velocities(study, three, up_to), strict=True
    ):
        if De not in settings.deborah:
            continue
        model = np.full(many.size, few[MIDDLE])
        model[0], model[-1] = few[TRAILING], few[LEADING]
        for n, (direct, closed) in enumerate(zip(np.diff(many), np.diff(model), strict=True)):
            row = {"deborah": De, "gap": gap, "number": n + 1}
            rows.append(row | {"direct": direct, "model": closed, "error": closed - direct})
        worst = np.abs(np.diff(model) - np.diff(many)).max()
        report(f"De {De:g}, gap {gap:g} d: closure error {worst:.2e} Ubar")
    return pd.DataFrame(rows)


def _velocities(study: FlowSettings, geometry: Geometry, up_to: float):
    """De and the quasi-steady U of all spheres, ascending, up to a De of the config."""
    for De, solution in solutions(study, geometry, up_to):
        if not solution.solved:
            raise SolutionError(f"De {De:g}: {solution.convergence.reason}")
        yield De, np.array(list(solution.velocities.values()))
