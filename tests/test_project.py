"""Project files that repeat each other stay in step."""

import tomllib

import lowest_versions
import pytest
import yaml
from harness import ROOT


def test_conda_environment_has_the_dependencies_of_the_package():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    environment = yaml.safe_load((ROOT / "envs/viscotrain.yaml").read_text(encoding="utf-8"))
    python, pip, packages = environment["dependencies"]
    assert python == f"python{project['requires-python']}"
    assert pip == "pip"
    assert packages["pip"] == project["dependencies"]


def test_lowest_versions_are_those_of_all_requirements():
    project = {
        "dependencies": ["a>=1.2", "b-c[extra]>=3"],
        "optional-dependencies": {"test": ["d==4.5.post1"]},
    }
    assert list(lowest_versions.constraints(project)) == ["a==1.2", "b-c==3", "d==4.5.post1"]
    project["dependencies"].append("e")
    with pytest.raises(ValueError, match=r"found 'e'; allowed: name>=version"):
        list(lowest_versions.constraints(project))
