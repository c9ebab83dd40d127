"""What a study will cost: geometries, points, trains, what is done already, CPU and wall time.

Model. Meshes are refined at each Deborah number until the solution is accurate, so their sizes are
not known beforehand. A point costs what points of as many spheres were measured to cost at its De,
the way from the De before included, interpolated in log(1 + De/De_0). For another polynomial order
or number of modes this is scaled by (unknowns per element)^`GROWTH`. The measured times are in
`measured_costs.csv`, which `benchmark.py --output` writes. Where geometries of the study are
finished, their own times take the place of these. Trains cost per sphere that is injected.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from viscotrain.config import stages
from viscotrain.config.geometries import diameter_ratios, simulated
from viscotrain.config.names import train_name
from viscotrain.config.study import Study
from viscotrain.flow import continuation, quasi_steady
from viscotrain.flow.refinement import unknowns_per_element
from viscotrain.jobs import grouping
from viscotrain.jobs.digests import digest
from viscotrain.jobs.grouping import MINUTES
from viscotrain.jobs.on_request import REQUESTS
from viscotrain.jobs.progress import Point, outcomes
from viscotrain.jobs.provenance import made_with
from viscotrain.jobs.resources import (
    DRAW,
    FRAME,
    OTHERS,
    START_UP,
    megabytes,
    megabytes_for,
    train_seconds,
    variation_seconds,
)
from viscotrain.table.triplets import Triplet
from viscotrain.words import has_solution

MEASURED = Path(__file__).with_name("measured_costs.csv")
GROWTH = 1.2  # assembly is linear in the unknowns, factorisation a little steeper
FIGURE = 1.1  # CPU seconds of a figure
REST = ("units", "operating_conditions", "order", "encapsulation", "interactive", "summary")
TRANSIENT = 9.5  # start-ups of all De of a geometry over its quasi-steady solution
USUAL_MODES = 2  # that a fit finds
BUSY_CORE = 0.9  # what a further core adds: memory is shared, and the last jobs leave cores idle


@dataclass(frozen=True)
class Work:
    """What a study consists of and what is left of it.

    Attributes:
        flows: Geometries that are simulated, each at its Deborah numbers.
        outcomes: Status of the points that are there.
        trains: (De, volume fraction).
        trains_left: Those not there.
        draws: Fluids that are drawn from a fit.
    """

    flows: dict[Triplet, tuple[float, ...]]
    outcomes: dict[Point, int]
    trains: tuple[tuple[float, float], ...]
    trains_left: tuple[tuple[float, float], ...]
    draws: int = 0

    @property
    def flows_left(self) -> dict[Triplet, tuple[float, ...]]:
        """Geometries with the Deborah numbers that are not there."""
        left = {
            geometry: tuple(De for De in own if (*geometry, De) not in self.outcomes)
            for geometry, own in self.flows.items()
        }
        return {geometry: own for geometry, own in left.items() if own}

    @property
    def solved(self) -> int:
        """Points that are there and have a solution."""
        return sum(bool(has_solution(status)) for status in self.outcomes.values())


# -------------------------------------------------------------------------------- what is there


def work_of(study: Study, results: Path) -> Work:
    """Count results that are there and were made with the present settings and code."""
    flows, there = simulated(study), outcomes(study, results)
    trains = tuple(itertools.product(study.train_deborahs, study.trains.fractions))
    settings, code = stages.trains(study), digest("trains")

    def train_done(train: tuple[float, float]) -> bool:
        name = train_name(*train, study.trains.feed)
        return made_with(results / "trains" / f"{name}.nc", settings, code)

    work = Work(flows, there, trains, tuple(t for t in trains if not train_done(t)))
    # A table that changes repeats every train.
    return replace(work, trains_left=trains) if work.flows_left else work


# -------------------------------------------------------------------------------- cost of a flow


def spheres(sp: float, sf: float) -> int:
    """Number of spheres of a geometry."""
    return 1 + math.isfinite(sp) + math.isfinite(sf)


class CostModel:
    """CPU seconds of a point from measured ones.

    Args:
        measured: Table with the columns that `benchmark.py` writes.
    """

    def __init__(self, measured: pd.DataFrame):
        measured = measured[measured.solved]
        sizes = [
            _size(*row)
            for row in zip(measured.deborah, measured.velocity_order, measured.modes, strict=True)
        ]
        self._rows = measured.assign(
            x=_coordinate(measured.deborah),
            spheres=[spheres(*row) for row in zip(measured.sp, measured.sf, strict=True)],
            unit=measured.cpu_seconds / np.array(sizes) ** GROWTH,
        )

    def seconds(self, deborah: float, count: int, order: int, modes: int) -> float:
        """CPU seconds of a point, with what the way to it from the De before costs.

        Args:
            deborah: lambda_1 Ubar/D.
            count: Number of spheres.
            order: Polynomial order of the velocity.
            modes: Of the fluid.
        """
        rows = self._rows[(self._rows.deborah == 0) == (deborah == 0)]
        nearest = min(rows.velocity_order.unique(), key=lambda known: abs(known - order))
        rows = rows[rows.velocity_order == nearest]
        known = min(rows.spheres.unique(), key=lambda number: abs(number - count))
        means = rows[rows.spheres == known].groupby("x")["unit"].mean()
        unit = np.exp(np.interp(_coordinate(deborah), means.index, np.log(means)))
        return float(unit * count / known * _size(deborah, order, modes) ** GROWTH)


def _coordinate(deborah):
    """The coordinate of the continuation."""
    return np.log1p(deborah / continuation.DEBORAH_OF_ELASTICITY)


def _size(deborah: float, order: int, modes: int) -> float:
    """Unknowns per element of what is solved at a Deborah number."""
    if deborah == 0:
        return unknowns_per_element(max(order, quasi_steady.NEWTONIAN_ORDER), 0)
    return unknowns_per_element(order, modes)


def own_costs(results: Path, stage: str = "dns") -> pd.DataFrame:
    """Times of the study's finished geometries, of one stage: deborah, spheres, cpu_seconds."""
    files = sorted((results / stage / "timing").glob("*.csv"))
    columns = ["deborah", "spheres", "cpu_seconds"]
    if not files:
        return pd.DataFrame(columns=columns)
    table = pd.concat(map(pd.read_csv, files))
    numbers = [spheres(*row) for row in zip(table.sp, table.sf, strict=True)]
    return table.assign(spheres=numbers)[columns]


def flow_seconds(
    study: Study,
    geometry: Triplet,
    deborahs: Sequence[float],
    model: CostModel,
    own: pd.DataFrame,
) -> float:
    """CPU seconds of one geometry at Deborah numbers of the study."""
    count, modes = spheres(*geometry), _modes(study)
    total = 0.0
    for De in deborahs:
        finished = own[own.deborah == De]
        if finished.empty:
            order = study.dns.velocity_order
            seconds = model.seconds(study.deborah_longest_mode(De), count, order, modes)
            total += seconds * (TRANSIENT if study.dns.method == "transient" else 1.0)
        else:
            known = min(finished.spheres.unique(), key=lambda number: abs(number - count))
            mean = finished.cpu_seconds[finished.spheres == known].mean()
            total += mean * count / known
    return total


def _modes(study: Study) -> int:
    """Of the fluid; while it is not fitted as many as the config asks for, or `USUAL_MODES`."""
    if study.fluid.modes is None:
        return study.fluid.fit.modes or USUAL_MODES
    return len(study.fluid.modes)


# --------------------------------------------------------------------------------- cost of stages


@dataclass(frozen=True)
class StageCost:
    """What is left of a stage.

    Attributes:
        name: As its folder of results.
        jobs: How many.
        seconds: CPU, all jobs together, their starts not included.
        longest: CPU seconds of the longest job.
        megabytes: That the largest job asks for.
    """

    name: str
    jobs: int
    seconds: float
    longest: float
    megabytes: int


@dataclass(frozen=True)
class Cost:
    """What is left, by stages, each of which waits for the one before."""

    stages: tuple[StageCost, ...]

    def of(self, name: str) -> float:
        """CPU seconds of a stage, without the start of its jobs."""
        return sum(stage.seconds for stage in self.stages if stage.name == name)

    @property
    def jobs(self) -> int:
        """Number of jobs."""
        return sum(stage.jobs for stage in self.stages)

    @property
    def together(self) -> float:
        """CPU seconds."""
        return START_UP * self.jobs + sum(stage.seconds for stage in self.stages)

    @property
    def longest(self) -> float:
        """CPU seconds of jobs that wait for each other."""
        return sum(START_UP + stage.longest for stage in self.stages if stage.jobs)

    def wall(self, cores: int) -> float:
        """Seconds on a number of cores; no run is shorter than its longest jobs."""
        speed = 1.0 + BUSY_CORE * (cores - 1)
        return max(self.together / speed, self.longest)


def cost_of(
    study: Study, work: Work, own: pd.DataFrame, measured: pd.DataFrame, minutes: float = MINUTES
) -> Cost:
    """Cost of the work that is left of a run without targets.

    Args:
        study: The config.
        work: What is left of it.
        own: Times of its own finished geometries.
        measured: Times of others.
        minutes: Work in a job of several geometries.
    """
    before = cost_of_table(study, work, own, measured, minutes)
    if not (before.jobs or work.trains_left):
        return Cost(())
    trains = [
        train_seconds(study, phi, study.trains, study.trains.feed) for _, phi in work.trains_left
    ]
    points: dict[float, float] = {}
    for De, phi in study.map_conditions():
        points[De] = points.get(De, 0) + train_seconds(study, phi, study.design_map, study.map_feed)
    films = len(study.movie_conditions())
    frames = study.movies.frames * (len(study.stations) + 1)
    pictures = len(study.deborah.values) + 2 * len(work.trains) + films + 5
    draws = DRAW * work.draws * len(study.deborah.values)
    rest = [OTHERS[name][0] - START_UP for name in REST]
    duct = OTHERS["channel_flow"][0] if study.channel.section.is_duct else 0.0
    return Cost(
        (
            *before.stages,
            _stage("trains", trains, OTHERS["trains"]),
            _stage("diameter_variation", [variation_seconds(study)], OTHERS["trains"]),
            _stage("design_map", [*points.values(), *[0.0] * bool(points)], OTHERS["trains"]),
            _stage("movies", [*[0.0] * films, *[FRAME * frames] * films], OTHERS["movies"]),
            _stage("fit_spread", [draws] * bool(draws), OTHERS["fit_spread"]),
            # Of the study, of velocities and of every train.
            _spread("figures", FIGURE * pictures, 2 + len(work.trains), OTHERS["figures"]),
            _stage("the rest", [*rest, duct], OTHERS["order"]),
        )
    )


def cost_of_table(
    study: Study, work: Work, own: pd.DataFrame, measured: pd.DataFrame, minutes: float = MINUTES
) -> Cost:
    """Of what all else needs: the fluid and the table; for the arguments see `cost_of`."""
    flows = _flows(study, work, CostModel(measured), own, minutes)
    seconds = [OTHERS["fluid_fit"][0]] * (study.fluid.modes is None)
    fit = _stage("fluid_fit", seconds, OTHERS["fluid_fit"])
    table = bool(flows.jobs or (study.table.file and work.trains_left))
    return Cost(
        (
            *[fit] * bool(fit.jobs),
            flows,
            _stage("table", [0.0] * table, OTHERS["table"]),
        )
    )


def cost_of_request(name: str, study: Study, results: Path, before: Cost) -> Cost:
    """Of a target on its own, with the table that it needs; what is there does not count.

    Args:
        name: One of `REQUESTS`.
        study: The config.
        results: Its folder.
        before: Of the table.
    """
    again = before.jobs > 0
    jobs: dict[str, list[float]] = {}
    for request in REQUESTS[name](study):
        if again or not (results / request.file).exists():
            jobs.setdefault(request.stage, []).append(request.seconds)
    own = [_stage(stage, seconds, OTHERS["trains"]) for stage, seconds in jobs.items()]
    return Cost((*before.stages, *own))


def _flows(
    study: Study, work: Work, model: CostModel, own: pd.DataFrame, minutes: float
) -> StageCost:
    """Simulations; the flow that is drawn is solved once more, without being one of the table's."""
    left = {
        geometry: flow_seconds(study, geometry, deborahs, model, own)
        for geometry, deborahs in work.flows_left.items()
    }
    transient = study.dns.method == "transient"
    groups = [[geometry] for geometry in left] if transient else grouping.jobs(study, minutes)
    jobs = [sum(left.get(geometry, 0.0) for geometry in group) for group in groups]
    jobs = [seconds for seconds in jobs if seconds]
    if jobs and study.table.file is None:  # single spheres of other diameters
        sphere = flow_seconds(study, (math.inf, math.inf), study.deborah.values, model, own)
        jobs.append(sphere * len(diameter_ratios(study)))
    if jobs and study.field_point():
        jobs.append(float(np.mean(list(left.values()))))
    largest = study.deborah_longest_mode(max(study.deborah.values))
    return StageCost(
        "transient" if transient else "dns",
        len(jobs),
        sum(jobs),
        max(jobs, default=0.0),
        megabytes(largest),
    )


def _stage(name: str, seconds: Sequence[float], measured: tuple[float, int]) -> StageCost:
    """A stage of jobs that take so long, with the memory of a measured one."""
    most = megabytes_for(measured[1])
    return StageCost(name, len(seconds), sum(seconds), max(seconds, default=0.0), most)


def _spread(name: str, seconds: float, jobs: int, measured: tuple[float, int]) -> StageCost:
    """The same for work that is spread evenly over its jobs."""
    return _stage(name, [seconds / jobs] * jobs, measured)
