"""Bad input through the real `snakemake`: one message, no traceback, nothing written."""

import re
from pathlib import Path

import harness
import hypothesis
import pytest
import yaml
from harness import SMALL, Project, output
from hypothesis import HealthCheck, example, given
from mutations import applied, as_yaml, mutated

RUNS = 100 if hypothesis.settings().max_examples >= 10_000 else 10


def files(project: Project) -> set[Path]:
    """All files, but those in which Snakemake and Python remember what they have read."""
    return {
        path
        for path in project.folder.rglob("*")
        if ".snakemake" not in path.parts and "__pycache__" not in path.parts
    }


@given(mutated())
@hypothesis.settings(
    max_examples=RUNS,
    derandomize=RUNS == 10,
    suppress_health_check=list(HealthCheck),
    deadline=None,
    phases=[hypothesis.Phase.explicit, hypothesis.Phase.generate],
)
@example(("tiny.yaml", (("set", ("study",), "$(touch x)"),)))
@example(("tiny.yaml", (("set", ("trains", "repeats"), 10**400),)))
def test_a_mutated_config_is_planned_or_refused_in_words(project, case):
    config = project.folder / "config" / "mutated.yaml"
    config.write_text(as_yaml(applied(*case)), encoding="utf-8")
    before = files(project)
    done = project.snakemake("--dry-run", "--configfile", "config/mutated.yaml")
    text = done.stdout + done.stderr
    assert "Traceback" not in text
    assert files(project) == before
    refused = re.search(r"mutated\.yaml: \d+ problems?\n", text)
    assert (done.returncode == 0) == (refused is None), text


def test_a_target_after_configfile_is_named(project):
    """Snakemake takes it for a config: it says so, or we do, and nothing is made."""
    before = files(project)
    done = project.snakemake("--cores", "1", "--configfile", "config/tiny.yaml", "verification")
    assert done.returncode != 0
    assert "No such file or directory: 'verification'" in done.stdout + done.stderr
    assert files(project) == before
    resolved = project.folder / "results" / "tiny" / "config.yaml"
    resolved.parent.mkdir(parents=True)
    resolved.write_text(yaml.safe_dump(harness.written("config")), encoding="utf-8")
    target = "results/tiny/config.yaml"
    done = project.snakemake("--dry-run", "--configfile", "config/tiny.yaml", target)
    assert done.returncode != 0
    assert "targets after `--`" in done.stdout + done.stderr
    done = project.snakemake("--dry-run", "--configfile", "config/tiny.yaml", "--", target)
    output(done)


def test_names_of_files_reach_no_shell(project):
    """A config and data whose names are commands: fitted as any other."""
    data = project.folder / "$(touch run);touch run é.csv"
    data.write_text(
        (project.folder / "config" / "synthetic_rheology.csv").read_text("utf-8"), "utf-8"
    )
    config = project.folder / "`touch run`; touch run &.yaml"
    fluid = {"data": [data.name], "fit": {"modes": 2}}
    config.write_text(yaml.safe_dump(SMALL | {"study": "named", "fluid": fluid}), "utf-8")
    target = "results/named/fluid_fit/fluid.yaml"
    output(project.snakemake("--cores", "1", "--configfile", config.name, "--", target))
    assert (project.folder / target).exists()
    assert not list(project.folder.glob("run*"))


@pytest.mark.parametrize("closure", [[3], [0, 3]])
def test_verification_is_checked_when_it_is_asked_for(project, closure):
    verification = SMALL["verification"] | {"closure": {"deborah": closure}}
    config = project.configured(SMALL | {"verification": verification})
    project.plan("--configfile", config)
    done = project.snakemake("--dry-run", "--configfile", config, "--", "verification")
    text = done.stdout + done.stderr
    assert done.returncode != 0
    assert "verification.closure.deborah[0]: found" in text
    assert "allowed: one of deborah.values (1.0)" in text
