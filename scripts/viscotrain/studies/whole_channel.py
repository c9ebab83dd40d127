"""What memory changes: pairs and triplets through a whole channel, directly and by the train model.

Direct. Spheres that move in the stress that they leave behind (`flow.time_stepping`), from fluid at
rest, or from the stress that has developed while the first distances were held.

Model. Trains move by velocities at distances that are held, those of the table (`train_models`),
without and with the memory of `trains.closures`, whose coefficient is fitted to one case.
"""

import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
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
from viscotrain.table.pairs import tabulated_pair_velocity
from viscotrain.trains.closures import make_closure

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
VARIANTS = {"smooth": "mesh moved otherwise", "finer": "finer mesh and steps"}
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


FITTED = Case((1.5,), "developed", 62.0)  # that the coefficient of memory is from


def cases() -> list[Case]:
    """All cases, those that tell most first."""
    every = [
        Case(first, start, De)
        for first, De, start in itertools.product(FIRST, DEBORAH[::-1], STARTS)
    ]
    checks = [Case((1.5,), "rest", 62.0, variant) for variant in ("smooth", "finer")]
    return [*every, *checks]


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


def model(table: VelocityTable, case: Case, confinement: float, c: float = 0.0) -> NDArray:
    """Distances of the train model at `TIMES` in d, shape (time, gap), with a memory of c."""
    strength = c * table.deborah_longest_mode(case.deborah) / confinement
    closure = make_closure("every_sphere", table.at(case.deborah), strength)
    return model_distances(closure, confinement, np.array(case.first), TIMES)


def fitted(direct: pd.DataFrame, table: VelocityTable, confinement: float) -> float:
    """The c with which the model is closest to `FITTED`, at the worst time; in steps of 0.01."""
    simulated = _distances(direct, FITTED)

    def deviation(c: float) -> float:
        return float(np.abs(model(table, FITTED, confinement, c) - simulated).max())

    return float(min(np.arange(0, 51) / 100, key=deviation))


def compare(
    direct: pd.DataFrame, table: VelocityTable, confinement: float, c: float
) -> pd.DataFrame:
    """Distances at the outlet, simulated directly and by the model, one row per case and gap.

    Args:
        direct: Rows of `simulate`.
        table: Velocity table with their Deborah numbers.
        confinement: d/D.
        c: Coefficient of memory.

    Returns:
        With `direct`, `model` without and `memory` with memory, in d; `error` of each, at the
        outlet, and `largest_error` on the way; and the largest memory number.
    """
    rows = []
    for name, own in direct.groupby(CASE, sort=False):
        named = dict(zip(CASE, name, strict=True))
        case = Case(tuple(map(float, named["first"].split())), *name[1:])
        simulated = _distances(direct, case)
        M = memory_number(case.deborah, own["relative_velocity"].abs().max(), confinement)
        row: dict[str, Any] = {"c": c, "memory_number": M}
        models = {"model": 0.0, "memory": c}
        found = {key: model(table, case, confinement, each) for key, each in models.items()}
        for gap in range(simulated.shape[1]):
            row = row | {"gap": gap + 1, "direct": simulated[-1, gap]}
            for key, distances in found.items():
                error = distances[:, gap] - simulated[:, gap]
                row |= {key: distances[-1, gap], f"{key}_error": error[-1]}
                row |= {f"{key}_largest_error": np.abs(error).max()}
            rows.append(named | row)
    return pd.DataFrame(rows)


def held_pairs(table: VelocityTable) -> pd.DataFrame:
    """Relative velocities of pairs at distances that are held, as they stand in a table."""
    layers = [(De, table.dataset.isel(deborah=table.index(De))) for De in DEBORAH]
    rows = [
        pd.DataFrame(
            {
                "deborah": De,
                "distance": layer["pair_distance"].values,
                "relative_velocity": tabulated_pair_velocity(layer),
            }
        )
        for De, layer in layers
    ]
    return pd.concat(rows, ignore_index=True)


def statement(outlet: pd.DataFrame) -> str:
    """The comparison as a table in Markdown, one row per case.

    Args:
        outlet: Result of `compare`.
    """
    lines = [
        "| first distances | De | start | M | distances at the outlet | error of the model "
        "| on the way | error with memory | on the way |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, own in outlet.groupby(CASE, sort=False):
        first, start, De, variant = dict(zip(CASE, name, strict=True)).values()
        words = start if variant == "default" else f"{start}, {VARIANTS[str(variant)]}"
        cells = [f"{str(first).replace(' ', ', ')} d", f"{De:g}", words]
        cells += [f"{own['memory_number'].iloc[0]:.2f}", _listed(own["direct"], "{:.2f}")]
        for model in ("model", "memory"):
            cells.append(_listed(own[f"{model}_error"], "{:+.3f}"))
            cells.append(f"{own[f'{model}_largest_error'].max():.3f} d")
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _listed(values: pd.Series, form: str) -> str:
    return ", ".join(map(form.format, values)) + " d"


def _distances(direct: pd.DataFrame, case: Case) -> NDArray:
    """Of one case, shape (time, gap)."""
    own = direct[(direct[CASE] == pd.Series(case.row)).all(axis=1)]
    return own.pivot(index="time", columns="gap", values="distance").to_numpy()
