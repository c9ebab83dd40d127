"""How a script runs: its arguments, declared once, for a rule of Snakemake and a command line.

A script hands over a function whose parameters say where they are from:

    def main(
        job: Job,
        sp: Annotated[float, wildcard("distance to the trailing sphere, in d, or inf")],
        result: Annotated[Path, made("netCDF file to write")],
        timing: Annotated[Path | None, made("CSV file for CPU times")] = None,
    ): ...

    run(main, settings=stages.dns)

Snakemake's job gives wildcards, files and parameters by the same names; on the command line a
wildcard is an option, `--sp`, and files are positional, in this order. A parameter with a default
may be left out, one of type `Sequence` takes several. The `Job` has the settings of the rule; on
the command line the same function as for the rule makes them of `--configfile`, and of arguments
that it names or declares itself.
"""

import argparse
import contextlib
import inspect
import math
import os
import sys
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported

import xarray as xr

from viscotrain.config import sweep
from viscotrain.config.models import FluidConfig
from viscotrain.config.reading import read_yaml, with_fitted_fluid
from viscotrain.jobs import datasets, provenance, several
from viscotrain.jobs.command import reporting
from viscotrain.jobs.digests import digest

# ------------------------------------------------------------------------------------- arguments


@dataclass(frozen=True)
class Source:
    """Where a parameter of a script is from, and how it is shown on the command line.

    Attributes:
        part: Of Snakemake's object.
        help: What it is, with its unit.
        named: Whether the command line has it as an option, `--name`, instead of a position.
        key: Its name in the part; that of the parameter if empty.
        convert: From the text of the command line, or Snakemake's value, instead of the type.
        choices: Allowed values.
        single: Whether several, of a rule, are one on the command line.
    """

    part: str
    help: str
    named: bool = False
    key: str = ""
    convert: Callable[[Any], Any] | None = None
    choices: Sequence | None = None
    single: bool = False


wildcard = partial(Source, "wildcards", named=True)
taken = partial(Source, "input")
made = partial(Source, "output")
option = partial(Source, "params", named=True)  # of the command line, and of a rule that has it

SP = Annotated[float, wildcard("distance of the middle to the trailing sphere, in d, or inf: none")]
SF = Annotated[float, wildcard("distance of the leading to the middle sphere, in d, or inf: none")]
Deborah = Annotated[float, wildcard("Deborah number, as the study defines it")]
Table = Annotated[Path, taken("velocity table")]
Units = Annotated[Path, taken("physical units of the study, units.nc")]
Flow = Annotated[Path, taken("flow without spheres, channel_flow.nc")]
Duct = Annotated[Path | None, taken("the same of a duct; none for a tube", named=True)]
Gap = Annotated[float, wildcard("between surfaces, in d")]
Simulated = Annotated[Sequence[Path], taken("files of dns.py or transient.py")]
Trajectory = Annotated[Path, taken("file of transient.py")]
Train = Annotated[Path, taken("file of trains.py")]
Trains = Annotated[Sequence[Path], taken("files of trains.py")]
MapPoints = Annotated[Sequence[Path], taken("files that trains.py --design-map wrote")]
Film = Annotated[Path, taken("file of film.py")]
Result = Annotated[Path, made("file to write")]
Timing = Annotated[Path | None, made("CSV file for CPU times")]


def folder_of(path: str | Sequence[str]) -> Path:
    """Conversion of Snakemake's outputs to their folder, and of a folder to itself."""
    first = Path(path if isinstance(path, str) else path[0])
    return first.parent if first.suffix else first


def positive(text: str) -> float:
    """Conversion to a number above 0, or the message of the command line."""
    value = float(text)
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"found {text}; allowed: number > 0")
    return value


def number_or_none(text: str) -> float | None:
    """Conversion to a number, or to None of the word none."""
    return None if text == "none" else float(text)


def folder_for(key: str) -> Source:
    """The folder of what a rule has under a key of its outputs."""
    return made("folder to write to", key=key, convert=folder_of)


@dataclass(frozen=True)
class Argument:
    """A parameter with its source: its name, how an item is converted, whether it takes several.

    Attributes:
        default: What it is if it is not given; `inspect.Parameter.empty` if it must be.
    """

    name: str
    source: Source
    convert: Callable[[Any], Any]
    many: bool
    default: Any

    @property
    def required(self) -> bool:
        """Whether there is no default."""
        return self.default is inspect.Parameter.empty

    def is_missing_wildcard(self, snakemake) -> bool:
        """Whether it is a wildcard that a job does not have: one of several geometries."""
        return self.source.part == "wildcards" and (snakemake.wildcards.get(self.name) is None)

    def of_job(self, snakemake) -> Any:
        """The value that Snakemake gives, or the default."""
        key = self.source.key or self.name
        value = getattr(snakemake, self.source.part).get(key)
        if value is None and self.required:
            raise KeyError(f"the rule has no {self.source.part}.{key}")
        if value is None:
            return self.default
        if self.many:
            return [self.convert(item) for item in ([value] if isinstance(value, str) else value)]
        return self.convert(value)

    def add_to(self, parser: argparse.ArgumentParser):
        """Declare it for the command line."""
        how: dict[str, Any] = {"help": self.source.help}
        name = self.name
        if self.source.named:
            name = f"--{name.replace('_', '-')}"
            how["required"] = self.required
        if self.convert is bool:
            parser.add_argument(name, action="store_true", **how)
            return
        if self.many:
            how["nargs"] = 1 if self.source.single else "+" if self.required else "*"
        elif not (self.required or self.source.named):
            how["nargs"] = "?"
        if not self.required:
            how["default"] = self.default
        parser.add_argument(name, type=self.convert, choices=self.source.choices, **how)


def declared(function: Callable) -> list[Argument]:
    """The parameters of a function that say where they are from."""
    hints = typing.get_type_hints(function, include_extras=True)
    found = []
    for name, parameter in inspect.signature(function).parameters.items():
        kind, *more = typing.get_args(hints.get(name)) or (object,)
        source = next((item for item in more if isinstance(item, Source)), None)
        if source is not None:
            item, *_ = typing.get_args(kind) or [kind]  # of Sequence[item], or of item | None
            many = typing.get_origin(kind) is Sequence
            convert = source.convert or item
            found.append(Argument(name, source, convert, many, parameter.default))
    return found


# ------------------------------------------------------------------------------------------- jobs


@dataclass(frozen=True)
class Job:
    """What every script is given beside its arguments.

    Attributes:
        settings: Of its stage.
        study: Name of the study; empty without a config.
        code: Digest of the script and all that it imports.
        by_hand: Whether it was called from a command line.
    """

    settings: Any
    study: str
    code: str
    by_hand: bool

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
    settings: Callable[..., Any] | None = None,
    config: bool = False,
    solves: bool = False,
    fitted: bool = True,
):
    """Run a script, as what it was started; nothing if it is imported.

    Args:
        main: The function of the script: takes a `Job` and declared arguments.
        settings: Makes the settings of the study, or of all `studies` of a config with several
            diameters, and of arguments that `main` or itself declares; of a declared type.
        config: Whether the command line asks for a config though there are no settings.
        solves: Whether it solves flows, for which a process prepares.
        fitted: Whether it needs the fluid of a study whose fluid is to be fitted.
    """
    script, work = main.__globals__, partial(_call, main, solves)
    if "snakemake" in script:
        arguments, snakemake = declared(main), script["snakemake"]
        one = partial(_as_job, work, arguments, settings)
        with reporting(snakemake.log[0]):
            if any(argument.is_missing_wildcard(snakemake) for argument in arguments):
                several.run(snakemake, one, partial(_current, settings))
            else:
                one(snakemake)
    elif script["__name__"] == "__main__":
        arguments = declared(main) + (declared(settings) if settings else [])
        _from_command_line(work, arguments, settings, config, script, fitted)


def _call(main: Callable, solves: bool, job: Job, values: Mapping[str, Any]):
    if solves:
        from viscotrain.flow.process import use_one_core

        use_one_core()
    main(job, **{argument.name: values[argument.name] for argument in declared(main)})


def _as_job(work: Callable, arguments: Sequence[Argument], settings, snakemake):
    job = Job(
        settings=_given(settings, snakemake),
        study=snakemake.params["study"],
        code=snakemake.params["code"],
        by_hand=False,
    )
    work(job, {argument.name: argument.of_job(snakemake) for argument in arguments})


def _given(settings, snakemake) -> Any:
    """The settings of a job, with the fluid in its place."""
    if settings is None:
        return None
    kind = inspect.signature(settings).return_annotation
    given = kind.model_validate(snakemake.params["settings"])
    if fluid := snakemake.input.get("fluid"):
        written = FluidConfig.model_validate(read_yaml(fluid)[0]["fluid"])
        given = given.with_fluid(written.physical())
    return given


def _current(settings, snakemake, path: Path) -> bool:
    """Whether a file was made with the settings and the code of a job."""
    return provenance.made_with(path, _given(settings, snakemake), snakemake.params["code"])


def _from_command_line(
    work: Callable,
    arguments: Sequence[Argument],
    settings,
    config: bool,
    script: Mapping,
    fitted: bool,
):
    takes = inspect.signature(settings).parameters if settings else {}
    parser = argparse.ArgumentParser(
        description=script["__doc__"], formatter_class=argparse.RawDescriptionHelpFormatter
    )
    if config or takes.keys() & {"study", "studies"}:
        parser.add_argument("--configfile", required=True, help="config of the study")
    for argument in arguments:
        argument.add_to(parser)
    values = vars(parser.parse_intermixed_args(sys.argv[1:]))
    with reporting():
        known, name = dict(values), ""
        if "configfile" in values:
            studies = sweep.load_studies(values["configfile"])
            if fitted:
                studies = tuple(map(with_fitted_fluid, studies))
            if "studies" not in takes:
                known["study"] = sweep.only(studies, values["configfile"])
            known["studies"], name = studies, sweep.name_of(studies)
        job = Job(
            settings=settings(**{name: known[name] for name in takes}) if settings else None,
            study=name,
            code=digest(script["__file__"]),
            by_hand=True,
        )
        work(job, values)
