"""How far the simulation reaches: the points of a designed `sample`, solved by default.

The `default` run of a point has the settings of `config.DnsConfig`. Its `reference` has a
higher order, another, finer mesh to start with, a tenth of the errors and up to twice the unknowns;
the difference of both is taken as the error of the default. It does not contain that of the length
of the box, which both share.

Nothing depends on the speed of the machine: no run has a limit of time.
"""

import itertools
import json
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
import pandas as pd

from viscotrain.config.models import DnsConfig
from viscotrain.config.settings import FlowSettings
from viscotrain.flow import quasi_steady
from viscotrain.flow.process import use_one_core
from viscotrain.studies import dns as simulation
from viscotrain.studies.resolution import with_sizes
from viscotrain.studies.sample import CORNER, CORNER_POINTS, MAIN, MAIN_POINTS, SEED, Point
from viscotrain.words import PARTICLES

DEFAULT, REFERENCE = "default", "reference"
REFERENCE_ACCURACY = 0.1  # over that of the default
REFERENCE_UNKNOWNS = 2  # the most, over those of the default
REFERENCE_SIZE = 0.7  # of the elements of the first mesh
HIGHEST_ORDER = 6  # that a config may start with
FLOOR = 1e-7  # Ubar: tolerance of the iteration, below which errors are not told apart
FACTOR = 20.0  # within which an estimate should be of the error
PAIRS = ("middle_minus_trailing", "leading_minus_middle")

# ------------------------------------------------------------------------------------- solution


def finer(settings: DnsConfig) -> DnsConfig:
    """Settings of the reference."""
    return settings.model_copy(
        update=with_sizes(settings, REFERENCE_SIZE)
        | {
            "velocity_order": min(settings.velocity_order + 1, HIGHEST_ORDER),
            "accuracy": settings.accuracy * REFERENCE_ACCURACY,
            "relative_accuracy": settings.relative_accuracy * REFERENCE_ACCURACY,
            "max_velocity_order": settings.max_velocity_order + 1,
            "max_unknowns": settings.max_unknowns * REFERENCE_UNKNOWNS,
        }
    )


def solve(
    point: Point,
    run: str = DEFAULT,
    settings: DnsConfig | None = None,
    report: Callable[[str], None] = lambda _: None,
) -> dict:
    """Solve one point; a row of the table of results.

    Args:
        point: Of the design.
        run: `DEFAULT` or `REFERENCE`.
        settings: Of the default run; None for those of the config.
        report: Takes a line of text per mesh.
    """
    use_one_core()
    settings = settings or DnsConfig()
    if run == REFERENCE:
        settings = finer(settings)
    case = FlowSettings(
        confinement=point.confinement,
        dimensionless_fluid=point.fluid,
        deborah=(point.deborah,),
        longest_modes=(point.deborah,),
        dns=settings,
    )
    meshes: list[int] = []
    label = run_name(point.part, point.index, run)

    def remesh(sizes):
        mesh = simulation.mesh_of(case, geometry, sizes)
        meshes.append(mesh.ne)
        report(f"{label}: {mesh.ne} elements after {time.process_time() - started:.0f} CPU s")
        return mesh

    started = time.process_time()
    try:
        geometry = simulation.triplet(case, point.sp, point.sf)
        options = simulation.solver_options(case)
        flow = simulation.make_flow(case, geometry)
        meshes.append(flow.mesh.ne)
        (solution,) = quasi_steady.solve(flow, [point.deborah], options, remesh=remesh)
        result = _result(solution)
    except Exception as error:  # a crash of one point is a result, the others go on
        reason = f"{type(error).__name__}: {error}"
        result = {"converged": False, "reason": reason, "deborah_reached": 0.0}
    return _parameters(point, run) | {
        **result,
        "meshes": json.dumps(meshes),
        "cpu_seconds": round(time.process_time() - started, 1),
    }


def run_name(part: str, index: int, run: str) -> str:
    """Of a run, in lines of progress."""
    return f"{part} {index} {run}"


def _parameters(point: Point, run: str) -> dict:
    modes = [list(asdict(mode).values()) for mode in point.fluid.modes]
    return {
        "seed": SEED,
        "index": point.index,
        "run": run,
        "part": point.part,
        "solvent": point.fluid.solvent,
        "modes": json.dumps(modes),
        "confinement": point.confinement,
        "sp": point.sp,
        "sf": point.sf,
        "deborah": point.deborah,
    }


def _result(solution: quasi_steady.Solution) -> dict:
    result = {
        "converged": solution.solved,
        "reason": solution.convergence.reason,
        "deborah_reached": solution.reached,
        "accurate": solution.accurate,
        "iterations": solution.iterations,
        "elements": solution.flow.mesh.ne,
        "unknowns": solution.flow.space.ndof,
    }
    spheres, U = solution.flow.geometry.spheres, solution.velocities
    pairs = [f"{ahead}_minus_{behind}" for behind, ahead in itertools.pairwise(spheres)]
    if solution.solved:
        result |= {f"velocity_{name}": U[name] for name in spheres}
        relative = np.diff([U[name] for name in spheres])
        result |= dict(zip(pairs, map(float, relative), strict=True))
    if solution.error is not None:
        result |= {
            "estimate": max(solution.error.relative, default=solution.error.velocity),
            "estimate_velocity": solution.error.velocity,
        }
        estimates = map(float, solution.error.relative)
        result |= {f"estimate_{k}": e for k, e in zip(pairs, estimates, strict=True)}
    return result


def true_error(row, reference) -> float:
    """Difference that counts, in Ubar: of relative velocities, of U for a single sphere."""
    pairs = [name for name in PAIRS if math.isfinite(row.get(name, math.nan))]
    relative = [abs(row[name] - reference[name]) for name in pairs]
    return max(relative, default=abs(row["velocity_middle"] - reference["velocity_middle"]))


def with_error(reference: dict, row: dict) -> dict:
    """The reference with the error of the default run and the estimate over it."""
    if not (reference["converged"] and row["converged"]):
        return reference
    error = true_error(row, reference)
    ratio = row.get("estimate", math.nan) / error if error > 0 else math.inf
    return reference | {"true_error": error, "estimate_over_true_error": ratio}


COLUMNS = (
    *("seed", "index", "run", "part", "solvent", "modes", "confinement", "sp", "sf", "deborah"),
    *("converged", "accurate", "deborah_reached", "reason"),
    *(f"velocity_{name}" for name in PARTICLES),
    *PAIRS,
    *("estimate", "estimate_velocity", *(f"estimate_{name}" for name in PAIRS)),
    *("true_error", "estimate_over_true_error"),
    *("meshes", "elements", "unknowns", "iterations", "cpu_seconds", "physics_digest"),
)

# -------------------------------------------------------------------------------------- summary


@dataclass(frozen=True)
class Summary:
    """Shares of points; NaN where there are none.

    Attributes:
        points: Default runs in the table, by part.
        converged: Share of them, by part.
        accurate: Share of the converged, by part, within the accuracy asked for.
        compared: Points with a reference.
        covered: Share of these whose estimate is not below the error.
        close: Share of these whose estimate is within `FACTOR` of the error.
    """

    points: dict[str, int]
    converged: dict[str, float]
    accurate: dict[str, float]
    compared: int
    covered: float
    close: float


def summarised(table: pd.DataFrame) -> Summary:
    """Shares of the rows of a table of results; errors and estimates count from `FLOOR` on."""
    runs = table[table["run"] == DEFAULT].set_index("index")
    parts = {part: runs[runs["part"] == part] for part in (MAIN, CORNER)}
    references = table[table["run"] == REFERENCE].set_index("index")
    error = references["true_error"].dropna().clip(lower=FLOOR)
    estimate = runs["estimate"].reindex(error.index).clip(lower=FLOOR)
    ratio = estimate / error
    return Summary(
        points={part: len(rows) for part, rows in parts.items()},
        converged={part: _share(rows["converged"]) for part, rows in parts.items()},
        accurate={
            part: _share(rows.loc[rows["converged"].astype(bool), "accurate"])
            for part, rows in parts.items()
        },
        compared=len(ratio),
        covered=_share(ratio >= 1),
        close=_share(ratio.between(1 / FACTOR, FACTOR)),
    )


def _share(flags: pd.Series) -> float:
    return float(flags.astype(float).mean()) if len(flags) else math.nan


def report(table: pd.DataFrame, code: str) -> str:
    """The summary in words, with a line for every point that is not as it should be.

    Args:
        table: Results.
        code: Digest of the present solver.
    """
    found = summarised(table)
    lines = []
    for part, total in ((MAIN, MAIN_POINTS), (CORNER, CORNER_POINTS)):
        if not found.points[part]:
            continue
        lines.append(
            f"{part}: {found.points[part]} of {total} points run, {found.converged[part]:.1%} "
            f"converged, {found.accurate[part]:.1%} of these accurate"
        )
    runs = table[table["run"] == DEFAULT]
    for row in table[~table["converged"].astype(bool)].itertuples():
        lines.append(
            f"  {row.part} {row.index} {row.run}: De {row.deborah:.3g} not solved, "
            f"reached {row.deborah_reached:.3g}: {row.reason}"
        )
    if found.compared:
        lines.append(
            f"errors: {found.compared} points with a reference; estimate >= error in "
            f"{found.covered:.1%}, within a factor of {FACTOR:g} in {found.close:.1%}"
        )
    seconds = runs["cpu_seconds"]
    lines.append(f"cost: median {seconds.median():.0f}, maximum {seconds.max():.0f} CPU s")
    if not (runs["physics_digest"] == code).all():
        lines.append("note: some rows are of another version of the solver")
    return "\n".join(lines)
