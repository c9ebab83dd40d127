"""What a study will cost, in words: what is there, what is left of stages, and on request."""

from dataclasses import replace
from pathlib import Path

import pandas as pd

from viscotrain.config.geometries import wanted
from viscotrain.config.reading import with_fluid_of
from viscotrain.config.study import Study
from viscotrain.jobs.costs import (
    Cost,
    StageCost,
    Work,
    cost_of,
    cost_of_request,
    cost_of_table,
    own_costs,
    work_of,
)
from viscotrain.jobs.grouping import MINUTES
from viscotrain.jobs.on_request import REQUESTS
from viscotrain.jobs.resources import MEASURED, START_UP


def basis_of(study: Study, own: pd.DataFrame) -> str:
    """What the estimate rests on, in words."""
    own_times = "times of this study's finished geometries"
    measured = f"times in {MEASURED.name}, of another machine or run"
    if study.fluid.modes is None:
        return f"{measured}; the fluid is not fitted yet"
    unknown = [f"{De:g}" for De in study.deborah.values if not (own.deborah == De).any()]
    if not unknown:
        return own_times
    if len(unknown) == len(study.deborah.values):
        return measured
    return f"{own_times}; at De {', '.join(unknown)} {measured}"


def estimate(
    study: Study, results: Path, cores: int, measured: pd.DataFrame, minutes: float = MINUTES
) -> str:
    """The whole estimate as text; for the arguments see `cost_of`.

    A fluid that is to be fitted may be fitted or not.
    """
    study, work, own = counted(study, results)
    cost = cost_of(study, work, own, measured, minutes)
    simulated_points = sum(map(len, work.flows.values()))
    left, points_left = len(work.flows_left), sum(map(len, work.flows_left.values()))
    table = len({*study.geometries, *wanted(study)}) * len(study.deborah.values)
    unsolved = len(work.outcomes) - work.solved
    trains, trains_left = len(work.trains), len(work.trains_left)
    lines = [
        f"study {study.study}: {len(work.flows)} geometries, {simulated_points} points "
        f"(De x geometry), {trains} trains with {study.trains.repeats} repeats each",
        f"                   these make {table} points of the table, and check it",
        f"  solved           {work.solved} points of {len(work.flows) - left} geometries"
        + (f"; {unsolved} without a solution" if unsolved else "")
        + f"; {trains - trains_left} trains",
        f"  left             {left} geometries, {points_left} points, {trains_left} trains",
        *(_row(stage) for stage in cost.stages if stage.jobs),
        expected(cost, cores),
        *_on_request(study, results, cost_of_table(study, work, own, measured, minutes), cores),
    ]
    if left:
        lines.append(f"  rests on         {basis_of(study, own)}")
    return "\n".join(lines)


def counted(study: Study, results: Path) -> tuple[Study, Work, pd.DataFrame]:
    """The study with its fluid as far as it is known, what there is to do, times of its own."""
    fit, spread = (results / name for name in ("fluid_fit/fluid.yaml", "fit_spread/fit_spread.nc"))
    wanted_draws = study.fluid.fit.draws if study.fluid.data else 0
    known = with_fluid_of(study, fit) if study.fluid.data and fit.exists() else study
    work = work_of(known, results)
    work = replace(work, draws=0 if spread.exists() and not work.flows_left else wanted_draws)
    return known, work, own_costs(results, _stage_of_flows(known))


def _stage_of_flows(study: Study) -> str:
    return "transient" if study.dns.method == "transient" else "dns"


def _on_request(study: Study, results: Path, before: Cost, cores: int) -> list[str]:
    """A line for each target that has a name, as if it were asked for alone."""
    return [
        expected(cost_of_request(name, study, results, before), cores, f"-- {name}")
        for name in REQUESTS
    ]


def expected(cost: Cost, cores: int, target: str = "expected") -> str:
    """The line about all of it, or about what a target needs."""
    return (
        f"  {target:<16} {cost.together / 3600:.2f} core-hours in {cost.jobs} jobs, "
        f"{_duration(cost.wall(cores))} on {cores} {'core' if cores == 1 else 'cores'}"
    )


def _row(stage: StageCost) -> str:
    """A line about a stage."""
    jobs = f"{stage.jobs} {'job' if stage.jobs == 1 else 'jobs'}"
    seconds = stage.seconds + START_UP * stage.jobs
    return (
        f"    {stage.name:<18} {jobs}, {seconds / 3600:.2f} core-hours, "
        f"the longest {_duration(START_UP + stage.longest)}, {stage.megabytes / 1e3:.1f} GB each"
    )


def _duration(seconds: float) -> str:
    """12 s, 3.4 min or 1.2 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.1f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
