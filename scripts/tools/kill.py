"""Kill a study again and again, at random times, and see whether it still ends as if undisturbed.

python scripts/tools/kill.py FOLDER [--kills 50] [--configfile config/tiny.yaml] [--seed 1]

Runs the study once undisturbed and once with kills (SIGKILL, of all its processes), each in a
folder of its own in FOLDER, and compares: every file the same bytes but times, and nothing that was
finished made again.
"""

import argparse
import base64
import contextlib
import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[2]
TIMES = "timing"  # folders of CPU seconds, which differ
LONGEST = 1 / 3  # until a kill, of the time of an undisturbed run: longer than any of its jobs


def start(config: Path, folder: Path) -> subprocess.Popen:
    """A run of its own session, so that all of its processes can be killed together."""
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--snakefile", ROOT / "Snakefile"]
    command += ["--workflow-profile", ROOT / "profiles" / "default", "--configfile", config]
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "terminal.txt").open("a") as log:
        return subprocess.Popen(
            [*map(str, command)],
            cwd=folder,
            stdout=log,
            stderr=log,
            start_new_session=True,
            env=os.environ | {"PYTHONPATH": str(ROOT / "scripts")},
        )


def kill(run: subprocess.Popen):
    """End all processes of a run at once."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(run.pid, signal.SIGKILL)
    run.wait()


def finished(folder: Path) -> dict[Path, int]:
    """Files of results that are not of an interrupted job, with their times."""
    struck = interrupted(folder)
    return {
        path: path.stat().st_mtime_ns
        for path in (folder / "results").rglob("*.nc")
        if path.relative_to(folder) not in struck and not path.name.startswith(".")
    }


def interrupted(folder: Path) -> set[Path]:
    """Outputs of jobs that were killed, by Snakemake's marks, whose names are their paths."""
    marks = (folder / ".snakemake" / "incomplete").glob("*")
    return {Path(base64.urlsafe_b64decode(mark.name).decode()) for mark in marks if mark.is_file()}


def content(folder: Path) -> dict[str, str]:
    """Digests of all results but logs and CPU times, and of what is half-written, by their path."""
    results = folder / "results"
    return {
        str(path.relative_to(results)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(results.rglob("*"))
        if path.is_file()
        and (".part." in path.name or not {TIMES, "logs"} & set(path.parts))
        and path.name != ".running"
    }


def main():
    """Run both, compare, and print counts."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--configfile", type=Path, default=ROOT / "config" / "tiny.yaml")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    config, rng = given.configfile.resolve(), random.Random(given.seed)
    calm, killed = given.folder.resolve() / "calm", given.folder.resolve() / "killed"
    started = time.monotonic()
    if start(config, calm).wait() != 0:
        sys.exit(f"the undisturbed run failed: {calm / 'terminal.txt'}")
    longest = LONGEST * (time.monotonic() - started)
    again: list[Path] = []
    struck: Counter[str] = Counter()
    for n in range(given.kills):
        before = finished(killed) if killed.exists() else {}
        run, limit = start(config, killed), rng.uniform(0, longest)
        started = time.monotonic()
        while time.monotonic() - started < limit and run.poll() is None:
            time.sleep(0.05)
        ended = run.poll()
        kill(run)
        after = finished(killed)
        again += [path for path, at in before.items() if after.get(path, at) != at]
        struck.update({path.parts[2] for path in interrupted(killed)})  # results/tiny/dns/...
        made = f"{len(after)} files finished, {len(again)} made twice"
        print(f"kill {n + 1} after {limit:.1f} s: {made}, exit {ended}", flush=True)
        if ended == 0:  # nothing left to kill: begin anew
            shutil.rmtree(killed)
    if start(config, killed).wait() != 0:
        sys.exit(f"the run after all kills failed: {killed / 'terminal.txt'}")
    expected, found = content(calm), content(killed)
    differ = sorted(
        name for name in expected.keys() | found if expected.get(name) != found.get(name)
    )
    print(f"{given.kills} kills, {len(found)} files, {len(differ)} differ, {len(again)} made twice")
    print("interrupted: " + ", ".join(f"{name} {n}" for name, n in struck.most_common()))
    for name in [*differ, *map(str, again)]:
        print(f"  {name}")
    sys.exit(bool(differ or again))


if __name__ == "__main__":
    main()
