"""What the workflow reads before it plans: the study, the files that it names, what it may take."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from viscotrain.config import stages
from viscotrain.config.reading import (
    check_verification,
    data_files,
    measured_file,
    read_yaml,
    table_file,
)
from viscotrain.config.study import Study
from viscotrain.config.sweep import parse_studies
from viscotrain.config.wording import shown
from viscotrain.errors import ConfigError, ViscotrainError
from viscotrain.jobs.expense import over_budget

LONGEST_JOB = 10_000  # minutes
RESULTS = "results"  # folder of all runs


class Intake(NamedTuple):
    """What can be planned: one study, or one for each diameter, which share files."""

    studies: tuple[Study, ...]
    measured: list[str]  # paths of the data of its fluid
    table: str | None  # path of its finished table
    spacings: str | None  # path of its measured spacings


def read(config: Any, files: Sequence[str | Path], first: bool = True) -> Intake:
    """Check a config as Snakemake has read it, and all that a run of it needs.

    Args:
        config: The mapping of keys to values, of all files together.
        files: Config files, the last of which others are relative to.
        first: Whether a finished table is opened, for which once is enough: not in every job.

    Raises:
        ConfigError: One message lists every problem.
    """
    source = ", ".join(map(str, files))
    _no_targets(source, files)
    repeated = [line for file in files for line in read_yaml(file)[1]]
    studies = parse_studies(config, source=source, known_problems=repeated)
    problems: list[str] = []

    def found(look: Callable[[Study, str | Path], Any]) -> Any:
        try:
            return look(studies[0], files[-1])
        except ConfigError as error:
            problems.extend(error.problems)
            return None

    files_of_study = [found(look) for look in (data_files, table_file, measured_file)]
    if first and files_of_study[1]:
        problems += _of_other_table(studies[0], files_of_study[1])
    problems += over_budget(studies)
    if problems:
        raise ConfigError(source, problems)
    return Intake(studies, *files_of_study)


def _of_other_table(study: Study, path: str) -> list[str]:
    """A line for all in which a finished table is not of this study."""
    from viscotrain.jobs import agreement, datasets  # which take a second to import

    try:
        table = datasets.read(path)
    except ViscotrainError as error:
        return [f"table.file: {error}"]
    lines = agreement.other_case(table, stages.given_table(study))
    return [f"table.file: {path}: {line}" for line in lines]


def check_request(name: str, studies: Sequence[Study], source: str):
    """Check what is asked for by name, once it is: what it takes, and sections that only it needs.

    Args:
        name: One of `on_request.REQUESTS`.
        studies: Of the config.
        source: What the message calls the config.

    Raises:
        ConfigError: One message lists every problem.
    """
    if name == "verification":
        check_verification(studies[0], source)
    if problems := over_budget(studies, name):
        raise ConfigError(source, problems)


def minutes_of_a_job(config: Mapping[str, Any], default: float) -> float:
    """`job_minutes`, which a profile gives beside the config of the study.

    Raises:
        ConfigError: It is no number of minutes.
    """
    given = config.get("job_minutes", default)
    with contextlib.suppress(TypeError, ValueError, OverflowError):
        if 0 < float(given) <= LONGEST_JOB:
            return float(given)
    allowed = f"number in (0, {LONGEST_JOB}], minutes"
    raise ConfigError("config", [f"job_minutes: found {shown(given)}; allowed: {allowed}"])


def _no_targets(source: str, files: Sequence[str | Path]):
    """Refuse a result among several configs: it is a target that `--configfile` has taken."""
    for file in files[1:]:
        if RESULTS in Path(file).parts:
            line = f"found {file} as a config; allowed: targets after `--`, as in `-- {file}`"
            raise ConfigError(source, [line])
