"""What Snakemake's own work costs in a study of thousands of geometries, by jobs that sleep.

python scripts/tools/scheduling_overhead.py --geometries 10000 --cores 2 --faster 20

Plans and runs the dns stage of such a study, De 0, 1 and 5, in a folder of its own. Jobs sleep in
place of simulations, a twentieth of what these would take by the measured costs; jobs, files and
records are as many as in the study. What a run takes beyond the sleep is the overhead; it is given
as a share of the run that does not sleep less. Told are the time of a dry run and its memory, too.
"""

import argparse
import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml

from viscotrain.config.reading import load_study
from viscotrain.jobs import grouping
from viscotrain.jobs.resources import flow_seconds

ROOT = Path(__file__).parents[2]
PARTS = ("workflow", "scripts", "config", "profiles", "envs", "Snakefile")
DEBORAH = 5.0
STUB = """import time
from pathlib import Path

time.sleep({seconds} * sum(path.endswith(".nc") for path in snakemake.output))
for path in snakemake.output:
    Path(path).touch()
"""


def configured(folder: Path, geometries: int) -> Path:
    """Write the config of a study of about so many geometries."""
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
    number = round(math.sqrt(geometries))
    axis = [round(1.02 + 0.02 * n, 2) for n in range(number - 1)] + [math.inf]
    config["table"] |= {"sp": axis, "sf": axis, "pair": [], "check": 3}
    config |= {"study": "large", "deborah": {"values": [0, 1, DEBORAH]}, "verification": {}}
    path = folder / "large.yaml"
    path.write_text(yaml.safe_dump(config), encoding="utf-8")
    return path


def used() -> tuple[float, float]:
    """CPU seconds of all processes that ended, and megabytes of the largest."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3


def measured(folder: Path, *options: str) -> tuple[float, float, float]:
    """Seconds, CPU seconds and megabytes of Snakemake with these options."""
    started, before = time.monotonic(), used()[0]
    environment = os.environ | {"PYTHONPATH": str(folder / "scripts")}
    with (folder / "snakemake.txt").open("a", encoding="utf-8") as log:
        subprocess.run(
            [sys.executable, "-m", "snakemake", *options],
            cwd=folder,
            env=environment,
            stdout=log,
            stderr=log,
            check=True,
        )
    return time.monotonic() - started, used()[0] - before, used()[1]


def main():
    """Plan, run and tell."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--geometries", type=int, default=10_000, help="about")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--faster", type=float, default=20.0, help="how much less jobs sleep")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in PARTS:
            copy = shutil.copytree if (ROOT / part).is_dir() else shutil.copy2
            copy(ROOT / part, folder / part)
        path = configured(folder, arguments.geometries)
        jobs = grouping.jobs(load_study(path))
        seconds = flow_seconds(DEBORAH)
        stub = STUB.format(seconds=seconds / arguments.faster)
        (folder / "scripts/dns.py").write_text(stub, encoding="utf-8")
        (folder / "scripts/table.py").write_text(STUB.format(seconds=0), encoding="utf-8")
        options = ("--configfile", str(path), "--cores", str(arguments.cores), "--")
        table = "results/large/table/velocity_table.nc"
        plan = measured(folder, "--dry-run", *options, table)
        run = measured(folder, *options, table)
    number = sum(map(len, jobs))
    work = number * seconds
    beyond = run[0] - work / arguments.faster / arguments.cores
    print(
        f"{number} geometries in {len(jobs)} jobs, {work:.0f} CPU s by the measured costs\n"
        f"dry run   {plan[0]:.1f} s, {plan[1]:.1f} CPU s, {plan[2]:.0f} MB\n"
        f"overhead  {run[1]:.0f} CPU s, {100 * run[1] / work:.1f} % of the work; "
        f"{beyond:.0f} s, {100 * beyond * arguments.cores / work:.1f} % of the run on "
        f"{arguments.cores} cores"
    )


if __name__ == "__main__":
    main()
