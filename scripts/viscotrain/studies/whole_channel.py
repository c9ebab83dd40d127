"""What memory changes: pairs and triplets through a whole channel, directly and by the train model.

Direct. Spheres that move in the stress that they leave behind (`flow.time_stepping`), from fluid at
rest, or from the stress that has developed while the first distances were held.

Model. Trains move by velocities at distances that are held, those of the table (`train_models`).
"""

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from scipy.interpolate import CubicHermiteSpline

from viscotrain.config import stages
from viscotrain.config.settings import TransientSettings
from viscotrain.config.study import Study
from viscotrain.errors import SolutionError
from viscotrain.flow.discretisation import Flow
from viscotrain.flow.geometry import Geometry
from viscotrain.flow.moving_mesh import linear, smooth_step
from viscotrain.studies.closure import refined
from viscotrain.studies.dns import Report, solutions
from viscotrain.studies.train_models import model_distances
from viscotrain.studies.transient import follow_spheres
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.memory import memory_number
from viscotrain.trains.closures import EverySphere

DEBORAH = (5.0, 31.0, 62.0)
DURATION = 430.0  # D/Ubar: 800 D at 1.86 Ubar
TIMES = np.linspace(0.0, DURATION, 44)
FIRST = ((1.5,), (1.5, 2.5), (2.5,), (2.5, 1.5))  # distances at the start in d, trailing first
STARTS = ("rest", "developed")
ORDER = 5  # of the velocity, on the mesh of the start: `Case.variant` says what it is worth
ITERATION = 1e-6  # rms update at which a time step has converged
STEPS = {  # what is wanted are distances to 0.01 d
    "common_tolerance": 1e-3,
    "relative_tolerance": 1e-4,
    "distance_tolerance": 1e-4,
    "max_iterations": 30,
}
CASE = ["first", "start", "deborah", "variant"]  # columns that name a case


@dataclass(frozen=True)
class Case:
    """One direct simulation.

    Attributes:
        first: Distances at the start in d, trailing first.
        start: One of `STARTS`.
        deborah: lambda_1 Ubar/D.
        variant: "default"; "finer": smaller elements, time steps of a tenth of the error;
            "smooth": the mesh moves without kinks at the spheres.
    """

    first: tuple[float, ...]
    start: str
    deborah: float
    variant: str = "default"

    @property
    def row(self) -> dict:
        """What names it in the results."""
        first = " ".join(f"{s:g}" for s in self.first)
        return dict(zip(CASE, (first, self.start, self.deborah, self.variant), strict=True))


def cases() -> list[Case]:
    """All cases, those that tell most first."""
    every = [
        Case(first, start, De)
        for first, De, start in itertools.product(FIRST, DEBORAH[::-1], STARTS)
    ]
    checks = [Case((1.5,), "rest", 62.0, "smooth"), Case((1.5,), "rest", 62.0, "finer")]
    return [*every[:12], *checks, *every[12:]]


def simulate(study: Study, case: Case, report: Report, checkpoint: Path) -> pd.DataFrame:
    """Distances in d and relative velocities in Ubar at `TIMES`, one row per time and gap.

    Args:
        study: Fluid, channel and spheres.
        case: What to simulate.
        report: Takes a line of text per step.
        checkpoint: File (.npz) to continue from and to write.

    Raises:
        SolutionError: The simulation, or the flow at its start, does not converge.
    """
    own = _settings(study, case)
    geometry = Geometry.train(study.confinement, case.first, own.dns.margin)
    trajectory, _ = follow_spheres(
        own,
        geometry,
        case.deborah,
        until=DURATION,
        report=report,
        checkpoint=checkpoint,
        developed=_developed(study, geometry, case) if case.start == "developed" else None,
        profile=smooth_step if case.variant == "smooth" else linear,
    )
    if reason := str(trajectory["reason"].values):
        raise SolutionError(f"{case}: {reason}")
    return recorded(trajectory, case)


def _settings(study: Study, case: Case) -> TransientSettings:
    own = stages.transient(study, case.deborah)
    update = {
        "dns": own.dns.model_copy(update={"velocity_order": ORDER, "tolerance": ITERATION}),
        "transient": own.transient.model_copy(update=STEPS),
    }
    own = own.model_copy(update=update)
    return refined(own) if case.variant == "finer" else own


def _developed(study: Study, geometry: Geometry, case: Case) -> Flow:
    """The flow with the stress at distances that are held."""
    for _, solution in solutions(stages.transient(study, case.deborah), geometry):
        if solution.solved:
            return solution.flow
    raise SolutionError(f"{case}: the flow at the start is not solved")


def recorded(trajectory: xr.Dataset, case: Case) -> pd.DataFrame:
    """A trajectory at `TIMES`, between its steps by Hermite's cubics."""
    time, distance = trajectory["time"].values, trajectory["distance"].values
    relative = np.diff(trajectory["velocity"].values, axis=1)
    curve = CubicHermiteSpline(time, distance, relative / float(trajectory["confinement"]))
    beta = float(trajectory["confinement"])
    rows = [
        case.row | {"gap": n + 1, "time": t, "distance": s[n], "relative_velocity": beta * rate[n]}
        for n in range(distance.shape[1])
        for t, s, rate in zip(TIMES, curve(TIMES), curve(TIMES, 1), strict=True)
    ]
    return pd.DataFrame(rows)


def compare(direct: pd.DataFrame, table: VelocityTable, confinement: float) -> pd.DataFrame:
    """Distances at the outlet, simulated directly and by the model, one row per case and gap.

    Args:
        direct: Rows of `simulate`, of all cases.
        table: Velocity table with these Deborah numbers.
        confinement: d/D.

    Returns:
        With `direct`, `model` and `error`, model minus direct, in d, and the largest memory
        number on the way.
    """
    closures = {De: EverySphere(table.at(De)) for De in sorted(set(direct["deborah"]))}
    rows = []
    for name, case in direct.groupby(CASE, sort=False):
        named = dict(zip(CASE, name, strict=True))
        first = np.array(str(named["first"]).split(), dtype=float)
        model = model_distances(closures[named["deborah"]], confinement, first, TIMES)[-1]
        M = memory_number(named["deborah"], case["relative_velocity"], confinement)
        for gap, own in case.groupby("gap"):
            end = own.sort_values("time")["distance"].iloc[-1]
            own_model = model[int(gap) - 1]
            rows.append(
                named
                | {"gap": gap, "memory_number": M[own.index].max()}
                | {"direct": end, "model": own_model, "error": own_model - end}
            )
    return pd.DataFrame(rows)
