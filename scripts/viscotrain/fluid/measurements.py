"""Measured rheometry: CSV files in, checked numbers out.

A file is UTF-8 text with comma-separated columns of these names, in any order and none required but
the abscissa of what is there. Lines that begin with # are comments; an empty cell was not measured.

    angular_frequency   rad/s   abscissa, ascending, of
        storage_modulus Pa      G'
        loss_modulus    Pa      G''
    shear_rate          1/s     abscissa, ascending, of
        viscosity       Pa s    steady shear viscosity eta

One message lists what is wrong in all files, with file and line.
"""

import contextlib
import csv
import difflib
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple, NoReturn

import pandas as pd

from viscotrain.errors import DataError


class Column(NamedTuple):
    """Unit, plausible magnitudes, and for what is measured the column of its abscissa."""

    unit: str
    smallest: float
    largest: float
    abscissa: str | None = None


# Wider than any rheometer's range: what lies outside has another unit.
COLUMNS = {
    "angular_frequency": Column("rad/s", 1e-6, 1e7),
    "storage_modulus": Column("Pa", 1e-6, 1e9, "angular_frequency"),
    "loss_modulus": Column("Pa", 1e-6, 1e9, "angular_frequency"),
    "shear_rate": Column("1/s", 1e-6, 1e8),
    "viscosity": Column("Pa s", 1e-5, 1e8, "shear_rate"),
}
DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")
QUANTITIES = tuple(name for name, column in COLUMNS.items() if column.abscissa)
MOST_PROBLEMS = 20  # lines of a message
LONGEST_CELL = 40  # characters of a wrong cell that a message repeats
LARGEST_FILE = 1_000_000  # bytes; a rheometer writes a hundredth of it


def read(paths: Sequence[str | Path]) -> pd.DataFrame:
    """All measured numbers of some files.

    Returns:
        One row per number: file, line, quantity, abscissa (rad/s or 1/s), measured.

    Raises:
        DataError: One message lists every problem in every file, by line.
    """
    problems: list[str] = []
    rows: list[dict] = []
    for path in paths:
        found = _File(Path(path))
        rows += found.rows
        problems += found.problems
    if problems:
        count = f"{len(problems)} problem" + ("s" if len(problems) > 1 else "")
        shown = problems[:MOST_PROBLEMS]
        if len(shown) < len(problems):
            shown.append(f"... and {len(problems) - len(shown)} more")
        raise DataError("\n".join([f"measured data: {count}", *(f"  {p}" for p in shown)]))
    return pd.DataFrame(rows, columns=["file", "line", "quantity", "abscissa", "measured"])


class _File:
    """Rows and problems of one file."""

    def __init__(self, path: Path):
        self.path = path
        self.rows: list[dict] = []
        self.problems: list[str] = []
        self._last: dict[str, tuple[float, int]] = {}  # of each abscissa: value and line
        with contextlib.suppress(_Unusable):
            self._read()

    def _problem(self, line: int | None, text: str):
        where = str(self.path) if line is None else f"{self.path}, line {line}"
        self.problems.append(f"{where}: {text}")

    def _unusable(self, line: int | None, text: str) -> NoReturn:
        self._problem(line, text)
        raise _Unusable

    def _read(self):
        lines = self._lines()
        number, names = next(lines, (1, []))
        if all(map(_is_number, names)):
            self._unusable(number, f"no column names; allowed: {', '.join(COLUMNS)}")
        self._check_names(number, names)
        for number, cells in lines:
            if len(cells) != len(names):
                self._problem(number, f"found {len(cells)} cells; allowed: {len(names)}, as named")
                continue
            self._take(number, dict(zip(names, cells, strict=True)))
        if not self.rows and not self.problems:
            self._problem(None, "no measured numbers")

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
        """Names that are known, once each, with the abscissa of what is measured."""
        if len(names) == 1 and names[0] not in COLUMNS:
            for separator, word in ((";", "semicolons"), ("\t", "tabs")):
                if separator in names[0]:
                    self._unusable(number, f"columns separated by {word}; allowed: by commas")
        before = len(self.problems)
        for name in names:
            if name not in COLUMNS:
                near = difflib.get_close_matches(name, COLUMNS, n=1)
                hint = f"; did you mean {near[0]}?" if near else f"; allowed: {', '.join(COLUMNS)}"
                self._problem(number, f"unknown column {_shown(name)}{hint}")
        for name in sorted(set(names)):
            if names.count(name) > 1:
                self._problem(number, f"column {_shown(name)} found {names.count(name)} times")
        if len(self.problems) > before:
            raise _Unusable
        measured = [name for name in names if name in QUANTITIES]
        for name in measured:
            if COLUMNS[name].abscissa not in names:
                self._problem(number, f"{name} without the column {COLUMNS[name].abscissa}")
        if len(self.problems) > before:
            raise _Unusable
        if not measured:
            self._unusable(number, f"nothing measured; allowed: {', '.join(QUANTITIES)}")

    def _take(self, line: int, cells: dict[str, str]):
        """The numbers of one line."""
        before = len(self.problems)
        numbers = {name: self._number(line, name, cell) for name, cell in cells.items() if cell}
        if len(self.problems) > before:
            return
        for name, value in numbers.items():
            if name in QUANTITIES:
                abscissa = COLUMNS[name].abscissa
                if abscissa in numbers:
                    self.rows.append(
                        {
                            "file": str(self.path),
                            "line": line,
                            "quantity": name,
                            "abscissa": numbers[abscissa],
                            "measured": value,
                        }
                    )
                else:
                    self._problem(line, f"{name} without a value of {abscissa}")
            else:
                self._check_order(line, name, value)

    def _number(self, line: int, name: str, cell: str) -> float:
        unit, smallest, largest, _ = COLUMNS[name]
        value = float(cell) if _is_number(cell) else math.nan
        if not math.isfinite(value):
            point = f" (write {cell.replace(',', '.')})" if DECIMAL_COMMA.fullmatch(cell) else ""
            self._problem(line, f"{name}: found {_shown(cell)}{point}; allowed: a finite number")
        elif value <= 0:
            self._problem(line, f"{name}: found {value:g}; allowed: above 0")
        elif not smallest <= value <= largest:
            self._problem(
                line,
                f"{name}: found {value:g}; allowed: {smallest:g} to {largest:g} {unit}. "
                f"Is the unit {unit}?",
            )
        return value

    def _check_order(self, line: int, name: str, value: float):
        last, last_line = self._last.get(name, (0.0, 0))
        if value == last:
            text = f"found {value:g} again, as in line {last_line}; allowed: every value once"
            self._problem(line, f"{name}: {text}")
        elif value < last:
            text = f"found {value:g} after {last:g} in line {last_line}; allowed: ascending"
            self._problem(line, f"{name}: {text}")
        else:
            self._last[name] = value, line


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
