"""Project files that repeat each other stay in step."""

import re
import tomllib

import lowest_versions
import pytest
import yaml
from harness import FINISHED_TABLE, PARTS, ROOT
from snakemake.cli import get_argument_parser

import viscotrain

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_conda_environment_has_the_dependencies_of_the_package():
    environment = yaml.safe_load((ROOT / "envs/viscotrain.yaml").read_text(encoding="utf-8"))
    python, pip, packages = environment["dependencies"]
    assert python == f"python{PROJECT['requires-python']}"
    assert pip == "pip"
    assert packages["pip"] == PROJECT["dependencies"]


def test_the_version_is_the_same_everywhere():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == viscotrain.__version__
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest = next(line for line in changelog.splitlines() if line.startswith("## "))
    assert newest == f"## {viscotrain.__version__}"


@pytest.mark.parametrize("name", viscotrain.__all__)
def test_public_names_are_there_and_say_what_they_do(name):
    assert len(getattr(viscotrain, name).__doc__.partition("\n")[0]) > 10


def test_the_container_has_what_the_workflow_needs():
    """Its parts are there, among them all that a copy of the project needs to run."""
    text = (ROOT / "Containerfile").read_text(encoding="utf-8")
    copied = [
        name for line in re.findall(r"^COPY (.*) \S+$", text, re.MULTILINE) for name in line.split()
    ]
    assert [name for name in copied if not (ROOT / name).exists()] == []
    assert {*PARTS, "Snakefile", str(FINISHED_TABLE)} <= set(copied)
    named = [ROOT / name for name in re.findall(r'"/opt/viscotrain/([^"]+)"', text)]
    assert len(named) == 2 and all(path.is_file() for path in named)
    assert "libquadmath0" in text  # without it no flow is solved in a slim image
    versions = re.findall(r"^FROM python:3\.(\d+)-slim", text, re.MULTILINE)
    (oldest,) = re.findall(r">=3\.(\d+)", PROJECT["requires-python"])
    assert len(versions) == 2
    assert all(int(version) >= int(oldest) for version in versions)
    assert (
        set(re.findall(r"\[(\w+)\]\"", text)) == {"slurm"} <= set(PROJECT["optional-dependencies"])
    )


def test_profiles_say_only_what_snakemake_knows():
    """A key that it does not know is passed over in silence."""
    known = get_argument_parser()._option_string_actions
    for path in ROOT.glob("profiles/*/profile.yaml"):
        keys = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert [key for key in keys if f"--{key}" not in known] == []


def test_lowest_versions_are_those_of_all_requirements():
    project = {
        "dependencies": ["a>=1.2", "b-c[extra]>=3"],
        "optional-dependencies": {"test": ["d==4.5.post1"]},
    }
    assert list(lowest_versions.constraints(project)) == ["a==1.2", "b-c==3", "d==4.5.post1"]
    project["dependencies"].append("e")
    with pytest.raises(ValueError, match=r"found 'e'; allowed: name>=version"):
        list(lowest_versions.constraints(project))
