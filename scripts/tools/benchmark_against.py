"""CPU time of solving, without imports and meshes, against that of another checkout.

    git worktree add ../before f6530ea
    python scripts/tools/benchmark_against.py ../before

runs each work in turn with the package of either checkout, one process on one thread each, and
prints both times and their ratio. `--works` names some of the works; `--rounds` repeats all.
"""

import argparse
import contextlib
import importlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
TRIPLETS = (1.1, 1.1), (1.5, 2.5), (4.5, 1.5)
NONE = float("inf")
# By name: distances, De to solve, De to count.
WORKS = (
    {f"triplet {sp:g}, {sf:g}, De 0, 1, 5": (sp, sf, (0, 1, 5), (0, 1, 5)) for sp, sf in TRIPLETS}
    | {
        f"triplet {sp:g}, {sf:g}, De 31, 62": (sp, sf, (0, 10, 31, 62), (31, 62))
        for sp, sf in TRIPLETS
    }
    | {"one sphere, De 0.1 to 5": (NONE, NONE, (0.1, 0.5, 1, 2, 5), (0.1, 0.5, 1, 2, 5))}
    | {"transient 1.5, 2.5, De 5": (1.5, 2.5, (5,), None)}
)

# Modules that hold what is used here: today's, and that of checkouts before there were rooms.
PLACES = {
    "load_study": ("config.reading", "config.models", "config"),
    "use_one_core": ("flow.process", "process"),
    "solutions": ("studies.dns", "simulation"),
    "triplet": ("studies.dns", "simulation"),
    "flow_maker": ("studies.transient", "trajectories"),
    "time_options": ("studies.transient", "trajectories"),
    "Transient": ("flow.time_stepping", "transient"),
}


def _of_package(name: str):
    """A function of whichever package this process imports."""
    for place in PLACES[name]:
        with contextlib.suppress(ModuleNotFoundError):
            return getattr(importlib.import_module(f"viscotrain.{place}"), name)
    raise SystemExit(f"the checkout has no {name}")


def seconds(name: str) -> float:
    """CPU seconds of one work, in this process, with whichever package it imports."""
    load_study, solutions, triplet = map(_of_package, ("load_study", "solutions", "triplet"))
    _of_package("use_one_core")()
    sp, sf, deborahs, counted = WORKS[name]
    package = Path(importlib.import_module("viscotrain").__path__[0])
    study = load_study(package.parents[1] / "config" / "config.yaml")  # each reads its own demo
    values = study.deborah.model_copy(update={"values": tuple(float(De) for De in deborahs)})
    study = study.model_copy(update={"deborah": values})
    with contextlib.suppress(ModuleNotFoundError):  # of checkouts before there were settings
        study = importlib.import_module("viscotrain.config.stages").convergence(study)
    geometry = triplet(study, sp, sf)
    if counted is None:
        return _transient_seconds(study, geometry, deborahs[0])
    found = [(De, solution) for De, solution in solutions(study, geometry)]
    missing = set(counted) - {De for De, solution in found if solution.solved}
    if missing:
        raise SystemExit(f"{name}: not solved at De {missing}")
    return sum(solution.seconds for De, solution in found if De in counted)


def _transient_seconds(study, geometry, De: float) -> float:
    names = "Transient", "flow_maker", "time_options"
    Transient, flow_maker, time_options = map(_of_package, names)
    lambda_1 = study.deborah_longest_mode(De)
    simulation = Transient(geometry, flow_maker(study, De), lambda_1, time_options(study, De))
    return sum(instant.seconds for instant in simulation.run(10 * lambda_1))


def measured(name: str, checkout: Path) -> float:
    """The same in a process of its own, with the package of a checkout."""
    environment = os.environ | {
        "PYTHONPATH": str(checkout / "scripts"),
        "OPENBLAS_NUM_THREADS": "1",
    }
    command = [sys.executable, "-P", __file__, "--worker", name]  # -P: this folder is not first
    run = subprocess.run(command, env=environment, capture_output=True, text=True)
    if run.returncode:
        raise SystemExit(run.stderr)
    return json.loads(run.stdout.splitlines()[-1])


def compared(names: list[str], before: Path) -> Iterator[str]:
    """A line for each work."""
    for name in names:
        old, new = (measured(name, checkout) for checkout in (before, ROOT))
        yield f"{name:32s} {old:8.2f} {new:8.2f} {new / old:8.2f}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("before", nargs="?", type=Path, help="checkout to compare with")
    parser.add_argument("--works", nargs="+", choices=WORKS, default=list(WORKS))
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--worker", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.worker:
        print(json.dumps(seconds(arguments.worker)))
    elif arguments.before:
        print(f"{'CPU s':32s} {'before':>8s} {'now':>8s} {'ratio':>8s}")
        for _ in range(arguments.rounds):
            for line in compared(arguments.works, arguments.before):
                print(line, flush=True)
    else:
        parser.error("name the checkout to compare with")
