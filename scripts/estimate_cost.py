"""What a study will cost: geometries, points, trains, what is done already, CPU and wall time.

    python scripts/estimate_cost.py --configfile config/paper.yaml --cores 2

Model. A Deborah number takes a number of continuation steps, and a step at one polynomial order
takes CPU seconds proportional to unknowns^`GROWTH`. Steps and seconds per step come from
`measured_costs.csv`, which `benchmark.py --output` writes, unknowns from meshes of a few of the
study's geometries. Where geometries of the study are finished, their own times take the place of
the measured ones. Trains cost per sphere that is injected.
"""

import argparse
import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from viscotrain import dns, simulation
from viscotrain.command import reporting
from viscotrain.config import (
    DesignMapConfig,
    Study,
    TrainsConfig,
    load_study,
    simulated,
    train_name,
    with_fitted_fluid,
)
from viscotrain.fluid import NEWTONIAN
from viscotrain.progress import Point, made_with, outcomes
from viscotrain.provenance import TRAINS, digest
from viscotrain.table import SOLVED
from viscotrain.triplets import Triplet

MEASURED = Path(__file__).parent / "viscotrain" / "measured_costs.csv"
GROWTH = 1.2  # assembly is linear in the unknowns, factorisation a little steeper
SAMPLED = 8  # geometries whose mesh is made to count unknowns; the cost of the others is the mean
START_UP = 2.0  # CPU seconds of a job that imports everything
FIGURE = 1.5  # CPU seconds of a figure
FRAME = 0.008  # CPU seconds of a movie's frame, encoding included
TRANSIENT = 15.0  # start-ups of all De of a geometry over its quasi-steady solution
# CPU seconds of a train per injected sphere, with N spheres in the channel: a + b N, measured for
# N from 300 to 1500.
TRAIN = {"a": 5.5e-4, "b": 7.5e-7}
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
        return sum(status == SOLVED for status in self.outcomes.values())


# -------------------------------------------------------------------------------- what is there


def work_of(study: Study, results: Path) -> Work:
    """Count results that are there and were made with the present settings and code."""
    flows, there = simulated(study), outcomes(study, results)
    trains = tuple(itertools.product(study.trains.deborah, study.trains.volume_fraction))
    trains_code = digest(TRAINS)

    def train_done(train) -> bool:
        made, code = made_with(results / "trains" / f"{train_name(*train)}.nc", "trains_digest")
        return code == trains_code and made.trains_settings() == study.trains_settings()

    work = Work(flows, there, trains, tuple(t for t in trains if not train_done(t)))
    # A table that changes repeats every train.
    return replace(work, trains_left=trains) if work.flows_left else work


# -------------------------------------------------------------------------------- cost of a flow


def unknowns(study: Study, sp: float, sf: float) -> list[int]:
    """Unknowns of one geometry at every Deborah number of the study, in the order solved there."""
    geometry = simulation.triplet(study, sp, sf)
    fluid = study.dimensionless_fluid

    @functools.cache
    def count(high: bool, newtonian: bool, order: int) -> int:
        deborah = math.inf if high else 0.0
        flow = simulation.make_flow(study, geometry, deborah)
        return flow.variant(NEWTONIAN if newtonian else fluid, order).space.ndof

    return [
        count(De > study.dns.high_deborah.above, De == 0, order)
        for De, order in zip(study.deborah.values, orders(study), strict=True)
    ]


def orders(study: Study) -> list[int]:
    """Polynomial order at every Deborah number of the study."""
    own = {De: simulation.resolution(study, De).velocity_order for De in study.deborah.values}
    return [own[De] if De > 0 else max(own[De], dns.NEWTONIAN_ORDER) for De in own]


class CostModel:
    """CPU seconds of a flow from measured ones.

    Args:
        measured: Table with the columns that `benchmark.py` writes.
    """

    def __init__(self, measured: pd.DataFrame):
        measured = measured[measured.solved]
        x = np.log1p(measured.deborah / dns.DEBORAH_OF_ELASTICITY)
        before = measured.deborah_before.fillna(0.0)
        advance = x - np.log1p(before / dns.DEBORAH_OF_ELASTICITY)
        rows = measured.assign(
            x=x,
            step=advance / measured.steps,
            unit=measured.cpu_seconds / measured.steps / measured.unknowns**GROWTH,
        )
        self._newtonian = rows[rows.deborah == 0]["unit"].median()
        self._elastic = rows[rows.deborah > 0]

    def seconds(self, before: float, deborah: float, order: int, count: float) -> float:
        """CPU seconds from one lambda_1 Ubar/D (0: from rest) to the next, both in this order."""
        if deborah == 0:
            return self._newtonian * count**GROWTH
        x, x_before = (math.log1p(De / dns.DEBORAH_OF_ELASTICITY) for De in (deborah, before))
        rows = self._of_order(order)
        step, unit = (np.interp(x, rows.index, rows[name]) for name in ("step", "unit"))
        return max(1.0, (x - x_before) / step) * unit * count**GROWTH

    def _of_order(self, order: int) -> pd.DataFrame:
        """Medians over geometries, by x, of the measured order that is nearest."""
        measured = self._elastic.velocity_order
        nearest = min(measured.unique(), key=lambda known: abs(known - order))
        return self._elastic[measured == nearest].groupby("x")[["step", "unit"]].median()


def own_costs(results: Path) -> pd.DataFrame:
    """Times of the study's finished geometries: deborah, cpu_seconds, unknowns."""
    files = sorted((results / "dns" / "timing").glob("*.csv"))
    tables = [pd.read_csv(path) for path in files]
    columns = ["deborah", "cpu_seconds", "unknowns"]
    return pd.concat(tables)[columns] if tables else pd.DataFrame(columns=columns)


def flow_seconds(
    study: Study, counts: Sequence[float], model: CostModel, own: pd.DataFrame
) -> float:
    """CPU seconds of one geometry with these unknowns at each Deborah number of the study."""
    total, before = 0.0, 0.0
    for De, order, count in zip(study.deborah.values, orders(study), counts, strict=True):
        deborah = study.deborah_longest_mode(De)
        finished = own[own.deborah == De]
        if finished.empty:
            total += model.seconds(before, deborah, order, count)
        else:
            total += (finished.cpu_seconds * (count / finished.unknowns) ** GROWTH).median()
        before = deborah
    return total


def train_seconds(
    study: Study, volume_fraction: float, runs: TrainsConfig | DesignMapConfig
) -> float:
    """CPU seconds of all repeats of one train of a section of the config."""
    inside = study.channel.length / (study.mean_spacing(volume_fraction) * study.confinement)
    injected = inside + runs.passages
    return runs.repeats * injected * (TRAIN["a"] + TRAIN["b"] * inside)


# --------------------------------------------------------------------------------------- report


@dataclass(frozen=True)
class Cost:
    """CPU seconds of what is left, and of its longest job."""

    flows: float
    trains: float
    rest: float
    longest: float

    @property
    def together(self) -> float:
        """CPU seconds."""
        return self.flows + self.trains + self.rest

    def wall(self, cores: int) -> float:
        """Seconds on a number of cores; no run is shorter than its longest job."""
        speed = 1.0 + BUSY_CORE * (cores - 1)
        return max(self.together / speed, self.longest)


def cost_of(study: Study, work: Work, own: pd.DataFrame, measured: pd.DataFrame) -> Cost:
    """Cost of the work that is left."""
    model = CostModel(measured)
    each = []
    for geometry in sample_of(work):
        part = study.at(work.flows_left[geometry])
        each.append(flow_seconds(part, unknowns(part, *geometry), model, own))
    if study.dns.method == "transient":
        each = [seconds * TRANSIENT for seconds in each]
    mean = float(np.mean(each)) if each else 0.0
    trains = [train_seconds(study, phi, study.trains) for _, phi in work.trains_left]
    films = study.movie_conditions()
    design_map = [train_seconds(study, phi, study.design_map) for _, phi in study.map_conditions()]
    figures = len(study.deborah.values) + 2 * len(work.trains) + len(films) + 5
    jobs = len(work.flows_left) + len(trains)
    frames = study.movies.frames * len(films) * (len(study.trains.stations) + 1)
    # Besides: design points by De and the map of them, figures of study, velocities and trains,
    # field, table, page and summary.
    rows = len({De for De, _ in study.map_conditions()})
    started = jobs + len(films) + rows + len(work.trains) + 7
    # The flow that is drawn is solved once more, without being one of the table's jobs.
    rest = START_UP * started + FIGURE * figures + FRAME * frames + sum(design_map) + mean
    rest = rest if jobs else 0.0
    return Cost(
        flows=len(work.flows_left) * mean,
        trains=sum(trains),
        rest=rest,
        longest=max([*each, *trains], default=0.0),
    )


def sample_of(work: Work) -> list[Triplet]:
    """Some of the geometries left, evenly spread."""
    left = list(work.flows_left)
    number = min(SAMPLED, len(left))
    return [left[int((k + 0.5) * len(left) / number)] for k in range(number)]


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


def estimate(study: Study, results: Path, cores: int, measured: pd.DataFrame) -> str:
    """The whole estimate as text."""
    work, own = work_of(study, results), own_costs(results)
    cost = cost_of(study, work, own, measured)
    simulated_points = sum(map(len, work.flows.values()))
    left, points_left = len(work.flows_left), sum(map(len, work.flows_left.values()))
    table = len(study.geometries) * len(study.deborah.values)
    unsolved = len(work.outcomes) - work.solved
    trains, trains_left = len(work.trains), len(work.trains_left)
    each = f", {cost.flows / left:.0f} s per geometry" if left else ""
    lines = [
        f"study {study.study}: {len(work.flows)} geometries, {simulated_points} points "
        f"(De x geometry), {trains} trains with {study.trains.repeats} repeats each",
        f"               these make {table} points of the table, and check it",
        f"  solved       {work.solved} points of {len(work.flows) - left} geometries"
        + (f"; {unsolved} without a solution" if unsolved else "")
        + f"; {trains - trains_left} trains",
        f"  left         {left} geometries, {points_left} points, {trains_left} trains",
        f"  simulations  {_duration(cost.flows)} CPU{each}",
        f"  trains       {_duration(cost.trains)} CPU",
        f"  the rest     {_duration(cost.rest)} CPU: start of jobs, design map, movies, figures",
        f"  expected     {cost.together / 3600:.2f} core-hours, "
        f"{_duration(cost.wall(cores))} on {cores} {'core' if cores == 1 else 'cores'}",
    ]
    if left:
        lines.append(f"  rests on     {basis_of(study, own)};")
        counted = len(sample_of(work))
        lines.append(f"               unknowns counted on {counted} of the {left} meshes left")
    return "\n".join(lines)


def _duration(seconds: float) -> str:
    """12 s, 3.4 min or 1.2 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.1f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("--cores", type=int, default=2, help="that Snakemake will be given")
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of all runs")
    arguments = parser.parse_args()
    with reporting():
        study = with_fitted_fluid(load_study(arguments.configfile))
        results = arguments.results / study.study
        print(estimate(study, results, max(1, arguments.cores), pd.read_csv(MEASURED)))


if __name__ == "__main__":
    _command_line()
