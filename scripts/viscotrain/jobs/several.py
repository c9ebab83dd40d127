"""A job of several geometries: each in a process of its own, and what is finished is kept.

Snakemake removes the outputs of a job that fails or is killed. So every result waits under another
name, `sp1.1_sf2.5.nc.kept`, until all of its job are there; the next attempt takes up those that
were made with the present settings and code. Processes are forked after all is imported: one that
crashes leaves the others alone, and none finds what another left in memory.
"""

import multiprocessing
import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from viscotrain.config.names import parse_geometry
from viscotrain.jobs.command import announce, reporting


@dataclass(frozen=True)
class Part:
    """One geometry of a job.

    Attributes:
        name: Of the geometry.
        settings: As the rule states them.
        log: File for what is printed.
        outputs: Files and folders by their key; `result` is the last one to be moved.
    """

    name: str
    settings: Any
    log: Path
    outputs: dict[str, Path]

    @property
    def waiting(self) -> dict[str, Path]:
        """Outputs under the names that they have until all of the job are there."""
        return {key: path.with_name(f"{path.name}.kept") for key, path in self.outputs.items()}

    def finish(self):
        """Move what waits to its final names."""
        for key, path in self.waiting.items():
            if self.outputs[key].is_dir():
                shutil.rmtree(self.outputs[key])
            os.replace(path, self.outputs[key])

    def as_job(self, snakemake) -> SimpleNamespace:
        """What Snakemake would give a job of this geometry alone."""
        sp, sf = parse_geometry(self.name)
        return SimpleNamespace(
            wildcards={"sp": sp, "sf": sf},
            input=snakemake.input,
            params=dict(snakemake.params.items()) | {"settings": self.settings},
            output={key: str(path) for key, path in self.waiting.items()},
        )


def parts_of(snakemake) -> Iterator[Part]:
    """The geometries of a job, by its lists of outputs; their logs are beside that of the job.

    Its settings are those of all of them, or a list, one for each.
    """
    settings = snakemake.params.get("settings")
    lists = {
        key: _items(snakemake.output.get(key))
        for key in ("fields", "timing", "result")
        if snakemake.output.get(key)
    }
    for index, result in enumerate(map(Path, lists["result"])):
        log = Path(snakemake.log[0]).with_name(f"{result.stem}.log")
        own = settings[index] if isinstance(settings, list) else settings
        outputs = {key: Path(paths[index]) for key, paths in lists.items()}
        yield Part(result.stem, own, log, outputs)


def _items(value: str | list[str]) -> list[str]:
    """A list of one is a text for Snakemake."""
    return [value] if isinstance(value, str) else list(value)


def run(snakemake, one: Callable[[Any], None], current: Callable[[Any, Path], bool]):
    """Solve what is not there.

    Args:
        snakemake: The job.
        one: Solves one geometry, of a job as Snakemake gives it.
        current: Whether a file was made with the present settings and code, of such a job.
    """
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # ends the process of a geometry, too

    def there(part: Part, outputs: dict[str, Path]) -> bool:
        made = all(path.exists() for path in outputs.values())
        return made and current(part.as_job(snakemake), outputs["result"])

    new = [part for part in parts_of(snakemake) if not there(part, part.outputs)]
    solved = [there(part, part.waiting) or _alone(part, snakemake, one) for part in new]
    if not all(solved):
        sys.exit(1)
    for part in new:
        part.finish()


def _alone(part: Part, snakemake, one: Callable[[Any], None]) -> bool:
    """Solve one geometry in a process of its own; whether that succeeded."""
    fork = multiprocessing.get_context("fork")
    process = fork.Process(target=_logged, args=(part, snakemake, one), daemon=True)
    process.start()
    process.join()
    code = process.exitcode or 0
    if code < 0:
        announce(
            f"{part.name}: ended by {signal.Signals(-code).name}, for want of memory perhaps; "
            "the other geometries of its job go on"
        )
    elif code:
        announce(f"{part.name}: failed, see {part.log}")
        print(part.log.read_text(encoding="utf-8"))
    return code == 0


def _logged(part: Part, snakemake, one: Callable[[Any], None]):
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        with reporting(part.log):
            one(part.as_job(snakemake))
    except (Exception, KeyboardInterrupt):
        sys.exit(1)  # the log has it
