r"""What a train costs with each closure: 600 spheres over 800 D, and 1000 passages.

    python scripts/tools/benchmark_trains.py results/demo/table/velocity_table.nc

for every Deborah number of the table, in CPU seconds of one thread; `set-up` is making the closure
of the table, `reach` the distance at which its sum ends. Compilation is done before.
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported

import time
from pathlib import Path

import numpy as np

from viscotrain.fluid.parameters import mean_spacing
from viscotrain.jobs.command import reporting
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains.closures import CLOSURES
from viscotrain.trains.recording import record_train

ASKED = 5.0  # CPU s
SPHERES, LENGTH, PASSAGES, STATIONS = 600, 800.0, 1000, 81  # length in D
CONFINEMENT = 0.2  # d/D


def seconds(table: VelocityTable, deborah: float, name: str) -> tuple[float, float, float]:
    """CPU seconds of a closure and of a train, and the reach of the closure in d."""
    started = time.process_time()
    closure = CLOSURES[name](table.at(deborah))
    made = time.process_time()
    closure.free_velocities(np.ones(2))
    compiled = time.process_time()
    record_train(
        closure,
        confinement=CONFINEMENT,
        volume_fraction=mean_spacing(CONFINEMENT, 1.0) * SPHERES * CONFINEMENT / LENGTH,
        length=LENGTH,
        stations=np.linspace(0.0, LENGTH, STATIONS),
        passages=PASSAGES,
        rng=np.random.default_rng(0),
    )
    moved = time.process_time() - compiled
    return made - started, moved, getattr(closure, "reach", np.nan)


def main(path: Path):
    """Measure and print."""
    table = VelocityTable.open(path)
    print("      De  closure       reach/d  set-up   train")
    for deborah in table.deborah:
        for name in CLOSURES:
            made, moved, reach = seconds(table, deborah, name)
            met = "" if made + moved <= ASKED else f"   NOT MET: at most {ASKED:g}"
            print(f"{deborah:8g}  {name:12s}{reach:9.1f}{made:8.2f}{moved:8.2f}{met}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("table", type=Path, help="velocity table")
    with reporting():
        main(parser.parse_args().table)
