"""What the workflow reads: absurd studies are refused with a range or an estimate, files are files.

Nothing is begun, nothing written, and no string of a config is more than a string.
"""

import copy
import math
import os
from pathlib import Path

import harness
import pandas as pd
import pytest
import yaml

from viscotrain.config.reading import check_verification, load_study, parse_study, read_yaml
from viscotrain.errors import ConfigError
from viscotrain.jobs import expense, intake, on_request, resources
from viscotrain.jobs.costs import MEASURED, cost_of, own_costs, work_of
from viscotrain.jobs.resources import MARGIN

INF = math.inf


def demo(**changes) -> dict:
    """The demo with values at dotted keys (`__` for the dot) replaced or added."""
    data = harness.written("config")
    for key, value in changes.items():
        *parents, last = key.split("__")
        place = data
        for part in parents:
            place = place.setdefault(part, {})
        place[last] = value
    return data


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Read a config as the workflow does, from a file in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def reading(data: dict, name: str = "study.yaml") -> intake.Intake:
        Path(name).write_text(yaml.safe_dump(data), encoding="utf-8")
        return intake.read(copy.deepcopy(data), [name])

    return reading


def problems_of(read, data: dict) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        read(data)
    return list(caught.value.problems)


# ----------------------------------------------------------------------------- absurd, but valid

ABSURD = {
    "distances": (
        {"table__sp": [1.1, 1e5, INF]},
        "table.sp[1]: found 100000.0; allowed: number in",
    ),
    "frame rate": ({"movies__frame_rate": 1e9}, "movies.frame_rate: found 1000000000.0; allowed"),
    "length": ({"channel__length": 1e9}, "channel.length: found 1000000000.0; allowed: number in"),
    "repeats": ({"trains__repeats": 10**9}, "trains.repeats: found 1000000000; allowed: whole"),
    "passages": ({"trains__passages": 10**12}, "trains.passages: found 1000000000000; allowed"),
    "gap": ({"table__sp": [1 + 1e-12, 2, INF]}, "table.sp[0]: found 1.000000000001; allowed"),
    "distances that are one": (
        {"table__sp": [1.5, 1.5 + 1e-9, INF]},
        "table.sp[1]: found 1.500000001; allowed: at least 1.0001 times the value before it, 1.5",
    ),
    "a sphere of dust": (
        {"particle__diameter": 1e-7},
        "particle.diameter: found 1.0e-07; allowed: at least a hundredth of channel.diameter",
    ),
    "pixels": ({"movies__width": 10**6}, "movies.width: found 1000000; allowed"),
    "list": (
        {"trains__stations": [n / 10 for n in range(2000)]},
        "trains.stations: found a list of 2000; allowed: at most 1000 of the list of numbers",
    ),
    "modes": (
        {"fluid__modes": [{"viscosity": 1, "relaxation_time": 1, "mobility": 0.1}] * 50},
        "fluid.modes: found a list of 50; allowed: at most 10 of the list of",
    ),
}


@pytest.mark.parametrize(("changes", "message"), ABSURD.values(), ids=ABSURD)
def test_an_absurd_value_is_refused_with_a_range(changes, message, read):
    problems = problems_of(read, demo(**changes))
    assert any(problem.startswith(message) for problem in problems), problems


LONG = {
    "repeats": ({"trains__repeats": 100_000, "trains__passages": 100_000}, "trains", "core_hours"),
    "passages": ({"trains__passages": 10_000_000, "trains__repeats": 1000}, "trains", "gigabytes"),
    "long channels": (
        {"channel__length": 100_000, "design_map__deborah": [], "trains__repeats": 1000},
        "trains",
        "core_hours",
    ),
    "map": (
        {"design_map__repeats": 100_000, "design_map__passages": 4000},
        "design_map",
        "core_hours",
    ),
    "frames": (
        {"movies__frames": 10**6, "trains__stations": [float(n) for n in range(800)]},
        "movies",
        "core_hours",
    ),
    "fields": (
        {
            "dns__save_fields": True,
            "table__sp": [1.1 + n / 10 for n in range(120)] + [INF],
            "table__sf": [1.1 + n / 10 for n in range(120)] + [INF],
        },
        "table",
        "gigabytes",
    ),
}


@pytest.mark.parametrize(("changes", "section", "limit"), LONG.values(), ids=LONG)
def test_what_takes_weeks_or_terabytes_is_asked_for(changes, section, limit, read):
    """The message names the limit, what is needed, and which section needs it."""
    data = demo(**changes)
    study = parse_study(data)
    problems = {line.partition(":")[0]: line for line in problems_of(read, data)}
    line = problems[f"budget.{limit}"]
    need = {"core_hours": expense.core_seconds, "gigabytes": expense.bytes_written}[limit](study)
    assert max(need, key=need.get) == section
    assert f"{section} {need[section] / (3600 if limit == 'core_hours' else 1e9):.2g}" in line
    allowed = float(line.partition("allowed: ")[2].partition(" or more")[0])
    raised = {"core_hours": 1e7, "gigabytes": 1e6, limit: 1.1 * allowed}
    assert read(data | {"budget": raised}).studies[0].budget.core_hours


def test_the_same_bytes_and_hours_of_shipped_studies_need_no_budget(read):
    for name in ("config", "paper", "tiny"):
        assert "budget" not in harness.written(name)
        read(harness.written(name))


@pytest.mark.parametrize("name", ["config", "paper"])
def test_what_a_study_takes_at_most_is_above_its_estimate_but_not_far(name, tmp_path):
    """Against the estimate that goes through all geometries one by one."""
    study = harness.study(name)
    most = sum(expense.core_seconds(study).values())
    work, own = work_of(study, tmp_path), own_costs(tmp_path)
    cost = cost_of(study, work, own, pd.read_csv(MEASURED))
    counted = sum(map(cost.of, ("dns", "trains", "design_map", "movies")))
    assert counted < most < MARGIN * counted
    assert len(work.flows) <= expense.geometries(study) < 2 * len(work.flows)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("design", {"design": {"spacing": [2.0], "repeats": 10**6}}),
        (
            "verification",
            {"verification__closure": {"duration": 10_000, "distances": [1.5] * 20}},
        ),
    ],
)
def test_what_is_asked_for_by_name_is_counted_once_it_is_asked_for(name, changes, read):
    data = demo(**changes, budget={"core_hours": 1.0})
    studies = read(data).studies  # a run without targets takes less
    with pytest.raises(ConfigError) as caught:
        intake.check_request(name, studies, "config")
    (line,) = caught.value.problems
    assert line.startswith("budget.core_hours: found 1; allowed: ")
    hours = sum(job.seconds for job in on_request.REQUESTS[name](studies[0])) / 3600
    assert float(line.partition(f"{name} ")[2].partition(")")[0]) > hours
    enough = read(data | {"budget": {"core_hours": 1e6}}).studies
    intake.check_request(name, enough, "config")


def test_the_most_counts_other_diameters_and_draws():
    """Four single spheres, trains whose diameters vary, and fluids that are drawn from a fit."""
    study, given = harness.study("config"), harness.study("study_trains")
    shares = expense.core_seconds(study)
    flow = shares["table"] / (expense.geometries(study) + 4)
    assert flow == pytest.approx(expense._flow_seconds(study))
    assert expense.core_seconds(given)["table"] == 0
    one = resources.train_seconds(study, 0.004, study.trains)
    assert shares["trains"] == pytest.approx(one + resources.variation_seconds(study))
    fitted, undrawn = (
        parse_study(demo(fluid={"data": ["a.csv"], "fit": {"draws": draws}})) for draws in (200, 0)
    )
    more = expense.core_seconds(fitted)["table"] - expense.core_seconds(undrawn)["table"]
    assert more == pytest.approx(200 * 3 * resources.DRAW)


def test_a_transient_study_takes_more():
    slow = harness.study("config", dns={"method": "transient"})
    share = [expense.core_seconds(each)["table"] for each in (harness.study("config"), slow)]
    assert share[1] > 5 * share[0]


# ------------------------------------------------------------------------------ a finished table


def by_the_finished_table(**changes) -> dict:
    table = str(harness.ROOT / harness.FINISHED_TABLE)
    return harness.written("study_trains") | {"table": {"file": table}} | changes


def test_a_finished_table_is_checked_with_the_config(read):
    """It passed a dry run and failed as a job."""
    read(by_the_finished_table())
    other = by_the_finished_table(
        particle={"diameter": 21.0e-6},
        deborah={"values": [0, 5, 30, 31, 62]},
    )
    lines = problems_of(read, other)
    assert [line.partition(".nc: ")[2] for line in lines] == [
        "confinement: found 0.2; allowed: 0.21, as in the config",
        "deborah: found 30 in the config; allowed: one of the table's 0, 1, 2, 5, 10, 31, 62",
    ]
    assert all(line.startswith("table.file: ") for line in lines)
    fluid = harness.written("study_trains")["fluid"] | {"solvent_viscosity": 0.06}
    (*_, line) = problems_of(read, by_the_finished_table(fluid=fluid))
    assert "table.file: " in line and "dimensionless_fluid" in line
    # A fluid that is fitted first is compared by the job; so are files in jobs of a run.
    data = {"data": [str(harness.CONFIG / "synthetic_rheology.csv")]}
    read(by_the_finished_table(fluid=data))
    (line,) = problems_of(read, by_the_finished_table(fluid=data, particle={"diameter": 21.0e-6}))
    assert "confinement" in line


def test_a_file_that_is_no_table_is_refused_with_the_config(read):
    Path("other.nc").write_text("not a table")
    (line,) = problems_of(read, by_the_finished_table(table={"file": "other.nc"}))
    assert line.startswith("table.file: other.nc")
    assert intake.read(by_the_finished_table(table={"file": "other.nc"}), ["study.yaml"], False)


# ------------------------------------------------------------------- sections that make nothing


def test_an_unused_section_refuses_no_change_elsewhere(read):
    """Of the demo: other Deborah numbers, a shorter channel, a Newtonian fluid."""
    read(demo(deborah__values=[0, 2], trains__deborah=[2]))
    read(demo(channel__length=500))
    newtonian = demo(fluid__modes=[], deborah__values=[0], trains__deborah=[0])
    (study,) = read(newtonian).studies
    with pytest.raises(ConfigError, match=r"verification\.transient: found 6; allowed: none"):
        check_verification(study)
    off = demo(
        movies={"deborah": [], "volume_fraction": [0.5], "field_of_view": 1e4},
        design_map={"deborah": [], "volume_fraction": [0.9]},
    )
    read(off)
    for section in ("movies", "design_map"):
        on = copy.deepcopy(off)
        del on[section]["deborah"]
        assert all(section in line for line in problems_of(read, on))


def test_defaults_mean_all_and_to_the_outlet():
    study = parse_study(demo(channel__length=300, deborah__values=[0, 2, 5]))
    assert study.stations == (0, 75, 150, 225, 300)
    assert study.closure_deborahs == (0, 2, 5)
    del (data := demo(deborah__values=[0, 2, 7]))["trains"]["deborah"]
    assert parse_study(data).train_deborahs == (2, 7)


def test_the_closure_is_checked_once_it_is_asked_for():
    study = parse_study(demo(verification__closure={"deborah": [0, 3]}))
    with pytest.raises(ConfigError) as caught:
        check_verification(study)
    (line,) = caught.value.problems
    assert line == (
        "verification.closure.deborah[1]: found 3.0; allowed: one of deborah.values (0.0, 1.0, 5.0)"
    )
    check_verification(load_study(harness.CONFIG / "config.yaml"))


# ------------------------------------------------------------------------------------- strings

NAMES = (
    "../../etc",
    "a;b",
    "$(touch x)",
    "`touch x`",
    "x" * 300,
    "é",
    "研究",
    "a b",
    "",
    ".",
    "-rf",
)


@pytest.mark.parametrize(
    "name", [*NAMES, "demo\n", "a/b", "a\\b", "{x}", "\x00", "a\x1b[2J", "..."]
)
def test_a_study_has_a_name_that_is_safe_everywhere(name, read):
    """It is part of paths, commands and pages."""
    (problem,) = problems_of(read, demo(study=name))
    assert problem.startswith("study: found the text ")
    assert problem.isprintable()
    assert len(problem) < 200


def test_names_of_files_are_only_looked_up(read, tmp_path):
    data = demo()
    del data["fluid"]["modes"]
    for name in ("$(touch x)", "a;touch x", "`touch x`", "x" * 300, "nowhere/é", "/dev/zero", "."):
        (problem,) = problems_of(read, data | {"fluid": {"data": [name]}})
        assert problem.startswith("fluid.data[0]: there is no file ")
        (problem,) = problems_of(read, demo(table={"file": name}))
        assert problem.startswith("table.file: there is no file ")
    for name in ("{sp}.csv", "", "a\x00b", "a\nb", "x" * 2000):
        (problem,) = problems_of(read, data | {"fluid": {"data": [name]}})
        assert problem.startswith("fluid.data[0]: found the text ")
        assert problem.isprintable()
    assert os.listdir(tmp_path) == ["study.yaml"]


def test_a_key_with_control_characters_is_shown_without(read):
    (problem,) = problems_of(read, demo() | {"\x1b[2J" * 100: 1})
    assert problem.isprintable()
    assert len(problem) < 250


def test_a_target_among_configs_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("results/demo").mkdir(parents=True)
    Path("results/demo/config.yaml").touch()
    data = harness.written("config")
    with pytest.raises(ConfigError, match=r"targets after `--`"):
        intake.read(data, [harness.CONFIG / "config.yaml", "results/demo/config.yaml"])


# ---------------------------------------------------------------------------------------- files


def test_a_huge_config_is_not_read(tmp_path):
    path = tmp_path / "huge.yaml"
    path.write_bytes(b"# " + b"x" * 10**6)
    with pytest.raises(ConfigError, match="found 1000 kB; allowed: at most 100 kB"):
        read_yaml(path)


def test_aliases_that_multiply_are_looked_at_once(tmp_path):
    """A thousand million items in ten lines, if each is followed."""
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 10)]
    path = tmp_path / "laughs.yaml"
    path.write_text("\n".join(lines), encoding="utf-8")
    data, repeated = read_yaml(path)
    assert repeated == []
    with pytest.raises(ConfigError) as caught:
        parse_study(data)
    assert len(str(caught.value)) < 4000


def test_a_message_ends(read):
    data = demo(table__sp=["a"] * 900)
    with pytest.raises(ConfigError) as caught:
        read(data)
    lines = str(caught.value).splitlines()
    assert len(lines) == 42
    assert lines[-1] == f"  ... and {len(caught.value.problems) - 40} more"
