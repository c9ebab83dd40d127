"""The estimate before a run: what is counted, what is done already, and how times are scaled."""

import math
from pathlib import Path

import harness
import pandas as pd
import pytest
import xarray as xr
import yaml

from viscotrain.config import stages
from viscotrain.config.geometries import simulated, simulated_deborahs
from viscotrain.config.names import geometry_name, point_name, train_name
from viscotrain.config.reading import parse_study
from viscotrain.config.study import Study
from viscotrain.flow.refinement import unknowns_per_element
from viscotrain.jobs import on_request, provenance, resources
from viscotrain.jobs.cost_report import counted, estimate
from viscotrain.jobs.costs import (
    GROWTH,
    MEASURED,
    START_UP,
    TRANSIENT,
    CostModel,
    cost_of,
    cost_of_request,
    cost_of_table,
    flow_seconds,
    own_costs,
    train_seconds,
    work_of,
)
from viscotrain.jobs.digests import digest
from viscotrain.jobs.grouping import jobs
from viscotrain.jobs.sweep_costs import estimate_all
from viscotrain.studies import diameter_variation
from viscotrain.studies.dns import make_flow, triplet
from viscotrain.words import INACCURATE


def measured_row(deborah: float, seconds: float, order=4, sp=1.5, sf=1.5, solved=True):
    return {
        "sp": sp,
        "sf": sf,
        "deborah": deborah,
        "velocity_order": order,
        "modes": 2,
        "solved": solved,
        "cpu_seconds": seconds,
    }


@pytest.fixture
def measured() -> pd.DataFrame:
    """Triplets at three De in order 4 and at one in order 3; a sphere takes a fifth of the time."""
    triplets = [
        measured_row(0.0, 1.0),
        measured_row(1.0, 2.0),
        measured_row(1.0, 4.0, sp=1.1),
        measured_row(8.0, 12.0),
        measured_row(1.0, 1.0, order=3),
    ]
    spheres = [measured_row(row["deborah"], row["cpu_seconds"] / 5) for row in triplets]
    return pd.DataFrame([*triplets, *(row | {"sp": math.inf, "sf": math.inf} for row in spheres)])


@pytest.fixture
def study() -> Study:
    return harness.study()


def results_of(study: Study, folder: Path, geometries, trains=()) -> Path:
    """Files as a run leaves them, as far as the estimate looks at them."""
    for sub in ("dns/timing", "trains"):
        (folder / sub).mkdir(parents=True, exist_ok=True)
    for geometry in geometries:
        own = stages.dns(study, *geometry)
        attributes = provenance.attributes("test", own, digest("dns"))
        De = list(simulated_deborahs(study, *geometry))
        outcome = xr.Dataset({"status": ("deborah", [0] * len(De))}, {"deborah": De}, attributes)
        outcome.to_netcdf(folder / f"dns/{geometry_name(*geometry)}.nc")
        timing = [{"deborah": 0, "cpu_seconds": 0.5}, {"deborah": 1, "cpu_seconds": 7.0}]
        path = folder / f"dns/timing/{geometry_name(*geometry)}.csv"
        pd.DataFrame(timing).assign(sp=geometry[0], sf=geometry[1]).to_csv(path, index=False)
    attributes = provenance.attributes("test", stages.trains(study), digest("trains"))
    for train in trains:
        xr.Dataset(attrs=attributes).to_netcdf(folder / f"trains/{train_name(*train)}.nc")
    return folder


# ---------------------------------------------------------------------------------- what is counted


def test_counts_of_a_study_that_never_ran(study, tmp_path):
    work = work_of(study, tmp_path)
    # Of 2 x 2, a pair and one to check, (inf, 1.5) is (1.5, inf).
    assert work.flows == work.flows_left == simulated(study)
    assert len(work.flows) == 5
    assert work.solved == 0
    assert work.trains == work.trains_left == ((1.0, 0.01),)


def test_finished_geometries_are_not_counted_again(study, tmp_path):
    work = work_of(study, results_of(study, tmp_path, list(simulated(study))[:3], [(1.0, 0.01)]))
    assert len(work.flows_left) == 2
    assert work.solved == 6
    assert len(work.trains_left) == 1  # the table they rest on will change


def test_nothing_is_left_of_a_finished_study(study, tmp_path, measured):
    everything = work_of(study, tmp_path).flows
    work = work_of(study, results_of(study, tmp_path, everything, [(1.0, 0.01)]))
    assert (work.flows_left, work.trains_left) == ({}, ())
    assert cost_of(study, work, own_costs(tmp_path), measured).together == 0
    assert "expected         0.00 core-hours" in estimate(study, tmp_path, 2, measured)


def test_several_diameters_cost_what_each_does(study, tmp_path, measured):
    others = [study.model_copy(update={"study": name}) for name in ("tiny/beta0.2", "tiny/beta0.3")]
    text = estimate_all(others, tmp_path, 1, measured)
    each = [cost_of(s, work_of(s, tmp_path), own_costs(tmp_path), measured) for s in others]
    hours = sum(cost.together for cost in each) / 3600
    assert "study tiny/beta0.2: " in text and "study tiny/beta0.3: " in text
    *_, title, last = text.splitlines()
    assert title == "all 2 diameters"
    assert f"{hours:.2f} core-hours" in last
    assert estimate_all([study], tmp_path, 1, measured) == estimate(
        study, tmp_path / "tiny", 1, measured
    )


@pytest.mark.parametrize("change", [{"dns": {"tolerance": 1e-8}}, {"particle": {"diameter": 1e-5}}])
def test_results_of_other_settings_do_not_count(change, study, tmp_path):
    results_of(study, tmp_path, study.geometries)
    section, values = next(iter(change.items()))
    other = study.model_copy(update={section: getattr(study, section).model_copy(update=values)})
    assert len(work_of(other, tmp_path).flows_left) == 5


def test_results_of_other_physics_do_not_count(study, tmp_path):
    results_of(study, tmp_path, study.geometries)
    path = tmp_path / f"dns/{geometry_name(*study.geometries[0])}.nc"
    dataset = xr.load_dataset(path).assign_attrs(code_digest="0123")
    dataset.to_netcdf(path)
    assert study.geometries[0] in work_of(study, tmp_path).flows_left


def test_broken_files_do_not_count(study, tmp_path):
    results_of(study, tmp_path, study.geometries[:1])
    path = tmp_path / f"dns/{geometry_name(*study.geometries[0])}.nc"
    path.write_bytes(path.read_bytes()[:100])
    assert len(work_of(study, tmp_path).flows_left) == 5


def test_points_are_counted_and_not_files(study, tmp_path, measured):
    results_of(study, tmp_path, study.geometries[:1])
    path = tmp_path / f"dns/{geometry_name(*study.geometries[0])}.nc"
    failed = xr.load_dataset(path)
    failed["status"][1] = 1
    failed.to_netcdf(path)
    text = estimate(study, tmp_path, 2, measured)
    assert "solved           1 points of 1 geometries; 1 without a solution; 0 trains" in text


def test_points_that_are_not_accurate_are_solved(study, tmp_path):
    results_of(study, tmp_path, study.geometries[:1])
    path = tmp_path / f"dns/{geometry_name(*study.geometries[0])}.nc"
    rough = xr.load_dataset(path)
    rough["status"][1] = INACCURATE
    rough.to_netcdf(path)
    assert work_of(study, tmp_path).solved == 2


def test_finished_start_ups_are_not_counted_again(study, tmp_path):
    method = study.dns.model_copy(update={"method": "transient"})
    study = study.model_copy(update={"dns": method})
    (tmp_path / "transient").mkdir()
    own = stages.transient(study, 1.0)
    attributes = provenance.attributes("test", own, digest("transient"))
    outcome = xr.Dataset({"status": 0, "deborah": 1.0}, attrs=attributes)
    outcome.to_netcdf(tmp_path / "transient/sp1.5_sf1.5_De1.nc")
    assert work_of(study, tmp_path).flows_left[1.5, 1.5] == (0,)


def test_a_finished_transient_study_is_done_and_its_own_times_count(study, tmp_path, measured):
    """It was looked for in `dns/` only."""
    study = study.model_copy(update={"dns": study.dns.model_copy(update={"method": "transient"})})
    (tmp_path / "transient/timing").mkdir(parents=True)
    for geometry, deborahs in simulated(study).items():
        for De in deborahs:
            name = point_name(*geometry, De)
            own = provenance.attributes("test", stages.transient(study, De), digest("transient"))
            outcome = xr.Dataset({"status": 0, "deborah": De}, attrs=own)
            outcome.to_netcdf(tmp_path / f"transient/{name}.nc")
            row = {"sp": geometry[0], "sf": geometry[1], "deborah": De, "cpu_seconds": 9.0}
            pd.DataFrame([row]).to_csv(tmp_path / f"transient/timing/{name}.csv", index=False)
    assert work_of(study, tmp_path).flows_left == {}
    assert "solved           10 points of 5 geometries" in estimate(study, tmp_path, 2, measured)
    found = own_costs(tmp_path, "transient")
    model = CostModel(measured)
    assert flow_seconds(study, (1.5, 1.5), (0, 1), model, found) == pytest.approx(18.0)
    unknown = flow_seconds(study, (1.5, 1.5), (1,), model, found[:0])
    assert unknown == pytest.approx(TRANSIENT * model.seconds(1, 3, study.dns.velocity_order, 2))


# ----------------------------------------------------------------------------------- cost of a flow


def test_measured_times_are_returned_as_they_are(measured):
    model = CostModel(measured)
    assert model.seconds(0.0, 3, 4, 2) == pytest.approx(1.0)
    assert model.seconds(1.0, 3, 4, 2) == pytest.approx(3.0)  # the mean
    assert model.seconds(8.0, 3, 4, 2) == pytest.approx(12.0)
    assert model.seconds(1.0, 3, 3, 2) == pytest.approx(1.0)
    assert model.seconds(8.0, 1, 4, 2) == pytest.approx(12.0 / 5)


def test_between_measured_deborah_numbers_times_are_interpolated(measured):
    model = CostModel(measured)
    between = 0.5 * (math.sqrt(3 * 17) - 1)  # half way in log(1 + De/De_0)
    assert model.seconds(between, 3, 4, 2) == pytest.approx(6.0)
    assert model.seconds(100.0, 3, 4, 2) == model.seconds(8.0, 3, 4, 2)


def test_other_orders_and_fluids_are_scaled_by_their_unknowns(measured):
    model = CostModel(measured)
    ratio = unknowns_per_element(4, 3) / unknowns_per_element(4, 2)
    assert model.seconds(1.0, 3, 4, 3) == pytest.approx(3.0 * ratio**GROWTH)
    ratio = unknowns_per_element(2, 2) / unknowns_per_element(3, 2)
    assert model.seconds(1.0, 3, 2, 2) == pytest.approx(ratio**GROWTH)  # the nearest one is 3
    assert model.seconds(0.0, 3, 2, 7) == model.seconds(0.0, 3, 4, 2)  # Newtonian, in high order


def test_a_pair_takes_the_nearest_number_of_spheres(measured):
    triplets = measured[measured.sp < math.inf]
    assert CostModel(triplets).seconds(8.0, 2, 4, 2) == pytest.approx(12.0 * 2 / 3)


def test_points_that_were_not_solved_are_left_out(measured):
    failed = measured.assign(solved=False, cpu_seconds=1e6)
    both = pd.concat([measured, failed])
    assert CostModel(both).seconds(1, 3, 4, 2) == CostModel(measured).seconds(1, 3, 4, 2)


def test_unknowns_per_element_are_those_of_a_large_mesh():
    study = harness.study("config", dns={"wall_size": 0.03, "axis_size": 0.03})
    own = stages.flow(study)
    flow = make_flow(own, triplet(own, math.inf, math.inf))
    expected = unknowns_per_element(4, 2)
    assert flow.space.ndof / flow.mesh.ne == pytest.approx(expected, rel=0.05)


def test_own_times_of_a_study_go_before_measured_ones(study, tmp_path, measured):
    own = own_costs(results_of(study, tmp_path, [(1.5, 1.5)]))
    model = CostModel(measured)
    assert flow_seconds(study, (1.5, 1.5), (0, 1), model, own) == pytest.approx(7.5)
    assert flow_seconds(study, (1.5, math.inf), (0, 1), model, own) == pytest.approx(5.0)
    only_newtonian = own[own.deborah == 0]
    expected = 0.5 + model.seconds(1, 3, study.dns.velocity_order, 2)
    found = flow_seconds(study, (1.5, 1.5), (0, 1), model, only_newtonian)
    assert found == pytest.approx(expected)


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


def test_a_feed_costs_as_if_spheres_were_as_fast_as_they_can_be(study):
    """U_p is not known before the table: 2 Ubar at most, so half the volume fraction at least."""
    poured, own = (
        train_seconds(study, *given) for given in ((0.02, study.trains, True), (0.01, study.trains))
    )
    assert poured == pytest.approx(own)


def test_more_repeats_and_spheres_cost_more(study):
    repeated = study.trains.model_copy(update={"repeats": 2 * study.trains.repeats})
    once = train_seconds(study, 0.01, study.trains)
    # three repeats, six; one of them twice again, for its model error
    assert train_seconds(study, 0.01, repeated) == pytest.approx((6 + 2) / (3 + 2) * once)
    assert train_seconds(study, 0.02, study.trains) > once


def test_design_map_and_movies_cost(study, tmp_path, measured):
    def rest(**sections):
        changed = study.model_copy(update=sections)
        work = work_of(changed, tmp_path)
        return cost_of(changed, work, own_costs(tmp_path), measured).together

    without_map = study.design_map.model_copy(update={"deborah": ()})
    without_movies = study.movies.model_copy(update={"deborah": ()})
    assert rest(design_map=without_map) < rest()
    assert rest(movies=without_movies) < rest()
    longer = study.movies.model_copy(update={"frames": 10 * study.movies.frames})
    assert rest(movies=longer) > rest()


def test_jobs_core_hours_and_memory_are_told_by_stage(tmp_path, measured):
    """206 jobs of one geometry each, or of half an hour of work; the flow that is drawn is one.

    So are all single spheres of other diameters.
    """
    paper = harness.study("paper")
    work = work_of(paper, tmp_path)
    costs = {
        minutes: cost_of(paper, work, own_costs(tmp_path), measured, minutes)
        for minutes in (0.1, 30.0)
    }
    alone, together = (costs[minutes].stages[0] for minutes in costs)
    assert (alone.name, alone.jobs, together.jobs) == ("dns", 126, len(jobs(paper, 30.0)) + 2)
    assert alone.seconds == pytest.approx(together.seconds)
    assert together.longest > 20 * alone.longest
    assert costs[0.1].jobs - costs[30.0].jobs == alone.jobs - together.jobs
    # No CPU but that of the starts is saved, and with many cores the longest job decides.
    saved = START_UP * (alone.jobs - together.jobs)
    assert costs[0.1].together - costs[30.0].together == pytest.approx(saved)
    assert costs[0.1].wall(1000) < costs[30.0].wall(1000)
    text = estimate(paper, tmp_path, 100, measured, 30.0)
    assert f"    dns                {together.jobs} jobs, " in text
    assert f", {resources.megabytes(62) / 1e3:.1f} GB each\n" in text
    assert f"core-hours in {costs[30.0].jobs} jobs, " in text
    assert " on 100 cores" in text


# --------------------------------------------------------------------------- what is not a default


def line_of(text: str, name: str) -> str:
    return next(line for line in text.splitlines() if line.strip().startswith(name))


def test_the_verification_costs_what_it_was_measured_to():
    """Of the demo 313 s, on two cores: sums of the rules, and all of it."""
    took = {"transient": 62, "start_up": 59, "closure_train": 62, "closure_gap": 19, "report": 8}
    took["convergence"] = 109
    found: dict[str, float] = {}
    for job in on_request.of_verification(harness.study("config")):
        found[job.stage] = found.get(job.stage, 0.0) + job.seconds
    assert found.keys() == took.keys()
    for stage, seconds in took.items():
        assert seconds / 1.5 < found[stage] < 1.5 * seconds
    paper = sum(job.seconds for job in on_request.of_verification(harness.study("paper")))
    whole = 1290 * 0.89 / 0.93  # on a busy machine, before flows took 0.89/0.93 of the time
    assert whole / 2 < paper < whole  # that of the full study


def test_a_target_costs_its_table_and_itself(study, tmp_path, measured):
    _, work, own = counted(study, tmp_path)
    before = cost_of_table(study, work, own, measured)
    for name in ("verification", "design"):
        jobs = list(on_request.REQUESTS[name](study))
        cost = cost_of_request(name, study, tmp_path, before)
        assert cost.jobs == before.jobs + len(jobs)
        added = sum(START_UP + job.seconds for job in jobs)
        assert cost.together == pytest.approx(before.together + added)
        text = line_of(estimate(study, tmp_path, 2, measured), f"-- {name}")
        assert f"{cost.together / 3600:.2f} core-hours in {cost.jobs} jobs" in text


def test_what_is_there_of_a_target_is_not_counted_again(study, tmp_path, measured):
    results_of(study, tmp_path, work_of(study, tmp_path).flows, [(1.0, 0.01)])
    _, work, own = counted(study, tmp_path)
    before = cost_of_table(study, work, own, measured)
    assert before.jobs == 0
    for name, file in (
        ("verification", "verification/accuracy.md"),
        ("design", "design/design.txt"),
    ):
        everything = cost_of_request(name, study, tmp_path, before)
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).touch()
        assert cost_of_request(name, study, tmp_path, before).jobs == everything.jobs - 1
        again = cost_of_request(name, study, tmp_path, everything)
        assert again.jobs == 2 * everything.jobs  # a new table repeats all


def test_a_design_costs_by_its_spacings_repeats_and_rate():
    def seconds(repeats, *spacing, **sections):
        design = {"spacing": list(spacing), "repeats": repeats}
        jobs = on_request.of_design(harness.study("config", design=design, **sections))
        return sum(job.seconds for job in jobs if job.stage == "design_trains")

    one, other = seconds(4, 3.0), seconds(4, 4.0)
    assert seconds(4, 3.0, 4.0) == pytest.approx(one + other)
    assert other < one
    assert seconds(16, 3.0) == pytest.approx((16 + 8) / (4 + 2) * one)
    # The demo's 0.4 % at De = 5 are 82 spheres/s, 6.7 d apart; at De = 1 they would be closer.
    assert one < seconds(4, 3.0, encapsulation={"bead_rate": 82.0}) < 3 * one
    assert seconds(4, 3.0, encapsulation={"bead_rate": 1e6}) == one  # below contact: not tried


def test_diameters_are_counted_as_the_stage_varies_them():
    assert resources.VARIATIONS == diameter_variation.VARIATIONS
    seconds = resources.variation_seconds(harness.study("config"))
    assert 3.2 / 2 < seconds < 2 * 3.2  # as measured in the demo
    even = harness.study("config", trains={"injection": "even"})
    assert resources.variation_seconds(even) == pytest.approx(seconds / 2)
    varying = harness.study("config", particle={"diameter_variation": 0.03})
    assert resources.variation_seconds(varying) == pytest.approx(6 / 5 * seconds)


def test_a_fluid_that_is_not_fitted_yet_costs_its_fit_and_its_draws(tmp_path, measured):
    """It was refused."""
    fluid = {"data": ["data.csv"], "fit": {"draws": 200}}
    study = parse_study(harness.written("tiny") | {"fluid": fluid})
    text = estimate(study, tmp_path, 2, measured)
    assert "fluid_fit" in text and "fit_spread" in text and "the fluid is not fitted yet" in text
    known, work, own = counted(study, tmp_path)
    assert known is study and work.draws == 200
    cost = cost_of(study, work, own, measured)
    assert cost.of("fit_spread") == pytest.approx(resources.DRAW * 200 * len(study.deborah.values))
    # Once it is fitted, it is that of the fit, and only the draws are left to make.
    (tmp_path / "fluid_fit").mkdir()
    written = harness.written("tiny")["fluid"]
    (tmp_path / "fluid_fit/fluid.yaml").write_text(yaml.safe_dump({"fluid": written}))
    known, work, _ = counted(study, tmp_path)
    assert len(known.fluid.modes) == len(written["modes"]) and work.draws == 200
    text = estimate(study, tmp_path, 2, measured)
    assert "fluid_fit" not in text and "fit_spread" in text


# ------------------------------------------------------------------------------------- command line


@pytest.mark.slow
def test_command_line_with_the_shipped_measurements(tmp_path):
    options = ["--configfile", harness.CONFIG / "tiny.yaml", "--cores", "1"]
    words = harness.output(harness.run_script("estimate_cost.py", *options, folder=tmp_path))
    assert "study tiny: 5 geometries, 10 points (De x geometry), 1 trains" in words
    assert "core-hours" in words
    # A fluid that is still to be fitted: it was refused.
    options = ["--configfile", harness.CONFIG / "design.yaml"]
    words = harness.output(harness.run_script("estimate_cost.py", *options, folder=tmp_path))
    assert "-- design" in words and "the fluid is not fitted yet" in words
