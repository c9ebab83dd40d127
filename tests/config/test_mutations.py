"""Wrong configs by the thousand: each is accepted, or refused in words; at once, nothing written.

    pytest tests/config/test_mutations.py                       # 1,000, the same ones every time
    pytest -n 0 -s tests/config/test_mutations.py --hypothesis-profile thorough   # 10,000, others

What was found once is kept as an example below.
"""

import inspect
import time

import hypothesis
import pytest
import yaml
from hypothesis import HealthCheck, assume, example, given
from mutations import SHIPPED, applied, as_yaml, mutated, shipped, targets

from viscotrain.config import stages
from viscotrain.config.geometries import simulated
from viscotrain.errors import ConfigError
from viscotrain.jobs import intake

EXAMPLES = max(1000, hypothesis.settings().max_examples)
FAST = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
LONGEST = 1.0  # CPU seconds until there is an answer
LONGEST_MESSAGE = 12_000  # characters

STAGES = [
    function
    for _, function in inspect.getmembers(stages, inspect.isfunction)
    if function.__module__ == stages.__name__
    and list(inspect.signature(function).parameters) == ["study"]
    and not function.__name__.startswith("_")
]


@pytest.fixture(scope="module")
def counts():
    """How many were what; printed at the end."""
    found = {"mutated": 0, "accepted": 0, "refused": 0, "slowest": 0.0}
    yield found
    print(f"\n{found}")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where configs lie, with the files that the shipped ones name."""
    path = tmp_path_factory.mktemp("mutated")
    (path / "docs" / "study").mkdir(parents=True)
    (path / "docs" / "study" / "velocity_table.nc").touch()
    (path / "config").mkdir()
    return path


def planned(config, file) -> bool:
    """Check a config as the workflow does, with all that it makes of it; whether it is accepted.

    Args:
        config: What Snakemake has read, which is not our time (`workflow/test_bad_input.py`).
        file: Of the config.
    """
    try:
        studies = intake.read(config, [file]).studies
    except ConfigError as error:
        assert error.problems
        assert all(problem.strip() for problem in error.problems)
        assert len(str(error)) < LONGEST_MESSAGE
        return False
    for study in studies:
        simulated(study)
        for settings in STAGES:
            if settings is not stages.field or study.field_point():
                settings(study).stated()
    return True


@given(mutated())
@example(("config.yaml", (("shuffle", ("fluid", "modes"), "many"),)))  # maxItems of a union
@example(("study_trains.yaml", (("set", ("table", "file"), "x" * 300),)))  # no name of a file
@example(("study_trains.yaml", (("set", ("table", "file"), "\x00"),)))
@example(
    ("config.yaml", (("set", ("trains", "deborah"), None), ("set", ("movies", "deborah"), [7])))
)
@example(("config.yaml", (("set", ("channel", "diameter"), 5e-324),)))
@example(("tiny.yaml", (("set", ("trains", "seed"), 10**400),)))
@example(("tiny.yaml", (("misspell", ("study",), "control"),)))
@example(("paper.yaml", (("list", ("table", "sp"), "texts"),)))  # each item a problem of its own
@example(
    (
        "confinement.yaml",  # the problems of all studies of a sweep
        (
            ("shuffle", ("design_map", "volume_fraction"), "many"),
            ("scale", ("design_map", "volume_fraction"), 1.1),
        ),
    )
)
@hypothesis.settings(
    max_examples=EXAMPLES,
    derandomize=EXAMPLES == 1000,
    suppress_health_check=list(HealthCheck),
    deadline=None,
)
def test_a_mutated_config_is_refused_in_words_or_planned(folder, counts, case):
    data = applied(*case)
    assume(repr(data) != repr(shipped(case[0])))
    file = folder / "config" / "mutated.yaml"
    file.write_text(as_yaml(data), encoding="utf-8")
    before = sorted(folder.rglob("*"))
    config = yaml.load(file.read_bytes(), FAST)  # noqa: S506, it is a safe loader
    started = time.process_time()
    accepted = planned(config, file)
    took = time.process_time() - started
    assert took < LONGEST
    assert sorted(folder.rglob("*")) == before
    counts["mutated"] += 1
    counts["accepted" if accepted else "refused"] += 1
    counts["slowest"] = max(counts["slowest"], took)


@pytest.mark.parametrize("name", SHIPPED)
def test_every_key_of_a_shipped_config_is_mutated(name):
    assert len(targets(name)) > 100
    assert applied(name, (("remove", ("study",), None),)) != shipped(name)
    assert applied(name, (("set", ("no", "such", "place"), 1),))["no"] == {"such": {"place": 1}}
