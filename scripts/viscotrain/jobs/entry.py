"""How a script runs: its arguments, declared once, for a rule of Snakemake and a command line.

A script hands over a function and says where its arguments are from:

    run(
        main,
        settings=stages.dns,
        arguments=[
            wildcard("sp", "distance to the trailing sphere, in d, or inf"),
            made("result", "netCDF file to write"),
            made("timing", "CSV file for CPU times", optional=True),
        ],
    )

Snakemake's job gives wildcards, files and parameters by the same names; on the command line a
wildcard is an option, `--sp`, and files are positional, in this order. `main(job, sp, ...)` gets
the values by name, after a `Job`, whose settings are those of the rule, or made from `--configfile`
by the same function as for the rule.
"""

import argparse
import contextlib
import inspect
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported

import xarray as xr

from viscotrain.config.models import FluidConfig
from viscotrain.config.reading import load_study, parse_study, read_yaml, with_fitted_fluid
from viscotrain.config.settings import Settings
from viscotrain.config.study import Study
from viscotrain.jobs import datasets, provenance
from viscotrain.jobs.command import reporting
from viscotrain.jobs.digests import digest


@dataclass(frozen=True)
class Argument:
    """One argument of a script.

    Attributes:
        name: Of the parameter of `main`.
        help: What it is, with its unit.
        source: Part of Snakemake's object that holds it; empty for the command line alone.
        key: Its name there.
        convert: From the text of the command line, or Snakemake's value.
        many: A list.
        single: A list that holds one item on the command line.
        optional: None, or an empty list, if it is not given.
        flag: Name as an option of the command line, instead of a position.
        choices: Allowed values.
    """

    name: str
    help: str
    source: str = ""
    key: str = ""
    convert: Callable[[Any], Any] = Path
    many: bool = False
    single: bool = False
    optional: bool = False
    flag: str = ""
    choices: Sequence | None = None

    def of_job(self, snakemake) -> Any:
        """The value that Snakemake gives; None if it gives none."""
        part = getattr(snakemake, self.source) if self.source else {}
        value = part.get(self.key or self.name)
        if self.many:
            listed = [value] if isinstance(value, str) else value or []
            return [self.convert(item) for item in listed]
        return None if value is None else self.convert(value)

    def add_to(self, parser: argparse.ArgumentParser):
        """Declare it for the command line."""
        name: dict[str, Any] = {"dest": self.name} if self.flag else {}
        if self.convert is bool:
            parser.add_argument(self.flag, action="store_true", help=self.help, **name)
            return
        how: dict[str, Any] = {"type": self.convert, "help": self.help, "choices": self.choices}
        if self.many:
            how |= {"nargs": 1 if self.single else "*" if self.optional else "+", "default": []}
        elif self.optional and not self.flag:
            how |= {"nargs": "?"}
        if self.flag:
            how |= name | {"required": not self.optional}
        parser.add_argument(self.flag or self.name, **how)


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def wildcard(name: str, help: str, convert: Callable[[str], Any] = float, **more) -> Argument:
    """A wildcard of the rule, and an option of the command line."""
    return Argument(name, help, "wildcards", convert=convert, flag=_flag(name), **more)


def taken(name: str, help: str, **more) -> Argument:
    """An input file, or several."""
    return Argument(name, help, "input", **more)


def made(name: str, help: str, **more) -> Argument:
    """An output file, or several."""
    return Argument(name, help, "output", **more)


def folder_of(path: str | Sequence[str]) -> Path:
    """Conversion of Snakemake's outputs to their folder, and of a folder to itself."""
    first = Path(path if isinstance(path, str) else path[0])
    return first.parent if first.suffix else first


def option(name: str, help: str, convert: Callable[[str], Any] = str, **more) -> Argument:
    """A choice of the command line, and a parameter of the rule if this has one of the name."""
    return Argument(name, help, "params", convert=convert, flag=_flag(name), **more)


DISTANCES = (
    wildcard("sp", "distance of the middle to the trailing sphere, in d, or inf: none"),
    wildcard("sf", "distance of the leading to the middle sphere, in d, or inf: none"),
)
DEBORAH = wildcard("deborah", "Deborah number, as the study defines it")


@dataclass(frozen=True)
class Job:
    """What every script is given beside its arguments.

    Attributes:
        settings: Of its stage.
        study: Name of the study; empty without a config.
        code: Digest of the script and all that it imports.
        by_hand: Whether it was called from a command line.
        whole_study: Reads the config, for what is said about progress and never for a number.
    """

    settings: Any
    study: str
    code: str
    by_hand: bool
    whole_study: Callable[[], Study] | None = None

    def attributes(self, title: str) -> dict[str, str]:
        """Global attributes of what it writes."""
        of_study = f"{title} of study {self.study}" if self.study else title
        return provenance.attributes(of_study, self.settings, self.code)

    def write(self, dataset: xr.Dataset, path: str | Path, title: str = ""):
        """Stamp a dataset, which may have a title, and write it."""
        own = self.attributes(title or dataset.attrs["title"])
        datasets.write(dataset.assign_attrs(own), path)

    @contextlib.contextmanager
    def checkpoint(self, output: Path) -> Iterator[Path]:
        """File beside an output for what a killed run goes on from; removed when all is written."""
        path = output.with_name(output.name + ".checkpoint.npz")
        path.parent.mkdir(parents=True, exist_ok=True)
        yield path
        path.unlink(missing_ok=True)


def run(
    main: Callable,
    arguments: Sequence[Argument],
    settings: Callable[..., Settings] | None = None,
    config: bool = False,
    solves: bool = False,
):
    """Run a script, as what it was started; nothing if it is imported.

    Args:
        main: The function of the script.
        arguments: What it takes after the `Job`.
        settings: Makes the settings from the study, and from arguments of its own names; of a
            declared type.
        config: Whether the command line asks for a config though there are no settings.
        solves: Whether it solves flows, for which a process prepares.
    """
    script, work = main.__globals__, partial(_call, main, solves)
    if "snakemake" in script:
        with reporting(script["snakemake"].log[0]):
            _as_job(work, arguments, settings, script["snakemake"])
    elif script["__name__"] == "__main__":
        _from_command_line(work, arguments, settings, config, script)


def _call(main: Callable, solves: bool, job: Job, values: Mapping[str, Any]):
    if solves:
        from viscotrain.flow.process import use_one_core

        use_one_core()
    names = inspect.signature(main).parameters
    main(job, **{name: value for name, value in values.items() if name in names})


def _as_job(work: Callable, arguments: Sequence[Argument], settings, snakemake):
    given, fluid = None, snakemake.input.get("fluid")
    if settings is not None:
        kind = inspect.signature(settings).return_annotation
        given = kind.model_validate(snakemake.params.settings)
        if fluid:
            written = FluidConfig.model_validate(read_yaml(fluid)[0]["fluid"])
            given = given.with_fluid(written.physical())
    job = Job(
        settings=given,
        study=snakemake.params.study,
        code=snakemake.params.code,
        by_hand=False,
        whole_study=lambda: with_fitted_fluid(parse_study(snakemake.config)),
    )
    work(job, {argument.name: argument.of_job(snakemake) for argument in arguments})


def _from_command_line(
    work: Callable, arguments: Sequence[Argument], settings, config: bool, script: Mapping
):
    takes = inspect.signature(settings).parameters if settings else {}
    parser = argparse.ArgumentParser(
        description=script["__doc__"], formatter_class=argparse.RawDescriptionHelpFormatter
    )
    if config or "study" in takes:
        parser.add_argument("--configfile", required=True, help="config of the study")
    for argument in arguments:
        argument.add_to(parser)
    values = vars(parser.parse_intermixed_args(sys.argv[1:]))
    with reporting():
        study = None
        if "configfile" in values:
            study = with_fitted_fluid(load_study(values["configfile"]))
        known = values | {"study": study}

        def whole_study() -> Study:
            assert study is not None  # a script that reads it asks for a config
            return study

        job = Job(
            settings=settings(**{name: known[name] for name in takes}) if settings else None,
            study=study.study if study else "",
            code=digest(script["__file__"]),
            by_hand=True,
            whole_study=whole_study,
        )
        work(job, values)
