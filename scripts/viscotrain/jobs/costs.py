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
from viscotrain.config.geometries import diameter_ratios, simulated, wanted
from viscotrain.config.names import train_name
from viscotrain.config.study import Study
from viscotrain.flow import continuation, quasi_steady
from viscotrain.flow.refinement import unknowns_per_element
from viscotrain.jobs import grouping
from viscotrain.jobs.digests import digest
from viscotrain.jobs.grouping import MINUTES
from viscotrain.jobs.progress import Point, outcomes
from viscotrain.jobs.provenance import made_with
from viscotrain.jobs.resources import (
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
TRANSIENT = 15.0  # start-ups of all De of a geometry over its quasi-steady solution
BUSY_CORE = 0.9  # what a further core adds: memory is shared, and the last jobs leave cores idle


@dataclass(frozen=True)
class Work:
    """What a study consists of and what is left of it.

    Attributes:
        flows: Geometries that are simulated, each at its Deborah numbers.
        outcomes: Status of the points that are there.
        trains: (De, volume fraction).
        trains_left: Those not there.
    """

    flows: dict[Triplet, tuple[float, ...]]
    outcomes: dict[Point, int]
    trains: tuple[tuple[float, float], ...]
    trains_left: tuple[tuple[float, float], ...]

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
    count, modes = spheres(*geometry), len(study.dimensionless_fluid.modes)
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


# --------------------------------------------------------------------------------------- report


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
    """Cost of the work that is left.

    Args:
        study: The config.
        work: What is left of it.
        own: Times of its own finished geometries.
        measured: Times of others.
        minutes: Work in a job of several geometries.
    """
    flows = _flows(study, work, CostModel(measured), own, minutes)
    if not (flows.jobs or work.trains_left):
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
    return Cost(
        (
            flows,
            _stage("table", [0.0] * bool(flows.jobs), OTHERS["table"]),
            _stage("trains", trains, OTHERS["trains"]),
            _stage("diameter_variation", [variation_seconds(study)], OTHERS["trains"]),
            _stage("design_map", [*points.values(), *[0.0] * bool(points)], OTHERS["trains"]),
            _stage("movies", [*[0.0] * films, *[FRAME * frames] * films], OTHERS["movies"]),
            # Of the study, of velocities and of every train; then order, units, config, page,
            # summary.
            _spread("figures", FIGURE * pictures, 2 + len(work.trains), OTHERS["figures"]),
            _spread("the rest", 0.0, 5, OTHERS["order"]),
        )
    )


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
        jobs += [sphere] * len(diameter_ratios(study))
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


def basis_of(study: Study, own: pd.DataFrame) -> str:
    """What the estimate rests on, in words."""
    own_times = "times of this study's finished geometries"
    measured = f"times in {MEASURED.name}, of another machine or run"
    unknown = [f"{De:g}" for De in study.deborah.values if not (own.deborah == De).any()]
    if not unknown:
        return own_times
    if len(unknown) == len(study.deborah.values):
        return measured
    return f"{own_times}; at De {', '.join(unknown)} {measured}"


def estimate(
    study: Study, results: Path, cores: int, measured: pd.DataFrame, minutes: float = MINUTES
) -> str:
    """The whole estimate as text; for the arguments see `cost_of`."""
    work, own, cost = counted(study, results, measured, minutes)
    simulated_points = sum(map(len, work.flows.values()))
    left, points_left = len(work.flows_left), sum(map(len, work.flows_left.values()))
    table = sum(len({*study.geometries, *wanted(study, De)}) for De in study.deborah.values)
    unsolved = len(work.outcomes) - work.solved
    trains, trains_left = len(work.trains), len(work.trains_left)
    lines = [
        f"study {study.study}: {len(work.flows)} geometries, {simulated_points} points "
        f"(De x geometry), {trains} trains with {study.trains.repeats} repeats each",
        f"               these make {table} points of the table, and check it",
        f"  solved       {work.solved} points of {len(work.flows) - left} geometries"
        + (f"; {unsolved} without a solution" if unsolved else "")
        + f"; {trains - trains_left} trains",
        f"  left         {left} geometries, {points_left} points, {trains_left} trains",
        *(_row(stage) for stage in cost.stages if stage.jobs),
        expected(cost, cores),
    ]
    if left:
        lines.append(f"  rests on     {basis_of(study, own)}")
    return "\n".join(lines)


def counted(
    study: Study, results: Path, measured: pd.DataFrame, minutes: float
) -> tuple[Work, pd.DataFrame, Cost]:
    """What there is to do, times of the study's own geometries, and what is left to pay."""
    work = work_of(study, results)
    own = own_costs(results, "transient" if study.dns.method == "transient" else "dns")
    return work, own, cost_of(study, work, own, measured, minutes)


def expected(cost: Cost, cores: int) -> str:
    """The line about all of it."""
    return (
        f"  expected     {cost.together / 3600:.2f} core-hours in {cost.jobs} jobs, "
        f"{_duration(cost.wall(cores))} on {cores} {'core' if cores == 1 else 'cores'}"
    )


def _row(stage: StageCost) -> str:
    """A line about a stage."""
    jobs = f"{stage.jobs} {'job' if stage.jobs == 1 else 'jobs'}"
    seconds = stage.seconds + START_UP * stage.jobs
    return (
        f"    {stage.name:<10} {jobs}, {seconds / 3600:.2f} core-hours, "
        f"the longest {_duration(START_UP + stage.longest)}, {stage.megabytes / 1e3:.1f} GB each"
    )


def _duration(seconds: float) -> str:
    """12 s, 3.4 min or 1.2 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.1f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
