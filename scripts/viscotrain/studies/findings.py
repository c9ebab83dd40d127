"""What a verification has found, read from the files of its jobs."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import xarray as xr

from viscotrain import files
from viscotrain.studies.accuracy import KINDS, accuracy
from viscotrain.studies.train_models import with_errors_of_models, with_models
from viscotrain.table.interpolation import VelocityTable


@dataclass(frozen=True)
class Findings:
    """Comparisons and studies.

    Attributes:
        start_ups: From `start_up.compare_start_up`, by De, sp and sf.
        trains: Short trains with those of the models (`train_models.with_models`), by De.
        spacing: From `train_models.with_errors_of_models`, all gaps; empty without closure.
        studies: Rows of `convergence.convergence_rows` of all geometries by kind.
    """

    start_ups: list[xr.Dataset]
    trains: list[xr.Dataset]
    spacing: pd.DataFrame
    studies: dict[str, pd.DataFrame]

    @classmethod
    def read(
        cls,
        table: VelocityTable,
        start_up: Sequence[Path],
        closure_train: Sequence[Path],
        closure_gap: Sequence[Path],
        convergence: Sequence[Path],
    ) -> "Findings":
        """From the files of the rules with these names; the models feed on the table."""
        gaps = [files.read_csv(path) for path in closure_gap]
        trains = _sorted(closure_train, "deborah")
        studies = {}
        for kind in KINDS:
            parts = [files.read_csv(path) for path in convergence if path.name.startswith(kind)]
            if parts:
                studies[kind] = pd.concat(parts, ignore_index=True)
        return cls(
            start_ups=_sorted(start_up, "deborah", "sp", "sf"),
            trains=[with_models(train, table.at(float(train["deborah"]))) for train in trains],
            spacing=with_errors_of_models(pd.concat(gaps), table) if gaps else pd.DataFrame(),
            studies=studies,
        )

    def accuracy(self, table: xr.Dataset) -> str:
        """Every number that was found, as a Markdown table; with those of the velocity table."""
        return accuracy(table, self.start_ups, self.trains, self.spacing, self.studies)


def _sorted(paths: Sequence[Path], *names: str) -> list[xr.Dataset]:
    found = [files.read_dataset(path) for path in paths]
    return sorted(found, key=lambda data: tuple(float(data[name]) for name in names))
