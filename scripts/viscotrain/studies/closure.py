"""The closure of the train model: each sphere feels its two neighbours only. How far is it true?

Two comparisons, both with direct simulations of a short train of N spheres:

- in time: distances from rest on a moving mesh, against the model fed by the study's table. The
  model has no start-up, so it begins with the distances that the direct simulation has when the
  start-up is over; at De = 0 that is at once.
- over the spacing: velocities of equally spaced spheres at distances that are held, against those
  of the triplet with these distances, U_1 = U_1(s, s), U_i = U_2(s, s), U_N = U_3(s, s), from the
  same solver without any table in between.
"""

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from viscotrain.config.models import Study
from viscotrain.errors import SolutionError
from viscotrain.flow.geometry import Geometry
from viscotrain.studies.dns import Report, solutions, triplet
from viscotrain.studies.resolution import with_sizes
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


def refined(study: Study) -> Study:
    """The study with smaller elements, and time steps of a tenth of the error."""
    dns, steps = study.dns, study.dns.transient
    finer = with_sizes(dns, REFINEMENT) | {
        "transient": steps.model_copy(
            update={
                name: getattr(steps, name) / 10
                for name in ("common_tolerance", "relative_tolerance", "distance_tolerance")
            }
        ),
    }
    return study.model_copy(update={"dns": dns.model_copy(update=finer)})


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


def error_at_gap(study: Study, gap: float, report: Report) -> pd.DataFrame:
    """Velocities of equally spaced spheres, directly and by the closure, at distances held.

    Args:
        study: The config; the number of spheres and the Deborah numbers are those of
            `verification.closure`.
        gap: Between the surfaces, in d.
        report: Takes a line of text per Deborah number.

    Returns:
        One row per De and gap between spheres: direct and model relative velocity in Ubar.

    Raises:
        SolutionError: A simulation did not converge.
    """
    settings = study.verification.closure
    s = CONTACT + gap
    train = Geometry.train(study.confinement, [s] * len(settings.distances), study.dns.margin)
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


def _velocities(study: Study, geometry: Geometry, up_to: float):
    """De and the quasi-steady U of all spheres, ascending, up to a De of the config."""
    for De, solution in solutions(study, geometry, up_to):
        if not solution.solved:
            raise SolutionError(f"De {De:g}: {solution.convergence.reason}")
        yield De, np.array(list(solution.velocities.values()))
