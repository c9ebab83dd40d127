r"""What memory changes: direct simulations through a whole channel, against the train model.

    python scripts/tools/whole_channel.py FOLDER --table results/paper/table/velocity_table.nc

simulates the cases that are missing in the kept results, one after the other, appends them, and
compares with trains that move by the table, whose pairs are kept, too. A run that was killed
goes on from its checkpoint in FOLDER. Without a table nothing is compared.
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported

from pathlib import Path

import pandas as pd

from viscotrain.config.reading import load_study
from viscotrain.errors import SolutionError
from viscotrain.studies import whole_channel
from viscotrain.table.interpolation import VelocityTable

ROOT = Path(__file__).parents[2]
STUDY = ROOT / "config" / "paper.yaml"
KEPT = ROOT / "tests" / "verification" / "memory"


def progress(line: str):
    """Print at once."""
    print(line, flush=True)


def append(rows: pd.DataFrame, path: Path):
    """Write more rows."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rows.to_csv(path, mode="a", header=not path.exists(), index=False, float_format="%.8g")


def simulated(path: Path) -> pd.DataFrame:
    """Rows of all cases so far."""
    if not path.exists():
        return pd.DataFrame(columns=whole_channel.CASE)
    return pd.read_csv(path, dtype={"first": str})


def run_direct(folder: Path, kept: Path):
    """Simulate all cases that are missing."""
    study = load_study(STUDY)
    rows = simulated(kept / "direct.csv")
    done = set(rows[whole_channel.CASE].itertuples(index=False, name=None))
    for case in whole_channel.cases():
        if tuple(case.row.values()) in done:
            continue
        progress(str(case))
        checkpoint = folder / ("_".join(map(str, case.row.values())).replace(" ", "_") + ".npz")
        try:
            rows = whole_channel.simulate(study, case, progress, checkpoint)
        except SolutionError as error:
            progress(f"NOT SOLVED: {error}")
            continue
        append(rows, kept / "direct.csv")
        checkpoint.unlink()


def main(folder: Path, table: Path | None, kept: Path):
    """Simulate what is missing, and compare."""
    folder.mkdir(parents=True, exist_ok=True)
    run_direct(folder, kept)
    if table:
        beta, velocities = load_study(STUDY).confinement, VelocityTable.open(table)
        direct = simulated(kept / "direct.csv")
        c = whole_channel.fitted(direct, velocities, beta)
        outlet = whole_channel.compare(direct, velocities, beta, c)
        held = whole_channel.held_pairs(velocities)
        held.to_csv(kept / "held_pairs.csv", index=False, float_format="%.6g")
        outlet.to_csv(kept / "outlet.csv", index=False, float_format="%.8g")
        (kept / "outlet.md").write_text(whole_channel.statement(outlet), encoding="utf-8")
        progress(f"coefficient of memory: {c:g}\n{outlet.to_string()}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, help="for checkpoints")
    parser.add_argument("--table", type=Path, help="of the study config/paper.yaml")
    parser.add_argument("--output", type=Path, default=KEPT, help="folder of the results")
    given = parser.parse_args()
    main(given.folder, given.table, given.output)
