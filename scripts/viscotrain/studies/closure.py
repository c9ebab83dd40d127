"""Direct simulations of short trains of N spheres, for closures of the train model to be compared.

- in time: distances from rest on a moving mesh;
- over the spacing: velocities of equally spaced spheres at distances that are held.

`train_models` compares the models with them.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from viscotrain.config.settings import (
    ClosureGapSettings,
    ClosureTrainSettings,
    FlowSettings,
    TransientSettings,
)
from viscotrain.errors import SolutionError
from viscotrain.flow.geometry import Geometry
from viscotrain.studies.dns import Report, solutions
from viscotrain.studies.resolution import with_sizes
from viscotrain.studies.transient import follow_spheres, start_up_time
from viscotrain.words import CONTACT

REFINEMENT = 0.7  # element sizes over the default ones


def follow_train(
    settings: ClosureTrainSettings,
    deborah: float,
    *,
    report: Report,
    checkpoint: Path,
    code: str = "",
) -> xr.Dataset:
    """A short train from rest, and when its start-up is over.

    At De = 0, where it is cheap, also its distances at the end with smaller elements and time
    steps.

    Args:
        settings: The train, and what its flow depends on.
        deborah: De in the definition of the study.
        report: Takes a line of text per step.
        checkpoint: File (.npz) to continue from.
        code: Digest of the program, as for `transient.follow_spheres`.
    """
    study, until = settings.flow, settings.duration
    train = Geometry.train(study.confinement, settings.distances, study.dns.margin)
    trajectory, _ = follow_spheres(
        study, train, deborah, until=until, report=report, checkpoint=checkpoint, code=code
    )
    if deborah == 0:
        finer, _ = follow_spheres(refined(study), train, deborah, until=until, report=report)
        trajectory = with_refinement(trajectory, finer)
    long_name = "time at which the start-up is over times mean velocity over channel diameter"
    over = start_up_time(study, deborah)
    return trajectory.assign(start_up_time=((), over, {"long_name": long_name, "units": "1"}))


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


def velocities_at_gap(settings: ClosureGapSettings, gap: float, report: Report) -> pd.DataFrame:
    """Relative velocities of equally spaced spheres, at distances that are held.

    Args:
        settings: Number of spheres, Deborah numbers, and what the flows depend on.
        gap: Between the surfaces, in d.
        report: Takes a line of text per Deborah number.

    Returns:
        One row per De and gap between spheres, trailing first, with `direct` in Ubar.

    Raises:
        SolutionError: A simulation did not converge.
    """
    study, distances = settings.flow, [CONTACT + gap] * (settings.spheres - 1)
    train = Geometry.train(study.confinement, distances, study.dns.margin)
    rows = []
    for De, U in _velocities(study, train, up_to=max(settings.deborah, default=0.0)):
        if De in settings.deborah:
            relative = np.diff(U)
            rows += [
                {"deborah": De, "gap": gap, "number": n, "direct": own}
                for n, own in enumerate(relative, start=1)
            ]
            report(f"De {De:g}, gap {gap:g} d: up to {np.abs(relative).max():.2e} Ubar")
    return pd.DataFrame(rows)


def _velocities(study: FlowSettings, geometry: Geometry, up_to: float):
    """De and the quasi-steady U of all spheres, ascending, up to a De of the config."""
    for De, solution in solutions(study, geometry, up_to):
        if not solution.solved:
            raise SolutionError(f"De {De:g}: {solution.convergence.reason}")
        yield De, np.array(list(solution.velocities.values()))
