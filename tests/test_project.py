"""Project files that repeat each other stay in step."""

import tomllib

import pytest
import yaml
from harness import ROOT

import viscotrain


def test_conda_environment_has_the_dependencies_of_the_package():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    environment = yaml.safe_load((ROOT / "envs/viscotrain.yaml").read_text(encoding="utf-8"))
    python, pip, packages = environment["dependencies"]
    assert python == f"python{project['requires-python']}"
    assert pip == "pip"
    assert packages["pip"] == project["dependencies"]


def test_the_version_is_the_same_everywhere():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == viscotrain.__version__
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest = next(line for line in changelog.splitlines() if line.startswith("## "))
    assert newest == f"## {viscotrain.__version__}"


@pytest.mark.parametrize("name", viscotrain.__all__)
def test_public_names_are_there_and_say_what_they_do(name):
    assert len(getattr(viscotrain, name).__doc__.partition("\n")[0]) > 10
