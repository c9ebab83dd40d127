r"""How far the solver reaches and how true its error estimates are, on a designed sample.

    python scripts/tools/robustness.py --verify --jobs 2

solves all points that are not in the output yet, appends a row for each, and prints the summary.
`--points 0:10` takes some of them; `--verify` also solves a finer reference of those that converge.
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported

import multiprocessing
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pandas as pd

from viscotrain.jobs.digests import digest
from viscotrain.studies import robustness, sample
from viscotrain.studies.robustness import DEFAULT, REFERENCE

OUTPUT = Path(__file__).parents[2] / "tests" / "verification" / "robustness" / "sample.csv"


def progress(line: str):
    """Print at once."""
    print(line, flush=True)


class Results:
    """The file of results, to which threads append."""

    def __init__(self, path: Path):
        self._path, self._lock = path, threading.Lock()
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            pd.DataFrame(columns=robustness.COLUMNS).to_csv(path, index=False)

    def table(self) -> pd.DataFrame:
        """All rows of the design, in its order."""
        table = pd.read_csv(self._path)
        table = table[table["seed"] == sample.SEED]
        return table.sort_values(["index", "run"], ignore_index=True)

    def finished(self) -> dict[tuple[int, str], dict]:
        """Rows by point and run."""
        rows = self.table().to_dict("records")
        return {(row["index"], row["run"]): row for row in rows}

    def append(self, row: dict):
        """Write a row and say so."""
        row = row | {"physics_digest": digest("dns")}
        line = pd.DataFrame([row]).reindex(columns=robustness.COLUMNS)
        with self._lock:
            line.to_csv(self._path, mode="a", header=False, index=False)
            progress(described(row))


def described(row: dict) -> str:
    """A line of progress."""
    label = robustness.run_name(row["part"], row["index"], row["run"])
    text = f"{label}: De {row['deborah']:.3g}, "
    if row["converged"]:
        text += f"estimated error {row.get('estimate', float('nan')):.1e}"
        text += "" if row["accurate"] else " NOT ACCURATE"
    else:
        text += f"NOT SOLVED, the way led to De {row['deborah_reached']:.3g}: {row['reason']}"
    if "true_error" in row:
        text += f", error of the default {row['true_error']:.1e}"
    return f"{text}, elements {row['meshes']}, {row['cpu_seconds']:.0f} CPU s"


def in_own_process(point: sample.Point, run: str) -> dict | None:
    """Solve where memory is given back afterwards, and where a crash does no harm."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        try:
            return pool.submit(robustness.solve, point, run, report=progress).result()
        except BrokenProcessPool:  # out of memory, for example: no result of the solver
            label = robustness.run_name(point.part, point.index, run)
            progress(f"{label}: the process died, no row")
            return None


def complete(point: sample.Point, verify: bool, finished: dict, results: Results):
    """Solve what is missing of one point."""
    default = finished.get((point.index, DEFAULT))
    if default is None:
        default = in_own_process(point, DEFAULT)
        if default is None:
            return
        results.append(default)
    if verify and default["converged"] and (point.index, REFERENCE) not in finished:
        reference = in_own_process(point, REFERENCE)
        if reference is not None:
            results.append(robustness.with_error(reference, default))


def main(points: slice, verify: bool, jobs: int, output: Path):
    """Solve what is missing and print the summary."""
    results = Results(output)
    finished = results.finished()
    with ThreadPoolExecutor(jobs) as pool:
        chosen = sample.design()[points]
        list(pool.map(lambda point: complete(point, verify, finished, results), chosen))
    print(robustness.report(results.table(), digest("dns")))


def _slice(text: str) -> slice:
    first, _, last = text.partition(":")
    return slice(int(first or 0), int(last) if last else None)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--points", type=_slice, default=slice(None), help="A:B; all")
    parser.add_argument("--verify", action="store_true", help="also solve the references")
    parser.add_argument("--jobs", type=int, default=1, help="processes, of one thread each")
    parser.add_argument("--output", type=Path, default=OUTPUT, help="CSV file of the results")
    given = parser.parse_args()
    main(given.points, given.verify, given.jobs, given.output)
