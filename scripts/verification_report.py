"""Verification stage: all comparisons and studies -> figures and a statement of accuracy.

From the command line, with the verification folder of a study that has been verified:
python scripts/verification_report.py --table TABLE FOLDER
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import xarray as xr

from viscotrain.drawing import verification_figures
from viscotrain.jobs import drawings
from viscotrain.jobs.command import reporting
from viscotrain.studies.accuracy import KINDS, accuracy


def main(
    folder: Path,
    table: str | Path,
    start_up: Sequence[str | Path],
    closure_train: Sequence[str | Path],
    closure_gap: Sequence[str | Path],
    convergence: Sequence[str | Path],
):
    """Draw every figure that there is data for and write `accuracy.md`."""
    start_ups = [xr.load_dataset(path) for path in start_up]
    start_ups.sort(key=lambda data: (float(data["deborah"]), float(data["sp"]), float(data["sf"])))
    trains = [xr.load_dataset(path) for path in closure_train]
    trains.sort(key=lambda data: float(data["deborah"]))
    gaps = [pd.read_csv(path) for path in closure_gap]
    spacing = pd.concat(gaps, ignore_index=True) if gaps else pd.DataFrame()
    studies = {}
    for kind in KINDS:
        parts = [pd.read_csv(path) for path in convergence if Path(path).name.startswith(kind)]
        if parts:
            studies[kind] = pd.concat(parts, ignore_index=True)
            drawings.save(verification_figures.convergence(studies[kind], kind), folder / kind)
    if start_ups:
        drawings.save(verification_figures.start_up(start_ups), folder / "start_up")
    if trains:
        drawings.save(verification_figures.closure(trains, spacing), folder / "closure")
    text = accuracy(xr.load_dataset(table), start_ups, trains, spacing, studies)
    (folder / "accuracy.md").write_text(text, encoding="utf-8")
    print(text)


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--table", type=Path, required=True, help="velocity table")
    parser.add_argument("folder", type=Path, help="results/<study>/verification")
    given = parser.parse_args()
    with reporting():
        patterns = ("start_up/*.nc", "closure/train_*.nc", "closure/gap*.csv", "convergence/*.csv")
        found = [sorted(given.folder.glob(pattern)) for pattern in patterns]
        main(given.folder, given.table, *found)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(
            Path(snakemake.output.accuracy).parent,  # noqa: F821
            **{name: snakemake.input[name] for name in snakemake.input.keys()},  # noqa: F821, SIM118
        )
elif __name__ == "__main__":
    _command_line()
