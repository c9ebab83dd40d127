"""Measured rheometry: CSV files in, checked numbers out.

A file (`csv_files`) has columns of these names, none required but the abscissa of what is there.

    angular_frequency   rad/s   abscissa, ascending, of
        storage_modulus Pa      G'
        loss_modulus    Pa      G''
    shear_rate          1/s     abscissa, ascending, of
        viscosity       Pa s    steady shear viscosity eta
        first_normal_stress_difference
                        Pa      N1 in steady shear

One message lists what is wrong in all files, with file and line.
"""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from viscotrain.fluid.csv_files import Column, CsvFile, refuse

# Wider than any rheometer's range: what lies outside has another unit.
COLUMNS = {
    "angular_frequency": Column("rad/s", 1e-6, 1e7),
    "storage_modulus": Column("Pa", 1e-6, 1e9, "angular_frequency"),
    "loss_modulus": Column("Pa", 1e-6, 1e9, "angular_frequency"),
    "shear_rate": Column("1/s", 1e-6, 1e8),
    "viscosity": Column("Pa s", 1e-5, 1e8, "shear_rate"),
    "first_normal_stress_difference": Column("Pa", 1e-6, 1e9, "shear_rate"),
}
QUANTITIES = tuple(name for name, column in COLUMNS.items() if column.abscissa)


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
    refuse(problems)
    return pd.DataFrame(rows, columns=["file", "line", "quantity", "abscissa", "measured"])


class _File(CsvFile):
    """Rows and problems of one file."""

    def __init__(self, path: Path):
        self._last: dict[str, tuple[float, int]] = {}  # of each abscissa: value and line
        super().__init__(path, COLUMNS)

    def check_columns(self, line: int, names: list[str]):
        """Something is measured, and with its abscissa."""
        measured = [name for name in names if name in QUANTITIES]
        for name in measured:
            if COLUMNS[name].abscissa not in names:
                self.problem(line, f"{name} without the column {COLUMNS[name].abscissa}")
        if not measured:
            self.problem(line, f"nothing measured; allowed: {', '.join(QUANTITIES)}")

    def take(self, line: int, numbers: dict[str, float]):
        """A row for each quantity."""
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
                    self.problem(line, f"{name} without a value of {abscissa}")
            else:
                self._check_order(line, name, value)

    def _check_order(self, line: int, name: str, value: float):
        last, last_line = self._last.get(name, (0.0, 0))
        if value == last:
            text = f"found {value:g} again, as in line {last_line}; allowed: every value once"
            self.problem(line, f"{name}: {text}")
        elif value < last:
            text = f"found {value:g} after {last:g} in line {last_line}; allowed: ascending"
            self.problem(line, f"{name}: {text}")
        else:
            self._last[name] = value, line
