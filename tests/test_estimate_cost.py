"""The estimate before a run: what is counted, what is done already, and how times are scaled."""

import math
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr
from estimate_cost import (
    GROWTH,
    MEASURED,
    CostModel,
    cost_of,
    estimate,
    flow_seconds,
    orders,
    own_costs,
    sample_of,
    train_seconds,
    unknowns,
    work_of,
)

from viscotrain import provenance
from viscotrain.config import (
    Study,
    geometry_name,
    load_study,
    simulated,
    simulated_deborahs,
    train_name,
)
from viscotrain.simulation import solutions, triplet

ROOT = Path(__file__).parent.parent
STEP = math.log(3)  # of the continuation, in log(1 + De/De_0)


def deborah_at(x: float) -> float:
    return 0.5 * math.expm1(x)


def measured_row(x_before: float, x: float, order: int, count: int, steps: int, seconds: float):
    return {
        "deborah_before": deborah_at(x_before) if x else math.nan,
        "deborah": deborah_at(x),
        "velocity_order": order,
        "unknowns": count,
        "steps": steps,
        "solved": True,
        "cpu_seconds": seconds,
    }


@pytest.fixture
def measured() -> pd.DataFrame:
    """One step per `STEP` at 2 s with 1000 unknowns of order 3; order 4 takes 20 s at 2000."""
    return pd.DataFrame(
        [
            measured_row(0, 0, 5, 1000, 1, 1.0),
            measured_row(0, STEP, 3, 1000, 1, 2.0),
            measured_row(STEP, 3 * STEP, 3, 1000, 2, 4.0),
            measured_row(3 * STEP, 4 * STEP, 4, 2000, 1, 20.0),
        ]
    )


@pytest.fixture
def study() -> Study:
    return load_study(ROOT / "config" / "tiny.yaml")


def results_of(study: Study, folder: Path, geometries, trains=()) -> Path:
    """Files as a run leaves them, as far as the estimate looks at them."""
    for sub in ("dns/timing", "trains"):
        (folder / sub).mkdir(parents=True, exist_ok=True)
    attributes = provenance.attributes("test", study.resolved_yaml())
    for geometry in geometries:
        De = list(simulated_deborahs(study, *geometry))
        outcome = xr.Dataset({"status": ("deborah", [0] * len(De))}, {"deborah": De}, attributes)
        outcome.to_netcdf(folder / f"dns/{geometry_name(*geometry)}.nc")
        timing = [{"deborah": 0, "cpu_seconds": 0.5, "unknowns": 1000}]
        timing += [{"deborah": 1, "cpu_seconds": 7.0, "unknowns": 2000}]
        path = folder / f"dns/timing/{geometry_name(*geometry)}.csv"
        pd.DataFrame(timing).to_csv(path, index=False)
    attributes |= {"trains_digest": provenance.digest(provenance.TRAINS)}
    for train in trains:
        xr.Dataset(attrs=attributes).to_netcdf(folder / f"trains/{train_name(*train)}.nc")
    return folder


# ---------------------------------------------------------------------------------- what is counted


def test_counts_of_a_study_that_never_ran(study, tmp_path):
    work = work_of(study, tmp_path)
    # Of 2 x 2 and one to check, (inf, 1.5) is (1.5, inf).
    assert work.flows == work.flows_left == simulated(study)
    assert len(work.flows) == 4
    assert work.solved == 0
    assert work.trains == work.trains_left == ((1.0, 0.01),)


def test_finished_geometries_are_not_counted_again(study, tmp_path):
    work = work_of(study, results_of(study, tmp_path, list(simulated(study))[:3], [(1.0, 0.01)]))
    assert len(work.flows_left) == 1
    assert work.solved == 6
    assert len(work.trains_left) == 1  # the table they rest on will change


def test_nothing_is_left_of_a_finished_study(study, tmp_path, measured):
    everything = work_of(study, tmp_path).flows
    work = work_of(study, results_of(study, tmp_path, everything, [(1.0, 0.01)]))
    assert (work.flows_left, work.trains_left) == ({}, ())
    assert cost_of(study, work, own_costs(tmp_path), measured).together == 0
    assert "expected     0.00 core-hours" in estimate(study, tmp_path, 2, measured)


@pytest.mark.parametrize("change", [{"dns": {"tolerance": 1e-8}}, {"particle": {"diameter": 1e-5}}])
def test_results_of_other_settings_do_not_count(change, study, tmp_path):
    results_of(study, tmp_path, study.geometries)
    section, values = next(iter(change.items()))
    other = study.model_copy(update={section: getattr(study, section).model_copy(update=values)})
    assert len(work_of(other, tmp_path).flows_left) == 4


def test_results_of_other_physics_do_not_count(study, tmp_path):
    results_of(study, tmp_path, study.geometries)
    path = tmp_path / f"dns/{geometry_name(*study.geometries[0])}.nc"
    dataset = xr.load_dataset(path).assign_attrs(physics_digest="0123")
    dataset.to_netcdf(path)
    assert study.geometries[0] in work_of(study, tmp_path).flows_left


def test_broken_files_do_not_count(study, tmp_path):
    results_of(study, tmp_path, study.geometries[:1])
    path = tmp_path / f"dns/{geometry_name(*study.geometries[0])}.nc"
    path.write_bytes(path.read_bytes()[:100])
    assert len(work_of(study, tmp_path).flows_left) == 4


def test_points_are_counted_and_not_files(study, tmp_path, measured):
    results_of(study, tmp_path, study.geometries[:1])
    path = tmp_path / f"dns/{geometry_name(*study.geometries[0])}.nc"
    failed = xr.load_dataset(path)
    failed["status"][1] = 1
    failed.to_netcdf(path)
    text = estimate(study, tmp_path, 2, measured)
    assert "solved       1 points of 1 geometries; 1 without a solution; 0 trains" in text


def test_finished_start_ups_are_not_counted_again(study, tmp_path):
    method = study.dns.model_copy(update={"method": "transient"})
    study = study.model_copy(update={"dns": method})
    (tmp_path / "transient").mkdir()
    attributes = provenance.attributes("test", study.resolved_yaml())
    outcome = xr.Dataset({"status": 0, "deborah": 1.0}, attrs=attributes)
    outcome.to_netcdf(tmp_path / "transient/sp1.5_sf1.5_De1.nc")
    assert work_of(study, tmp_path).flows_left[1.5, 1.5] == (0,)


def test_the_sample_is_spread_over_what_is_left(tmp_path):
    study = load_study(ROOT / "config" / "paper.yaml")
    sample = sample_of(work_of(study, tmp_path))
    assert len(set(sample)) == len(sample) == 8
    assert len({sp for sp, _ in sample}) > 5


# ----------------------------------------------------------------------------------- cost of a flow


def test_measured_times_are_returned_as_they_are(measured):
    model = CostModel(measured)
    assert model.seconds(0, 0, 5, 1000) == pytest.approx(1.0)
    assert model.seconds(0, deborah_at(STEP), 3, 1000) == pytest.approx(2.0)
    assert model.seconds(deborah_at(STEP), deborah_at(3 * STEP), 3, 1000) == pytest.approx(4.0)
    assert model.seconds(deborah_at(3 * STEP), deborah_at(4 * STEP), 4, 2000) == pytest.approx(20.0)


def test_times_grow_with_unknowns_and_with_the_way_to_go(measured):
    model, De = CostModel(measured), deborah_at(2 * STEP)
    once = model.seconds(deborah_at(STEP), De, 3, 1000)
    assert model.seconds(deborah_at(STEP), De, 3, 3000) == pytest.approx(3**GROWTH * once)
    assert model.seconds(0, De, 3, 1000) == pytest.approx(2 * once)
    assert model.seconds(0.99 * De, De, 3, 1000) == pytest.approx(once)  # a step is the least


def test_an_order_that_was_not_measured_takes_the_nearest(measured):
    model, De = CostModel(measured), deborah_at(STEP)
    assert model.seconds(0, De, 2, 1000) == model.seconds(0, De, 3, 1000)


def test_points_that_were_not_solved_are_left_out(measured):
    failed = measured.assign(solved=False, cpu_seconds=1e6)
    both = pd.concat([measured, failed])
    assert CostModel(both).seconds(0, 1, 3, 1000) == CostModel(measured).seconds(0, 1, 3, 1000)


def test_unknowns_are_those_of_the_solver(study):
    flows = [solution.flow for _, solution in solutions(study, triplet(study, math.inf, math.inf))]
    assert orders(study) == [flow.velocity_order for flow in flows]
    assert unknowns(study, math.inf, math.inf) == [flow.space.ndof for flow in flows]


def test_own_times_of_a_study_go_before_measured_ones(study, tmp_path, measured):
    own = own_costs(results_of(study, tmp_path, study.geometries[:2]))
    model = CostModel(measured)
    assert flow_seconds(study, [1000, 2000], model, own) == pytest.approx(7.5)
    only_newtonian = own[own.deborah == 0]
    expected = 0.5 + model.seconds(0, 1, 2, 2000)
    assert flow_seconds(study, [1000, 2000], model, only_newtonian) == pytest.approx(expected)


def test_the_estimate_says_what_it_rests_on(study, tmp_path, measured):
    assert MEASURED.name in estimate(study, tmp_path, 2, measured)
    results_of(study, tmp_path, study.geometries[:2])
    text = estimate(study, tmp_path, 2, measured)
    assert "times of this study's finished geometries" in text
    assert MEASURED.name not in text


def test_a_further_core_shortens_the_run_but_not_its_longest_job(study, tmp_path, measured):
    cost = cost_of(study, work_of(study, tmp_path), own_costs(tmp_path), measured)
    assert cost.wall(1) == pytest.approx(cost.together)
    assert cost.together / 2 < cost.wall(2) < cost.together
    assert cost.wall(10_000) == cost.longest


def test_more_repeats_and_spheres_cost_more(study):
    repeated = study.trains.model_copy(update={"repeats": 2 * study.trains.repeats})
    once = train_seconds(study, 0.01, study.trains)
    assert train_seconds(study, 0.01, repeated) == pytest.approx(2 * once)
    assert train_seconds(study, 0.02, study.trains) > once


def test_design_map_and_movies_cost(study, tmp_path, measured):
    def rest(**sections):
        changed = study.model_copy(update=sections)
        return cost_of(changed, work_of(changed, tmp_path), own_costs(tmp_path), measured).rest

    without_map = study.design_map.model_copy(update={"deborah": ()})
    without_movies = study.movies.model_copy(update={"deborah": ()})
    assert rest(design_map=without_map) < rest()
    assert rest(movies=without_movies) < rest()
    longer = study.movies.model_copy(update={"frames": 10 * study.movies.frames})
    assert rest(movies=longer) > rest()


# ------------------------------------------------------------------------------------- command line


def test_command_line_with_the_shipped_measurements(tmp_path):
    script = [sys.executable, ROOT / "scripts" / "estimate_cost.py"]
    options = ["--configfile", "config/tiny.yaml", "--cores", "1"]
    shutil.copytree(ROOT / "config", tmp_path / "config")
    done = subprocess.run(
        [*script, *options], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert "study tiny: 4 geometries, 8 points (De x geometry), 1 trains" in done.stdout
    assert "core-hours" in done.stdout
