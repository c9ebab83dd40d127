"""Fixtures for all rooms; one thread each, like the jobs of the workflow."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported

import functools
import shutil
from pathlib import Path

import hypothesis
import pytest
from harness import Project, study
from synthetic import dns_result

from viscotrain.fluid.parameters import DimensionlessFluid, Mode
from viscotrain.jobs import datasets
from viscotrain.table.assembly import combine

# Tests judge what is computed; a machine may be busy with other work.
hypothesis.settings.register_profile(
    "busy", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
# By request, `--hypothesis-profile thorough`: for tests that say that they have more to try.
hypothesis.settings.register_profile(
    "thorough", hypothesis.settings.get_profile("busy"), max_examples=10_000
)
hypothesis.settings.load_profile("busy")


def pytest_collection_modifyitems(items):
    """What runs Snakemake is slow, and begun first: one process does it, another the rest."""
    for item in items:
        if {"project", "planned", "finished_study"} & set(item.fixturenames):
            item.add_marker(pytest.mark.slow)
    items.sort(key=lambda item: item.path.parent.name != "workflow")


@pytest.fixture
def hyaluronic_acid() -> DimensionlessFluid:
    """The two-mode fluid of the study: 1 wt% in PBS."""
    return DimensionlessFluid.from_physical(
        0.051, [Mode(0.257, 0.0752, 0.283), Mode(0.254, 0.00848, 0.49)]
    )


@pytest.fixture(scope="session")
def tiny_table(tmp_path_factory) -> Path:
    """The table of the tiny study as a file, with known functions in place of simulations."""
    axis = study("tiny").table.sp
    results = [dns_result(sp, sf) for sp in axis for sf in axis]
    path = tmp_path_factory.mktemp("table") / "velocity_table.nc"
    datasets.write(combine(results, sp=axis, sf=axis, deborah=[0, 1], max_holes=0), path)
    return path


@pytest.fixture
def project(tmp_path) -> Project:
    return Project.copy(tmp_path)


@pytest.fixture(scope="session")
def planned(tmp_path_factory):
    """Dry runs of shipped configs, each made once: the plan that Snakemake has for options."""
    project = Project.copy(tmp_path_factory.mktemp("planned"))
    return functools.cache(project.plan)


@pytest.fixture(scope="session")
def finished_study(tmp_path_factory) -> Path:
    """Folder in which the small study has run to its end, with empty figures to save time."""
    project = Project.copy(tmp_path_factory.mktemp("finished"))
    text = project.finish_small(cores=2)
    (project.folder / "terminal.txt").write_text(text, encoding="utf-8")
    return project.folder


@pytest.fixture
def finished(finished_study, tmp_path) -> Project:
    """A copy of the finished study, to be changed; times of files and records come along."""
    return Project(Path(shutil.copytree(finished_study, tmp_path / "copy")))
