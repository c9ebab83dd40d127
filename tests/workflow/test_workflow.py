"""The workflow: what runs when, what a wrong config does, and what a point that fails leaves.

Everything goes through the command line of Snakemake or of the scripts, in a copy of the project's
files; results go to the working directory. One small study is really finished, because the decision
to repeat a job rests on records that only a finished job leaves.
"""

import math
import re
import shutil

import pandas as pd
import pytest
import xarray as xr
import yaml
from harness import CONFIG, JOB_COUNT, SMALL, Project, output, written

from viscotrain.config.geometries import pair_distances
from viscotrain.config.reading import load_study
from viscotrain.words import NOT_ATTEMPTED, NOT_CONVERGED

TINY = written()
SIMULATED = {("1.5", "1.5"), ("1.5", "inf"), ("inf", "inf")}  # (inf, 1.5) is (1.5, inf)
AFTER_DNS = {
    "table": 1,
    "trains": 1,
    "film": 1,
    "movies": 1,
    "design_points": 1,
    "design_map": 1,
    "order": 1,
    "operating_conditions": 1,
    "diameter_variation": 1,
    "encapsulation": 1,
    "velocity_figures": 1,
    "train_figures": 1,
    "interactive": 1,
    "summary": 1,
    "all": 1,
}


# ------------------------------------------------------------------------------------------ plans


COMPUTED = sorted(
    {path.name for path in CONFIG.glob("*.yaml")}
    - {"study_trains.yaml", "confinement.yaml", "square.yaml", "design.yaml"}
)


def test_trains_of_the_study_need_no_simulation(planned):
    jobs, geometries = planned("--configfile", "config/study_trains.yaml")
    assert not geometries
    assert jobs["trains"] == 6
    assert {"given_table", "trains", "order", "velocity_figures", "summary"} <= set(jobs)
    assert not {"dns", "field", "table", "film", "design_points"} & set(jobs)


def test_a_square_channel_needs_no_simulation_either(planned):
    jobs, geometries = planned("--configfile", "config/square.yaml")
    assert not geometries
    expected = {"given_table": 1, "channel_flow": 1, "operating_conditions": 1, "trains": 2}
    assert expected.items() <= jobs.items()


def test_a_design_is_made_on_request_only(planned):
    asked = ("--configfile", "config/design.yaml")
    assert not {"design", "design_trains"} & set(planned(*asked)[0])
    jobs, _ = planned(*asked, "--", "design")
    expected = {"fluid_fit": 1, "table": 1, "channel_flow": 1, "design_trains": 3, "design": 1}
    assert expected.items() <= jobs.items()
    assert not {"summary", "interactive", "design_map", "movies"} & set(jobs)


@pytest.mark.parametrize("config", COMPUTED)
def test_every_shipped_config_has_a_plan(config, planned):
    study = load_study(CONFIG / config)
    number_of_trains = len(study.train_deborahs) * len(study.trains.fractions)
    finite, spacing = len(study.table.sp) - 1, study.table.line_spacing
    between = finite - len(range(0, finite - 1, spacing)) if spacing > 1 else 0
    triplets = finite**2 - between**2
    jobs, geometries = planned("--configfile", f"config/{config}")
    assert jobs == AFTER_DNS | {
        "dns": triplets + len(pair_distances(study)) + 1 + study.table.check,
        "trains": number_of_trains,
        "film": number_of_trains,
        "movies": number_of_trains,
        "train_figures": number_of_trains,
        "design_points": len({De for De, _ in study.map_conditions()}),
        "study_figures": 1,
        "study_config": 1,
        "units": 1,
        "channel_flow": 1,
        "field": 1,
        "other_diameter": 1,
    }
    assert len(geometries) == jobs["dns"]
    assert {("inf", "inf"), (str(study.table.sp[0]), "inf")} <= geometries
    assert ("inf", str(study.table.sp[0])) not in geometries


def fitted(project, name="data/rheology.csv") -> str:
    """The small study with measured data, beside its config, in place of its fluid."""
    (project.folder / "data").mkdir()
    shutil.copy2(CONFIG / "synthetic_rheology.csv", project.folder / "data/rheology.csv")
    return project.configured(SMALL | {"study": "fitted", "fluid": {"data": [name]}})


def test_the_fit_of_the_fluid_is_upstream_of_everything(project, planned):
    config = fitted(project)
    written, _ = planned("--configfile", "config/tiny.yaml")
    jobs, geometries = project.plan("--configfile", config)
    assert jobs["fluid_fit"] == jobs["study_figures"] == written["study_figures"] == 1
    assert "fluid_fit" not in written
    assert set(jobs) == set(written) | {"fluid_fit", "fit_spread"}
    assert jobs["fit_spread"] == 1
    assert geometries == SIMULATED
    names = ("dns/spinf_sfinf.nc", "dns/field.nc", "transient/sp1.5_sf1.5_De1.nc")
    targets = [f"results/fitted/{name}" for name in (*names, "figures/rheology.png")]
    done = project.snakemake("--dry-run", *targets, "--configfile", config)
    assert done.returncode == 0, done.stdout + done.stderr
    awaited = re.findall(r"updated by another job: (.*)$", done.stdout + done.stderr, re.M)
    fluid, fit = (f"results/fitted/fluid_fit/{name}" for name in ("fluid.yaml", "fit.nc"))
    assert sorted(sorted(names.split(", ")) for names in awaited) == [[fit, fluid], *[[fluid]] * 3]


@pytest.mark.parametrize(("draws", "jobs_of_spread"), [(0, None), (3, 1)])
def test_draws_of_the_fit_may_be_left_out(draws, jobs_of_spread, project):
    config = fitted(project)
    project.edit(config, "fluid:\n", f"fluid:\n  fit: {{draws: {draws}}}\n")
    jobs, _ = project.plan("--configfile", config)
    assert jobs.get("fit_spread") == jobs_of_spread
    third = "results/fitted/fit_spread/draw_03.yaml"
    done = project.snakemake("--dry-run", third, "--configfile", config)
    assert (done.returncode == 0) == (draws == 3), done.stdout + done.stderr


def test_a_fitted_fluid_reaches_its_figure(project):
    """Fit and figure as jobs; both again when a measured number changes."""
    config = fitted(project)
    project.edit(config, "fluid:\n", "fluid:\n  fit: {modes: 2}\n")
    done = project.snakemake(
        "results/fitted/figures/rheology.png", "--cores", "1", "--configfile", config
    )
    assert done.returncode == 0, done.stdout + done.stderr
    folder = project.folder / "results" / "fitted"
    fluid = yaml.safe_load((folder / "fluid_fit" / "fluid.yaml").read_text(encoding="utf-8"))
    assert [mode["viscosity"] for mode in fluid["fluid"]["modes"]] == pytest.approx(
        [0.257, 0.254], rel=0.05
    )
    curves = (folder / "figures" / "rheology.csv").read_text(encoding="utf-8")
    assert curves.count("viscosity,Pa s,measured,shear_rate") == 51
    assert project.plan("results/fitted/figures/rheology.png", "--configfile", config)[0] == {}

    project.edit("data/rheology.csv", "0.1,0.0002097", "0.1,0.0002098")
    jobs, _ = project.plan("results/fitted/figures/rheology.png", "--configfile", config)
    assert jobs == {"fluid_fit": 1, "study_figures": 1}


def test_missing_data_stop_before_any_job(project):
    config = fitted(project, "data/nowhere.csv")
    done = project.snakemake("--dry-run", "--configfile", config)
    text = done.stdout + done.stderr
    assert done.returncode != 0
    assert "study.yaml: 1 problem\n  fluid.data[0]: there is no file data/nowhere.csv" in text
    assert "Traceback" not in text


def test_bad_data_end_the_fit_with_file_and_line(project):
    config = fitted(project)
    project.edit("data/rheology.csv", "0.1,0.0002097", "0.1,-0.0002097")
    done = project.snakemake(
        "results/fitted/fluid_fit/fluid.yaml", "--cores", "1", "--configfile", config
    )
    assert done.returncode != 0
    message = (
        "error: measured data: 1 problem\n  data/rheology.csv, line 5: storage_modulus: found "
    )
    log = (project.folder / "results/fitted/logs/fluid_fit.log").read_text(encoding="utf-8")
    assert log.startswith(message + "-0.0002097; allowed: above 0")
    assert message in done.stdout + done.stderr


def test_scripts_say_that_the_fluid_is_not_fitted_yet(project):
    config = fitted(project)
    done = project.run(
        "scripts/dns.py", "--configfile", config, "--sp", "inf", "--sf", "inf", "x.nc"
    )
    assert done.returncode == 1
    assert "fluid.data: not fitted yet; fit it before: snakemake" in done.stderr
    assert "-- results/fitted/fluid_fit/fluid.yaml" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_paper_draws_the_conditions_of_the_experiments(planned):
    names = [f"spacing_De{De}_phi{phi}" for De in (31, 62) for phi in (0.006, 0.01)]
    targets = [f"results/paper/figures/{name}.png" for name in names]
    jobs, _ = planned(*targets, "--configfile", "config/paper.yaml")
    assert (jobs["train_figures"], jobs["trains"]) == (4, 4)


def test_without_movies_and_map_there_are_none(project):
    less = SMALL | {"movies": {"deborah": []}, "design_map": {"deborah": []}}
    jobs, _ = project.plan("--configfile", project.configured(less))
    assert not {"film", "movies", "design_points", "design_map"} & set(jobs)


def test_without_a_config_file_the_demo_is_planned(planned):
    assert planned() == planned("--configfile", "config/config.yaml")


def test_fields_of_every_point_do_not_change_the_plan(project):
    saving = SMALL | {"dns": SMALL["dns"] | {"save_fields": True}}
    assert project.plan("--configfile", project.configured(saving))[1] == SIMULATED


@pytest.mark.slow
def test_the_transient_method_has_one_job_per_geometry_and_deborah_number(project):
    """All points of grid, pair and check; De = 0 too, which ends at its start."""
    study = TINY | {"dns": TINY["dns"] | {"method": "transient"}}
    jobs, _ = project.plan("--configfile", project.configured(study))
    assert jobs["transient"] + jobs["transient_single_sphere"] == (2 * 2 - 1 + 1 + 1) * 2
    assert "dns" not in jobs


def test_verification_is_planned_on_request_only(planned):
    tiny = "config/tiny.yaml"
    jobs, _ = planned("--configfile", tiny)
    assert not {"start_up", "convergence", "closure_train", "closure_gap"} & set(jobs)
    jobs, _ = planned("--configfile", tiny, "--", "verification")
    expected = {"transient": 1, "start_up": 1, "closure_train": 1, "closure_gap": 2}
    expected |= {"convergence": 4, "verification_report": 1}
    assert expected.items() <= jobs.items()
    assert "trains" not in jobs


def test_time_steps_do_not_repeat_the_quasi_steady_simulations(finished):
    study = SMALL | {"dns": SMALL["dns"] | {"transient": {"duration": 3}}}
    jobs, _ = finished.plan("--configfile", finished.configured(study))
    assert "dns" not in jobs


def test_a_finished_study_has_nothing_to_do(finished):
    assert finished.plan("--configfile", "study.yaml") == ({}, set())


@pytest.mark.slow
def test_the_summary_names_movies_and_design_map(finished):
    words = (finished.folder / "results" / "small" / "summary.txt").read_text(encoding="utf-8")
    assert "movies          4 in results/small/movies/De1_phi0.01/" in words
    assert "design map      results/small/design_map/design_map.nc" in words
    movies = sorted((finished.folder / "results/small/movies/De1_phi0.01").glob("*.mp4"))
    assert [path.stem for path in movies] == [
        "moving_frame",
        "station_0",
        "station_10",
        "station_20",
    ]


@pytest.mark.slow
def test_summary_and_page_by_hand_are_those_of_the_jobs(finished):
    results = finished.folder / "results" / "small"
    table, train = results / "table/velocity_table.nc", results / "trains/De1_phi0.01.nc"
    line = ["scripts/summary.py", "again.txt", "--table", table, "--trains", train]
    line += ["--units", results / "units.nc"]
    line += ["--movies", "results/small/movies/De1_phi0.01", "--timing"]
    output(finished.run(*line, *(results / "dns" / "timing").iterdir()))
    written = (results / "summary.txt").read_text(encoding="utf-8").splitlines()
    again = (finished.folder / "again.txt").read_text(encoding="utf-8").splitlines()
    shown = [text.replace(f"{finished.folder}/", "") for text in again]
    assert len(shown) > 8
    assert set(shown) <= set(written)
    page = "scripts/interactive.py", "--configfile", "study.yaml"
    page += "--order", results / "order/order.nc", "--flow", results / "channel_flow.nc"
    output(finished.run(*page, table, results / "units.nc", "again.html", train))
    assert (finished.folder / "again.html").read_bytes() == (
        results / "interactive.html"
    ).read_bytes()


@pytest.mark.slow
def test_another_frame_rate_repeats_no_simulation(finished):
    faster = SMALL | {"movies": SMALL["movies"] | {"frame_rate": 30}}
    jobs, _ = finished.plan("--configfile", finished.configured(faster))
    assert jobs == {"movies": 1, "study_config": 1, "summary": 1, "all": 1}


@pytest.mark.slow
def test_the_terminal_tells_what_was_solved_and_the_single_sphere_is_first(finished_study):
    text = (finished_study / "terminal.txt").read_text(encoding="utf-8")
    assert re.findall(r"^(sp\S+): solved", text, re.MULTILINE)[0] == "spinf_sfinf"
    for name in ("spinf_sfinf", "sp1.5_sfinf", "sp1.5_sf1.5"):
        assert f"\n{name}: solved 1 of 1 De, up to 1\n" in text


@pytest.mark.slow
def test_a_distance_more_runs_only_the_new_geometries_and_what_follows(finished):
    larger = SMALL | {"table": SMALL["table"] | {"sp": [1.5, 2.5, float("inf")]}}
    jobs, geometries = finished.plan("--configfile", finished.configured(larger))
    assert geometries == {("2.5", "1.5"), ("2.5", "inf")}
    assert jobs == AFTER_DNS | {"dns": 2, "study_config": 1, "study_figures": 1}


def given(file="results/small/table/velocity_table.nc", **sections):
    """A study like `SMALL` that takes its table from a file."""
    own = {"study": "given", "table": {"file": file}, "figures": {}}
    return SMALL | own | sections


def test_a_finished_table_takes_the_place_of_all_simulations(finished):
    jobs, geometries = finished.plan("--configfile", finished.configured(given()))
    assert not geometries
    assert jobs["given_table"] == 1
    assert not {"dns", "field", "table"} & set(jobs)


@pytest.mark.slow
def test_trains_by_a_finished_table_are_those_of_the_study_that_made_it(finished):
    train = "results/given/trains/De1_phi0.01.nc"
    name = finished.configured(given())
    output(finished.snakemake(train, "--cores", "1", "--configfile", name))
    here, there = (
        xr.load_dataset(finished.folder / path) for path in (train, train.replace("given", "small"))
    )
    assert here.equals(there)


def test_a_finished_table_of_another_confinement_is_refused_before_any_job(finished):
    thicker = given(particle={"diameter": 1.1 * SMALL["particle"]["diameter"]})
    done = finished.snakemake("--dry-run", "--configfile", finished.configured(thicker))
    assert done.returncode != 0
    words = "table.file: results/small/table/velocity_table.nc: confinement: found "
    assert words in done.stdout + done.stderr


def test_a_finished_table_that_does_not_exist_stops_before_any_job(project):
    done = project.snakemake("--dry-run", "--configfile", project.configured(given("no.nc")))
    assert done.returncode != 0
    assert "table.file: there is no file no.nc" in done.stdout + done.stderr


@pytest.mark.slow
def test_other_trains_simulate_no_flow(finished):
    more = SMALL | {"trains": SMALL["trains"] | {"volume_fraction": [0.005, 0.01]}}
    jobs, _ = finished.plan("--configfile", finished.configured(more))
    assert jobs == {
        "trains": 1,
        "encapsulation": 1,
        "film": 1,
        "movies": 1,
        "order": 1,
        "diameter_variation": 1,
        "study_config": 1,
        "study_figures": 1,
        "train_figures": 1,
        "operating_conditions": 1,
        "interactive": 1,
        "summary": 1,
        "all": 1,
    }


@pytest.mark.slow
def test_a_square_channel_takes_the_flows_of_the_tube_and_says_so(finished):
    """The same triplets; trains, flow rate and pressure are the square's, and all say so."""
    before = xr.load_dataset(finished.folder / "results/small/trains/De1_phi0.01.nc")
    square = {"shape": "square", "side": SMALL["channel"]["diameter"], "length": 20}
    config = finished.configured(SMALL | {"channel": square})
    jobs, _ = finished.plan("--configfile", config)
    assert not {"dns", "field", "table"} & set(jobs)
    assert {"trains", "design_points", "film", "order", "channel_flow"} <= set(jobs)
    done = finished.snakemake("--cores", "2", "--configfile", config)
    assert done.returncode == 0, done.stdout + done.stderr
    results = finished.folder / "results" / "small"
    said = "square duct: interactions are those of the inscribed tube"
    for name in ("order/order", "design_map/design_map", "trains/De1_phi0.01", "channel_flow"):
        assert xr.load_dataset(results / f"{name}.nc").attrs["channel"] == said, name
    for name in ("summary.txt", "interactive.html"):
        assert said in (results / name).read_text(encoding="utf-8"), name
    train = xr.load_dataset(results / "trains/De1_phi0.01.nc")
    flow = xr.load_dataset(results / "channel_flow.nc").sel(deborah=1)
    law = float(train["mean_spacing_law"] / before["mean_spacing_law"])
    assert law == pytest.approx(math.pi / 4)
    faster = float(train["isolated_velocity"] - before["isolated_velocity"])
    drift = float(flow["centreline_velocity"] - before["centreline_velocity"])
    assert faster == pytest.approx(drift, abs=1e-12) and 0.05 < drift < 0.15
    rows = pd.read_csv(results / "operating_conditions.csv")
    assert len(rows) == 2  # that of the trains is one of the map
    Q = 1 * 100e-6 / 0.0752 * 100e-6**2 * 60e9
    assert rows["flow_rate_uL_min-1"].to_numpy() == pytest.approx(Q)


@pytest.mark.slow
def test_trains_of_the_feed_are_named_by_it(finished):
    """A study that says what is poured in runs to its end, from the same table."""
    trains = {key: value for key, value in SMALL["trains"].items() if key != "volume_fraction"}
    poured = SMALL | {
        "trains": trains | {"feed_volume_fraction": [0.018], "injection": "poisson"},
        "design_map": SMALL["design_map"] | {"volume_fraction": None},
    }
    poured["design_map"] = poured["design_map"] | {"feed_volume_fraction": [0.018, 0.02]}
    config = finished.configured(poured)
    jobs, _ = finished.plan("--configfile", config)
    assert "dns" not in jobs and "table" not in jobs
    done = finished.snakemake("--cores", "2", "--configfile", config)
    assert done.returncode == 0, done.stdout + done.stderr
    results = finished.folder / "results" / "small"
    for name in ("trains/De1_phi_feed0.018.nc", "movies/De1_phi_feed0.018.nc"):
        train = xr.load_dataset(results / name)
        assert float(train["feed_volume_fraction"]) == 0.018
        assert train.attrs["injection"] == "poisson"
    assert (results / "figures/stations_De1_phi_feed0.018.png").exists()
    assert "1.8 % in the feed, poisson injection" in (results / "summary.txt").read_text("utf-8")
    made = xr.load_dataset(results / "design_map/design_map.nc")
    assert made["feed_volume_fraction"].values.tolist() == [0.018, 0.02]


@pytest.mark.slow
def test_measured_spacings_reach_figure_and_summary_and_repeat_no_train(finished):
    (finished.folder / "seen.csv").write_text("station,spacing\n20,2.5\n20,3.1\n", "utf-8")
    seen = SMALL | {"trains": SMALL["trains"] | {"measured": "seen.csv"}}
    config = finished.configured(seen)
    jobs, _ = finished.plan("--configfile", config)
    again = {"measured": 1, "train_figures": 1, "study_config": 1, "summary": 1, "all": 1}
    assert jobs == again
    done = finished.snakemake("--cores", "2", "--configfile", config)
    assert done.returncode == 0, done.stdout + done.stderr
    results = finished.folder / "results" / "small"
    assert "at z = 20 D: 2 measured spacings" in (results / "summary.txt").read_text("utf-8")
    assert float(xr.load_dataset(results / "measured/De1_phi0.01.nc")["ks_distance"][-1]) > 0

    finished.edit("seen.csv", "20,3.1", "7,3.1")
    done = finished.snakemake("--dry-run", "--configfile", config)
    assert done.returncode != 0
    assert "seen.csv, line 3: station: found 7; allowed: " in done.stdout + done.stderr


@pytest.mark.slow
def test_droplets_are_counted_again_alone(finished):
    asked = SMALL | {"encapsulation": {"droplet_frequency": 30.0}}
    config = finished.configured(asked)
    jobs, _ = finished.plan("--configfile", config)
    assert jobs == {"encapsulation": 1, "study_config": 1, "summary": 1, "all": 1}
    done = finished.snakemake("--cores", "2", "--configfile", config)
    assert done.returncode == 0, done.stdout + done.stderr
    results = finished.folder / "results" / "small"
    words = (results / "summary.txt").read_text(encoding="utf-8")
    assert "at 30 droplets/s: none, one, two or more in " in words
    assert "30 beads/s at De = 1, " in words
    assert (results / "encapsulation" / "feeds.csv").exists()


@pytest.mark.slow
def test_a_tolerance_simulates_every_flow_again(finished):
    stricter = SMALL | {"dns": SMALL["dns"] | {"tolerance": 1e-8}}
    jobs, _ = finished.plan("--configfile", finished.configured(stricter))
    assert (jobs["dns"], jobs["field"]) == (3, 1)


@pytest.mark.slow
def test_comments_and_docstrings_of_the_physics_repeat_nothing(finished):
    path = "scripts/viscotrain/flow/giesekus.py"
    finished.edit(path, '"""', '"""Other words. ')
    finished.edit(path, "\nfrom ", "\n# A comment.\nfrom ")
    assert finished.plan("--configfile", "study.yaml") == ({}, set())


@pytest.mark.slow
def test_code_of_the_physics_repeats_every_simulation(finished):
    finished.edit("scripts/viscotrain/flow/weak_forms.py", "\ndef ", "\nUNUSED = 1\n\n\ndef ")
    jobs, _ = finished.plan("--configfile", "study.yaml")
    assert jobs == AFTER_DNS | {"dns": 3, "other_diameter": 1, "field": 1}


PHYSICAL = {"units": 1, "study_config": 1, "design_map": 1, "movies": 1, "order": 1}
PHYSICAL |= {"interactive": 1, "train_figures": 1, "encapsulation": 1}
PHYSICAL |= {"operating_conditions": 1}
PHYSICAL |= {"summary": 1, "all": 1}


@pytest.mark.slow
def test_a_larger_device_computes_nothing_again(finished):
    """D, d and Ubar scaled together: only what shows physical units is made again.

    d/D differs in its last bit.
    """
    larger = SMALL | {
        "channel": SMALL["channel"] | {"diameter": 1.1 * SMALL["channel"]["diameter"]},
        "particle": {"diameter": 1.1 * SMALL["particle"]["diameter"]},
    }
    jobs, _ = finished.plan("--configfile", finished.configured(larger))
    assert jobs == PHYSICAL


@pytest.mark.slow
def test_slower_fluids_and_thicker_ones_compute_nothing_again(finished):
    """All relaxation times by one factor, all viscosities by another."""
    modes = [
        mode
        | {"viscosity": 3.3 * mode["viscosity"], "relaxation_time": mode["relaxation_time"] / 7}
        for mode in SMALL["fluid"]["modes"]
    ]
    fluid = {"solvent_viscosity": 3.3 * SMALL["fluid"]["solvent_viscosity"], "modes": modes}
    jobs, _ = finished.plan("--configfile", finished.configured(SMALL | {"fluid": fluid}))
    assert jobs == PHYSICAL | {"study_figures": 1}


@pytest.mark.slow
def test_other_trains_leave_the_stored_config_current(finished):
    """It was that of the table, which other trains do not repeat."""
    more = SMALL | {"trains": SMALL["trains"] | {"repeats": 4}}
    stored = "results/small/config.yaml"
    config = finished.configured(more)
    done = finished.snakemake("--cores", "1", "--configfile", config, "--", stored)
    assert done.returncode == 0, done.stdout + done.stderr
    assert load_study(finished.folder / stored).trains.repeats == 4


@pytest.mark.slow
def test_saving_fields_is_no_physics(finished):
    """Where the fields are there, nothing is repeated, and nothing when they are given up."""
    for name in ("sp1.5_sf1.5", "sp1.5_sfinf", "spinf_sfinf"):
        folder = finished.folder / "results" / "small" / "dns" / name
        folder.mkdir()
        shutil.copystat(folder.with_name(f"{name}.nc"), folder)
    saving = SMALL | {"dns": SMALL["dns"] | {"save_fields": True}}
    jobs, _ = finished.plan("--configfile", finished.configured(saving))
    assert jobs == {"study_config": 1, "all": 1}
    assert finished.plan("--configfile", finished.configured(SMALL)) == ({}, set())


@pytest.mark.slow
def test_the_definition_of_deborah_numbers_repeats_the_closure_too(project):
    """Settings of flow and closure both had a key `deborah`, of which one was lost."""
    config = project.configured(TINY)
    gap = "results/tiny/verification/closure/gap1.csv"
    path = project.folder / gap
    done = project.snakemake("--cores", "1", "--configfile", config, "--", gap)
    assert done.returncode == 0, done.stdout + done.stderr
    assert path.exists()
    assert project.plan("--configfile", config, "--", gap)[0] == {}
    other = TINY | {"deborah": TINY["deborah"] | {"definition": "mean_relaxation_time"}}
    jobs, _ = project.plan("--configfile", project.configured(other), "--", gap)
    assert jobs == {"closure_gap": 1}


# ------------------------------------------------------------------------------ profile and config


@pytest.mark.parametrize(
    ("options", "attempts"), [((), 2), (("--workflow-profile", "none"), 1)], ids=["default", "none"]
)
def test_the_default_profile_keeps_going_after_a_failed_geometry(options, attempts, project):
    stub = "from pathlib import Path\nPath(f'attempt {snakemake.rule}').touch()\nexit(1)\n"
    (project.folder / "scripts" / "dns.py").write_text(stub, encoding="utf-8")
    targets = [f"results/small/dns/{name}.nc" for name in ("sp1.5_sf1.5", "spinf_sfinf")]
    config = project.configured(SMALL | {"dns": SMALL["dns"] | {"geometries_per_job": 1}})
    done = project.snakemake("--cores", "1", *targets, "--configfile", config, *options)
    assert done.returncode != 0
    assert len(list(project.folder.glob("attempt *"))) == attempts


def test_a_wrong_config_stops_before_any_job_with_one_message(project):
    wrong = SMALL | {"particle": {"diameter": 1.0}, "dns": {"tolerence": 1e-7}}
    done = project.snakemake("--cores", "1", "--configfile", project.configured(wrong))
    text = done.stdout + done.stderr
    assert done.returncode != 0
    assert text.count("problems") == 1
    assert re.search(r"study\.yaml: 2 problems\n +particle\.diameter: .*\n +dns\.tolerence: ", text)
    assert "Job stats" not in text
    assert "Traceback" not in text
    assert not (project.folder / "results").exists()


def test_no_key_of_the_demo_leaks_into_another_config(project):
    incomplete = {key: value for key, value in SMALL.items() if key != "fluid"}
    done = project.snakemake("--dry-run", "--configfile", project.configured(incomplete))
    assert done.returncode != 0
    assert "fluid: missing" in done.stdout + done.stderr


# ------------------------------------------------------------------------- scripts of the dns stage


def simulated(project: Project, study: dict, output: str, sp="inf", sf="inf"):
    """One geometry through the command line of the script."""
    config = project.configured(study)
    return project.run("scripts/dns.py", "--configfile", config, "--sp", sp, "--sf", sf, output)


def test_a_point_that_does_not_converge_is_a_result_and_a_hole(project):
    hopeless = SMALL | {
        "deborah": {"values": [1, 2], "definition": "longest_mode"},
        "dns": SMALL["dns"] | {"max_iterations": 1, "geometries_per_job": 1},
    }
    single = "results/small/dns/spinf_sfinf.nc"
    config = project.configured(hopeless)
    done = project.snakemake("--cores", "1", "--configfile", config, "--", single)
    told = done.stdout + done.stderr
    assert done.returncode == 0, told
    assert "\nspinf_sfinf: solved 0 of 2 De; not resolved at De = 1" in told
    # Each of the three geometries with a sphere that is not there, at both De.
    assert told.count("\nwarning: the table has 6 holes by now; allowed: 0 (table.max_holes)") == 1
    log = project.folder / "results" / "small" / "logs" / "dns" / "spinf_sfinf.log"
    assert "NOT SOLVED" in log.read_text(encoding="utf-8")
    result = xr.load_dataset(project.folder / single)
    assert result["status"].values.tolist() == [NOT_CONVERGED, NOT_ATTEMPTED]
    assert result["velocity"].isnull().all()
    assert "no convergence" in result["reason"].values[0]
    assert "smaller De" in result["reason"].values[1]

    table = ("scripts/table.py", "--configfile", "study.yaml", "table.nc", single)
    done = project.run(*table)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert "8 of 8 points have no solution; allowed: 0 (table.max_holes)" in done.stderr
    assert "De 1, sp inf, sf inf: not resolved at De = 1, on " in done.stderr
    assert not (project.folder / "table.nc").exists()


DIES = """
def main(job: Job, sp: SP, sf: SF, result: Result, timing: Timing = None, fields: Fields = None):
    if sp == sf == 1.5 and not Path("healed").exists():
        os.kill(os.getpid(), signal.SIGKILL)
    solve(job, sp, sf, result, timing, fields)


run(main,"""


@pytest.mark.slow
def test_a_geometry_that_dies_loses_nothing_of_the_others_of_its_job(project):
    """The next run solves it alone, and a distance more the new ones alone."""
    project.edit("scripts/dns.py", "def main(", "def solve(")
    project.edit("scripts/dns.py", "\nrun(main,", DIES)
    project.edit("scripts/dns.py", "from pathlib", "import os\nimport signal\nfrom pathlib")
    table = "results/small/table/velocity_table.nc"

    def made(study) -> tuple[int, str]:
        line = ("--cores", "1", "--configfile", project.configured(study), "--", table)
        done = project.snakemake(*line)
        return done.returncode, done.stdout + done.stderr

    failed, told = made(SMALL)
    assert failed
    assert "\nsp1.5_sf1.5: ended by SIGKILL, for want of memory perhaps" in told
    assert "\nsp1.5_sfinf: solved 1 of 1 De" in told
    folder = project.folder / "results/small/dns"
    assert {path.name for path in folder.glob("sp*") if "_d" not in path.name} == {
        "spinf_sfinf.nc.kept",
        "sp1.5_sfinf.nc.kept",
    }
    (project.folder / "healed").touch()
    failed, told = made(SMALL)
    assert not failed
    assert re.findall(r"^(sp\S+): solved", told, re.MULTILINE) == ["sp1.5_sf1.5"]
    assert not list(folder.glob("**/*.kept"))
    triplets = [path for path in folder.glob("*.nc") if "_d" not in path.name]
    before = {path.name: path.read_bytes() for path in triplets}
    assert len(before) == 3

    larger = SMALL | {"table": SMALL["table"] | {"sp": [1.5, 2.5, float("inf")]}}
    failed, told = made(larger)
    assert not failed
    assert set(re.findall(r"^(sp\S+): solved", told, re.MULTILINE)) == {
        "sp2.5_sf1.5",
        "sp2.5_sfinf",
    }
    assert before.items() <= {path.name: path.read_bytes() for path in folder.glob("*.nc")}.items()
    assert project.plan("--configfile", "study.yaml", "--", table) == ({}, set())
    for name in ("dns/sp1.5_sf1.5.nc", "table/velocity_table.nc"):
        (folder.parent / name).unlink()
    _, told = made(larger)
    assert re.findall(r"^(sp\S+): solved", told, re.MULTILINE) == ["sp1.5_sf1.5"]


@pytest.mark.slow
def test_the_same_geometry_gives_the_same_bytes(finished):
    """Once as a job of the workflow, once from the command line."""
    again = simulated(finished, SMALL, "again.nc", sp="1.5", sf="1.5")
    assert again.returncode == 0, again.stderr
    job = finished.folder / "results" / "small" / "dns" / "sp1.5_sf1.5.nc"
    assert (finished.folder / "again.nc").read_bytes() == job.read_bytes()


# ----------------------------------------------------------------------------- several diameters

SWEPT = SMALL | {"study": "swept", "particle": {"diameter": [20e-6, 30e-6]}}
OF_ONE = {"beta0_2_", "beta0_3_"}


def counted(project, study, *target) -> dict[str, int]:
    """Jobs of each rule in the plan for a study."""
    config = project.configured(study)
    done = project.snakemake("--dry-run", "--configfile", config, "--", *target)
    counts = {rule: int(count) for rule, count in JOB_COUNT.findall(output(done))}
    del counts["total"]
    return counts


def test_every_diameter_has_the_jobs_of_a_study_of_its_own(project):
    alone, swept = counted(project, SMALL), counted(project, SWEPT)
    del alone["all"]
    for prefix in OF_ONE:
        assert {
            n.removeprefix(prefix): k for n, k in swept.items() if n.startswith(prefix)
        } == alone
    own = {name for name in swept if not name.startswith(tuple(OF_ONE))}
    assert own == {"confinement", "study_config", "all"}


def test_all_of_one_diameter_makes_nothing_of_another(project):
    jobs = counted(project, SWEPT | {"movies": {"deborah": []}}, "beta0_3_all")
    assert all(name.startswith("beta0_3_") for name in jobs)
    assert jobs["beta0_3_interactive"] == 1
    assert "beta0_3_film" not in jobs


@pytest.mark.parametrize(
    ("target", "own"),
    [("order", {"order"}), ("verification", {"verification"}), ("units", {"units"})],
)
def test_what_is_asked_for_by_name_is_made_of_every_diameter(target, own, project):
    jobs = counted(project, SWEPT, target)
    name = "verification_report" if target == "verification" else target
    assert all(jobs[prefix + name] == 1 for prefix in OF_ONE)
    assert {rule for rule in jobs if not rule.startswith(tuple(OF_ONE))} == own


def test_a_list_of_diameters_that_is_wrong_stops_before_any_job(project):
    wrong = SWEPT | {"particle": {"diameter": [30e-6, 20e-6]}, "dns": {"tolerence": 1e-7}}
    done = project.snakemake("--cores", "1", "--configfile", project.configured(wrong))
    text = done.stdout + done.stderr
    assert done.returncode != 0
    assert re.search(r"2 problems\n +particle\.diameter\[1\]: .*\n +dns\.tolerence: ", text)
    assert "Job stats" not in text


def test_a_fluid_that_is_fitted_is_fitted_for_every_diameter(project):
    fitted(project)
    study = SWEPT | {"fluid": {"data": ["data/rheology.csv"]}}
    jobs = counted(project, study)
    assert all(jobs[f"{prefix}fluid_fit"] == 1 for prefix in OF_ONE)


@pytest.mark.slow
def test_two_diameters_are_compared_and_are_what_each_is_alone(project):
    made = ["results/swept/summary.txt", "results/swept/beta0.3/config.yaml"]
    config = project.configured(SWEPT)
    done = project.snakemake("--cores", "2", "--configfile", config, "--", *made)
    folder = project.folder / "results/swept"
    summary = (folder / "summary.txt").read_text(encoding="utf-8")
    assert summary in output(done)
    assert "2 diameters of study swept" in summary
    drawn = ("confinement", "confinement_length", "confinement_order", "confinement_design_map")
    for name in drawn:
        assert (folder / f"figures/{name}.png").stat().st_size > 0
    page = (folder / "interactive.html").read_text(encoding="utf-8")
    assert 'href="beta0.3/interactive.html"' in page
    again = project.snakemake("--dry-run", "--configfile", config, "--", *made)
    assert "Nothing to be done" in output(again) + again.stderr

    # its record is a study of its own, which has nothing to compute again
    record = yaml.safe_load((folder / "beta0.3/config.yaml").read_text(encoding="utf-8"))
    own = "results/swept/beta0.3/order/order.nc"
    alone = project.snakemake("--dry-run", "--configfile", project.configured(record), "--", own)
    assert "Nothing to be done" in output(alone) + alone.stderr
    single = SWEPT | {"particle": {"diameter": 30e-6}}
    by_hand = simulated(project, single, "alone.nc", sp="1.5", sf="inf")
    assert by_hand.returncode == 0, by_hand.stderr
    files = folder / "beta0.3/dns/sp1.5_sfinf.nc", project.folder / "alone.nc"
    assert xr.load_dataset(files[0]).equals(xr.load_dataset(files[1]))
