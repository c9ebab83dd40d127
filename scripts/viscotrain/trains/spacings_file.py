"""Measured spacings of trains: a CSV file in, checked numbers out.

A file (`csv_files`) has a line for each measured spacing, in any order, with the columns

    station           D   where it was measured, one of the stations of the trains
    spacing           d   distance to the bead ahead, centre to centre
    deborah           1   of the measurement, if it was not made at all of the study
    volume_fraction   1   the same, in the channel or in the feed, as the study gives it

the last two of which may be missing, or empty: such spacings are compared with all trains. One
message lists what is wrong, with file and line.

This module imports neither numpy nor pandas: a config is read with it.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from viscotrain.fluid.csv_files import Column, CsvFile, refuse

# Wider than any channel's range: what lies outside has another unit.
COLUMNS = {
    "station": Column("D", 0.0, 1e6),
    "spacing": Column("d", 0.5, 1e3),
    "deborah": Column("1", 0.0, 1e6),
    "volume_fraction": Column("1", 1e-9, 1.0),
}
NEEDED = ("station", "spacing")
SAME = 1e-9  # relative difference of two ways to write one number


class Spacing(NamedTuple):
    """One of them, in d, with its station in D; None where it is of all trains."""

    station: float
    spacing: float
    deborah: float | None
    volume_fraction: float | None


def read(path: str | Path, known: Mapping[str, Sequence[float]]) -> list[Spacing]:
    """All spacings of a file, with the study's own numbers for what it calls by them.

    Args:
        path: Of the file.
        known: What the study has of `station`, `deborah` and `volume_fraction`.

    Raises:
        DataError: One message lists every problem, by line.
    """
    found = _File(Path(path), known)
    refuse(found.problems, "measured spacings")
    return found.rows


class _File(CsvFile):
    """Spacings and problems of one file."""

    def __init__(self, path: Path, known: Mapping[str, Sequence[float]]):
        self._known = known
        super().__init__(path, COLUMNS)

    def check_columns(self, line: int, names: list[str]):
        """Where, and how far."""
        for name in NEEDED:
            if name not in names:
                self.problem(line, f"no column {name}; allowed: {', '.join(COLUMNS)}")

    def take(self, line: int, numbers: dict[str, float]):
        """One spacing."""
        before = len(self.problems)
        for name in NEEDED:
            if name not in numbers:
                self.problem(line, f"{name}: found nothing; allowed: a number")
        own = {
            name: self._of_the_study(line, name, numbers[name])
            for name in self._known
            if name in numbers
        }
        if len(self.problems) == before:
            self.rows.append(
                Spacing(
                    own["station"],
                    numbers["spacing"],
                    own.get("deborah"),
                    own.get("volume_fraction"),
                )
            )

    def _of_the_study(self, line: int, name: str, value: float) -> float:
        for own in self._known[name]:
            if math.isclose(value, own, rel_tol=SAME):
                return own
        values = ", ".join(f"{own:g}" for own in self._known[name])
        self.problem(line, f"{name}: found {value:g}; allowed: one of the study's trains, {values}")
        return value
