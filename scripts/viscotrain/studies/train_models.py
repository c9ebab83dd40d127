"""The train model against direct simulations of short trains (`closure`), with both closures.

- in time: the model has no start-up, so it begins with the distances that the direct simulation
  has when the start-up is over; at De = 0 that is at once.
- over the spacing: relative velocities of equally spaced spheres.

Velocities of triplets are those of the study's table, so errors hold those of its interpolation.

This module needs no NGSolve.
"""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from viscotrain.table.interpolation import TripletVelocities, VelocityTable
from viscotrain.trains.closures import CLOSURES, Closure
from viscotrain.trains.motion import chain_motion
from viscotrain.words import CONTACT

TOLERANCE = 1e-9  # of the model's distances, in d


def model_distances(
    closure: Closure, confinement: float, distances: NDArray, times: NDArray
) -> NDArray:
    """Distances of successive spheres by the train model, without injection.

    Args:
        closure: Velocities of trains.
        confinement: d/D.
        distances: At the first time, in d, trailing first, shape (N - 1,).
        times: In D/Ubar, ascending.

    Returns:
        Distances in d, shape (time, N - 1).
    """

    def rate(_, distance: NDArray) -> NDArray:
        return chain_motion(closure, distance - CONTACT).relative / confinement

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


def with_models(trajectory: xr.Dataset, velocities: TripletVelocities) -> xr.Dataset:
    """A direct simulation with the distances of the model beside its own, with each closure.

    Args:
        trajectory: What `closure.follow_train` returns.
        velocities: Of triplets, at the same De.

    Returns:
        The trajectory with model_distance (closure, time, gap) in d, NaN during the start-up.
    """
    time, direct = trajectory["time"].values, trajectory["distance"].values
    begun = time >= float(trajectory["start_up_time"]) * (1 - 1e-9)
    model = np.full((len(CLOSURES), *direct.shape), np.nan)
    if begun.any():
        confinement, first = float(trajectory["confinement"]), direct[begun][0]
        for n, closure in enumerate(CLOSURES.values()):
            model[n, begun] = model_distances(closure(velocities), confinement, first, time[begun])
    compared = trajectory.assign(model_distance=(("closure", "time", "gap"), model))
    return compared.assign_coords(closure=list(CLOSURES))


def with_errors_of_models(spacing: pd.DataFrame, table: VelocityTable) -> pd.DataFrame:
    """Relative velocities of equally spaced spheres, with those of the model and its error.

    Args:
        spacing: What `closure.velocities_at_gap` returns, for all gaps.
        table: Of triplets, at these Deborah numbers.

    Returns:
        The same for each closure, with the columns closure, model and error, in Ubar.
    """
    return pd.concat(_compared(spacing, table), ignore_index=True)


def _compared(spacing: pd.DataFrame, table: VelocityTable) -> Iterator[pd.DataFrame]:
    for De, at_deborah in spacing.groupby("deborah"):
        velocities = table.at(float(De))
        for name, make in CLOSURES.items():
            closure = make(velocities)
            for _, part in at_deborah.groupby("gap"):
                model = chain_motion(closure, part["gap"].to_numpy()).relative
                yield part.assign(closure=name, model=model, error=model - part["direct"])
