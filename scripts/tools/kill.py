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
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
TIMES = "timing"  # folders of CPU seconds, which differ
LONGEST, SHORTEST = 12.0, 0.3  # s until a kill


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
    incomplete = folder / ".snakemake" / "incomplete"
    marks = {path.name for path in incomplete.iterdir()} if incomplete.exists() else set()
    return {
        path: path.stat().st_mtime_ns
        for path in (folder / "results").rglob("*.nc")
        if _mark(path.relative_to(folder)) not in marks and not path.name.startswith(".")
    }


def _mark(path: Path) -> str:
    """How Snakemake names its mark of an output."""
    return base64.urlsafe_b64encode(str(path).encode()).decode()


def content(folder: Path) -> dict[str, str]:
    """Digests of all results but logs and CPU times, by their path."""
    results = folder / "results"
    return {
        str(path.relative_to(results)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(results.rglob("*"))
        if path.is_file() and not {TIMES, "logs"} & set(path.parts) and path.name != ".running"
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
    if start(config, calm).wait() != 0:
        sys.exit(f"the undisturbed run failed: {calm / 'terminal.txt'}")
    again, made = [], 0
    for n in range(given.kills):
        before = finished(killed) if killed.exists() else {}
        run, limit = start(config, killed), rng.uniform(SHORTEST, LONGEST)
        started = time.monotonic()
        while time.monotonic() - started < limit and run.poll() is None:
            time.sleep(0.05)
        ended = run.poll()
        kill(run)
        after = finished(killed)
        again += [path for path, at in before.items() if after.get(path, at) != at]
        made = len(after)
        print(f"kill {n + 1} after {limit:.1f} s: {made} files finished, exit {ended}", flush=True)
        if ended == 0:  # nothing left to kill: begin anew with half of it gone
            for path in rng.sample(sorted(after), len(after) // 2):
                path.unlink()
    if start(config, killed).wait() != 0:
        sys.exit(f"the run after all kills failed: {killed / 'terminal.txt'}")
    expected, found = content(calm), content(killed)
    differ = sorted(
        name for name in expected.keys() | found if expected.get(name) != found.get(name)
    )
    print(f"{given.kills} kills, {len(found)} files, {len(differ)} differ, {len(again)} made twice")
    for name in [*differ, *map(str, again)]:
        print(f"  {name}")
    sys.exit(bool(differ or again))


if __name__ == "__main__":
    main()
