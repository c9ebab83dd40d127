"""Reading a config: from a YAML file to a study, or one message that lists every problem."""

import os
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from viscotrain.config import stages
from viscotrain.config.models import FluidConfig
from viscotrain.config.problems import (
    Readable,
    disagreements,
    disagreements_of_verification,
)
from viscotrain.config.study import Study
from viscotrain.config.wording import dotted, inlined, order_of_sections, problem_of_key
from viscotrain.errors import ConfigError, DataError
from viscotrain.trains import spacings_file

FAST_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # of libyaml, where there is one
LARGEST_FILE = 100_000  # bytes of a config: a hundred times what a study needs is a mistake


@cache
def schema() -> dict[str, Any]:
    """JSON schema of the config, from the models."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **Study.model_json_schema(),
        "title": "viscotrain study",
        "description": "Config of a viscotrain study.",
    }


def load_study(path: str | Path) -> Study:
    """Read and check a YAML file.

    Raises:
        ConfigError: The file or its content is wrong; one message lists every problem.
    """
    data, repeated = read_yaml(path)
    return parse_study(data, source=str(path), known_problems=repeated)


def parse_study(data: Any, source: str = "config", known_problems: Sequence[str] = ()) -> Study:
    """Check a config that has been read already, as Snakemake does.

    Args:
        data: The mapping of keys to values.
        source: What the error message calls the config.
        known_problems: Lines to put before the problems found here, as `read_yaml` returns them.

    Raises:
        ConfigError: One message lists every problem by key: what was found, what is allowed.
    """
    study, problems = None, []
    try:
        study = Study.model_validate(data)
    except ValidationError as error:
        # The one value error is `Study._agree`, whose checks are repeated here in any case.
        wrong = [e for e in error.errors(include_url=False) if e["type"] != "value_error"]
        words = inlined(schema())
        problems = [problem_of_key(e, words) for e in wrong]
        problems += disagreements(Readable(data, wrong={e["loc"] for e in wrong}))
        problems.sort(key=order_of_sections(words))
    lines = [*known_problems, *map(str, problems)]
    if study is None or lines:
        raise ConfigError(source, lines)
    return study


def check_verification(study: Study, source: str = "config"):
    """Check the section `verification` against the others: once a verification is made of it.

    Raises:
        ConfigError: They do not agree; one message lists every problem.
    """
    problems = disagreements_of_verification(Readable(study.model_dump()))
    if problems:
        raise ConfigError(source, [str(problem) for problem in problems])


def fitted_fluid_file(study: Study) -> str | None:
    """Where the workflow puts the fitted fluid; None for a study whose config writes its fluid."""
    return None if study.fluid.data is None else f"results/{study.study}/fluid_fit/fluid.yaml"


def with_fluid(study: Study, fluid: FluidConfig) -> Study:
    """The same study with another fluid, as one that was fitted.

    Raises:
        ConfigError: The study cannot be made with this fluid.
    """
    own = fluid.model_copy(update={"density": study.fluid.density})  # which is not fitted
    return parse_study(
        study.model_dump() | {"fluid": own.model_dump()}, source=f"study {study.study}"
    )


def with_fitted_fluid(study: Study, folder: str | Path = ".") -> Study:
    """The study as it is computed: with the fluid that the workflow has fitted, if it names data.

    Args:
        study: Of a config.
        folder: The one in which the workflow runs, which holds `results/`.

    Raises:
        ConfigError: The fluid is not fitted yet, or the study cannot be made with it.
    """
    file = fitted_fluid_file(study)
    if file is None:
        return study
    if not (Path(folder) / file).exists():
        command = f"snakemake --cores 2 --configfile CONFIG -- {file}"
        line = f"fluid.data: not fitted yet; fit it before: {command}"
        raise ConfigError(f"study {study.study}", [line])
    return with_fluid_of(study, Path(folder) / file)


def with_fluid_of(study: Study, file: Path) -> Study:
    """The same study with a fluid that was fitted and written to a file.

    Raises:
        ConfigError: The file is none, or the study cannot be made with it.
    """
    fluid, _ = read_yaml(file)
    return with_fluid(study, FluidConfig.model_validate(fluid["fluid"]))


def data_files(study: Study, config_file: str | Path) -> list[str]:
    """Paths of the measured data of a config file.

    Raises:
        ConfigError: A file does not exist.
    """
    paths = [_beside(config_file, name) for name in study.fluid.data or ()]
    missing = [
        f"fluid.data[{n}]: there is no file {path}; allowed: path relative to the config file"
        for n, path in enumerate(paths)
        if not _is_file(path)
    ]
    if missing:
        raise ConfigError(str(config_file), missing)
    return paths


def table_file(study: Study, config_file: str | Path) -> str | None:
    """Path of the finished table of a config file; None if the study computes its own.

    Raises:
        ConfigError: It does not exist.
    """
    if study.table.file is None:
        return None
    return _existing(config_file, "table.file", study.table.file)


def measured_file(study: Study, config_file: str | Path) -> str | None:
    """Path of the measured spacings of a config file; None if it names none.

    Raises:
        ConfigError: It does not exist, or what it holds is wrong.
    """
    if study.trains.measured is None:
        return None
    path = _existing(config_file, "trains.measured", study.trains.measured)
    try:
        spacings_file.read(path, dict(stages.measured(study)))
    except DataError as error:
        raise ConfigError(str(config_file), [f"trains.measured: {error}"]) from error
    return path


def _existing(config_file: str | Path, key: str, name: str) -> str:
    """Path of a file that a config names.

    Raises:
        ConfigError: It does not exist.
    """
    path = _beside(config_file, name)
    if not _is_file(path):
        line = f"{key}: there is no file {path}; allowed: path relative to the config file"
        raise ConfigError(str(config_file), [line])
    return path


def _is_file(path: str) -> bool:
    try:
        return Path(path).is_file()
    except OSError:  # its name is too long for one
        return False


def _beside(config_file: str | Path, name: str) -> str:
    return Path(os.path.relpath(Path(config_file).parent / name)).as_posix()


def read_yaml(path: str | Path) -> tuple[Any, list[str]]:
    """Content of a YAML file, and a line of text for every key that stands there twice.

    Raises:
        ConfigError: There is no such file, or it is not YAML.
    """
    try:
        text = Path(path).read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(str(path), [f"cannot be read: {reason}"]) from error
    if len(text) > LARGEST_FILE:
        found, allowed = len(text) / 1000, f"at most {LARGEST_FILE // 1000} kB"
        raise ConfigError(str(path), [f"found {found:.0f} kB; allowed: {allowed}"])
    try:
        return _loaded(text, FAST_LOADER)
    except yaml.YAMLError:
        pass  # the slow one finds the words for it
    except (ValueError, RecursionError) as error:
        raise ConfigError(str(path), [f"not YAML: {' '.join(str(error).split())}"]) from error
    try:
        return _loaded(text, yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise ConfigError(str(path), [f"not YAML: {where}{error.problem}"]) from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError(str(path), [f"not YAML: {reason}"]) from error


def _loaded(text: bytes, kind: type) -> tuple[Any, list[str]]:
    loader = kind(text)
    node = loader.get_single_node()
    repeated = list(_repeated_keys(node))
    return (None if node is None else loader.construct_document(node)), repeated


def _repeated_keys(
    node: yaml.Node | None, path: tuple = (), seen: set[int] | None = None
) -> Iterator[str]:
    """Keys that occur twice in a mapping; the YAML reader itself keeps the last, silently.

    A node that others refer to (`*alias`) is looked at once.
    """
    seen = set() if seen is None else seen
    if id(node) in seen:
        return
    seen.add(id(node))
    if isinstance(node, yaml.MappingNode):
        first_line: dict[str, int] = {}
        for key, value in node.value:
            name, line = str(key.value), key.start_mark.line + 1
            if name in first_line:
                lines = f"lines {first_line[name]} and {line}"
                yield f"{dotted((*path, name))}: found twice, in {lines}; allowed: once"
            first_line.setdefault(name, line)
            yield from _repeated_keys(value, (*path, name), seen)
    elif isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            yield from _repeated_keys(item, (*path, index), seen)
