"""CSV files of measured numbers: lines, named columns, and what is wrong with them, by line.

A file is UTF-8 text with comma-separated columns of known names, in any order. Lines that begin
with # are comments; an empty cell was not measured. What a line means is up to the kinds of files,
which derive from `CsvFile`.

This module imports neither numpy nor pandas: a config is read with it.
"""

import contextlib
import csv
import difflib
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, NoReturn

from viscotrain.errors import DataError

MOST_PROBLEMS = 20  # lines of a message
LONGEST_CELL = 40  # characters of a wrong cell that a message repeats
LARGEST_FILE = 1_000_000  # bytes; a rheometer writes a hundredth of it
DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")


class Column(NamedTuple):
    """Unit, plausible magnitudes, and for what is measured the column of its abscissa."""

    unit: str
    smallest: float
    largest: float
    abscissa: str | None = None


def refuse(problems: Sequence[str], what: str = "measured data") -> None:
    """Raise one message of all problems, if there are any.

    Raises:
        DataError: It lists them.
    """
    if not problems:
        return
    count = f"{len(problems)} problem" + ("s" if len(problems) > 1 else "")
    shown = list(problems[:MOST_PROBLEMS])
    if len(shown) < len(problems):
        shown.append(f"... and {len(problems) - len(shown)} more")
    raise DataError("\n".join([f"{what}: {count}", *(f"  {p}" for p in shown)]))


class CsvFile:
    """A file that is read, and its problems.

    Args:
        path: Of the file.
        columns: All that it may have, by name.
    """

    def __init__(self, path: Path, columns: Mapping[str, Column]):
        self.path, self.columns = path, columns
        self.rows: list = []
        self.problems: list[str] = []
        with contextlib.suppress(_Unusable):
            self._read()

    def check_columns(self, line: int, names: list[str]):
        """Name what is wrong with known columns, that stand once each."""
        raise NotImplementedError

    def take(self, line: int, numbers: dict[str, float]):
        """Keep the numbers of one line, which are right by themselves."""
        raise NotImplementedError

    def problem(self, line: int | None, text: str):
        """Keep what is wrong, with its line if it has one."""
        where = str(self.path) if line is None else f"{self.path}, line {line}"
        self.problems.append(f"{where}: {text}")

    def _unusable(self, line: int | None, text: str) -> NoReturn:
        self.problem(line, text)
        raise _Unusable

    def _read(self):
        lines = self._lines()
        number, names = next(lines, (1, []))
        if all(map(_is_number, names)):
            self._unusable(number, f"no column names; allowed: {', '.join(self.columns)}")
        for check in (self._check_names, self.check_columns):
            check(number, names)
            if self.problems:
                return
        for number, cells in lines:
            if len(cells) != len(names):
                self.problem(number, f"found {len(cells)} cells; allowed: {len(names)}, as named")
                continue
            self._take(number, dict(zip(names, cells, strict=True)))
        if not self.rows and not self.problems:
            self.problem(None, "no measured numbers")

    def _lines(self) -> Iterator[tuple[int, list[str]]]:
        """Number and cells of each line that is no comment and not empty."""
        try:
            size = self.path.stat().st_size
            if size > LARGEST_FILE:
                found, allowed = size / 1e6, LARGEST_FILE / 1e6
                self._unusable(None, f"found {found:.3g} MB; allowed: at most {allowed:g} MB")
            content = self.path.read_bytes()
        except OSError as error:
            self._unusable(None, f"cannot be read: {error.strerror}")
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            number = content.count(b"\n", 0, error.start) + 1
            byte = content[error.start]
            self._unusable(number, f"found the byte 0x{byte:02x}; allowed: UTF-8 text")
        for number, line in enumerate(text.splitlines(), start=1):
            if line.strip() and not line.lstrip().startswith("#"):
                cells = self._cells(number, line)
                if any(cell.strip() for cell in cells):
                    yield number, [cell.strip() for cell in cells]

    def _cells(self, number: int, line: str) -> list[str]:
        try:
            return next(csv.reader([line], skipinitialspace=True))
        except csv.Error as error:
            self._unusable(number, f"not comma-separated: {error}")

    def _check_names(self, number: int, names: list[str]):
        """Names that are known, once each."""
        if len(names) == 1 and names[0] not in self.columns:
            for separator, word in ((";", "semicolons"), ("\t", "tabs")):
                if separator in names[0]:
                    self._unusable(number, f"columns separated by {word}; allowed: by commas")
        for name in names:
            if name not in self.columns:
                near = difflib.get_close_matches(name, self.columns, n=1)
                known = f"allowed: {', '.join(self.columns)}"
                hint = f"did you mean {near[0]}?" if near else known
                self.problem(number, f"unknown column {_shown(name)}; {hint}")
        for name in sorted(set(names)):
            if names.count(name) > 1:
                self.problem(number, f"column {_shown(name)} found {names.count(name)} times")

    def _take(self, line: int, cells: dict[str, str]):
        before = len(self.problems)
        numbers = {name: self._number(line, name, cell) for name, cell in cells.items() if cell}
        if len(self.problems) == before:
            self.take(line, numbers)

    def _number(self, line: int, name: str, cell: str) -> float:
        unit, smallest, largest, abscissa = self.columns[name]
        value = float(cell) if _is_number(cell) else math.nan
        if not math.isfinite(value):
            point = f" (write {cell.replace(',', '.')})" if DECIMAL_COMMA.fullmatch(cell) else ""
            self.problem(line, f"{name}: found {_shown(cell)}{point}; allowed: a finite number")
        elif value <= 0 < smallest:
            empty = ", or an empty cell below what the rheometer resolves" if abscissa else ""
            self.problem(line, f"{name}: found {value:g}; allowed: above 0{empty}")
        elif not smallest <= value <= largest:
            allowed = f"{smallest:g} to {largest:g} {unit}. Is the unit {unit}?"
            self.problem(line, f"{name}: found {value:g}; allowed: {allowed}")
        return value


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _shown(cell: str) -> str:
    """A cell as a message repeats it: not too long, and with no character that moves a cursor."""
    text = ascii(cell) if not cell.isprintable() else repr(cell)
    return text if len(text) <= LONGEST_CELL else f"{text[: LONGEST_CELL - 3]}..."


class _Unusable(Exception):
    """A file whose further lines would only repeat the problem."""
