r"""What the direct numerical simulation costs, on one thread, and where the time goes.

    python scripts/tools/benchmark.py   # all triplets of the demo, and one sphere

solves triplets of a study, a pair and a sphere, then one sphere up to De = 5 with the error of its
velocity, and measures start-up. CPU seconds throughout. `estimate_cost.py` reads what this writes:

    python scripts/tools/benchmark.py --configfile config/config.yaml config/paper.yaml \
        --geometries 3 --output scripts/viscotrain/jobs/measured_costs.csv
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported

import contextlib
import math
import resource
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest import mock

import numpy as np
import pandas as pd

from viscotrain.config import stages
from viscotrain.config.names import geometry_name
from viscotrain.config.reading import load_study
from viscotrain.config.study import Study
from viscotrain.flow import discretisation, newton, refinement
from viscotrain.flow.batches import BatchedForm, VectorFactors
from viscotrain.flow.process import use_one_core
from viscotrain.jobs.command import reporting
from viscotrain.studies import dns
from viscotrain.studies.resolution import with_sizes

ROOT = Path(__file__).parents[2]
SPHERE_DEBORAHS = (0.1, 0.5, 1.0, 2.0, 5.0)
# U/Ubar of one sphere, beta = 0.2, converged by two independent codes to the digits given.
CONVERGED = {0.5: 1.829855, 1.0: 1.770559, 2.0: 1.695214, 5.0: 1.653117}
FINER = 0.7  # element sizes of the finer solution over those of the study, at one order more
FINER_ACCURACY = 0.1  # of the finer solution over that of the study
MORE_UNKNOWNS = 4  # that the finer solution may have
ASKED = {"triplet": 4.0, "sphere": 7.0, "sphere error": 4e-6}  # CPU s, CPU s, Ubar
PARTS = {  # functions by what they do; times of those called inside are not in their own
    "mesh": [(dns, "make_mesh")],
    "spaces and forms": [(discretisation.Flow, "__init__")],
    "residual": [(BatchedForm, "Apply")],
    "linearisation": [(BatchedForm, "AssembleLinearization")],
    "factorisation": [(newton, "factorise")],
    "back substitution": [(VectorFactors, "solve"), (VectorFactors, "solve_transposed")],
    "error estimate": [(refinement, "estimate"), (refinement, "refined")],
}

# ---------------------------------------------------------------------------------- stopwatches


class Stopwatch:
    """CPU seconds and calls by name of what was done, measured around the package's functions."""

    def __init__(self):
        self.seconds: dict[str, float] = defaultdict(float)

    def timed(self, name: str, function: Callable) -> Callable:
        """The function, with its time added under a name."""

        def measured(*args, **kwargs):
            started, inside = time.process_time(), sum(self.seconds.values())
            try:
                return function(*args, **kwargs)
            finally:
                inside = sum(self.seconds.values()) - inside
                self.seconds[name] += time.process_time() - started - inside

        return measured

    @contextlib.contextmanager
    def watching(self) -> Iterator[None]:
        """Measure what the package does meanwhile."""
        with contextlib.ExitStack() as patches:
            for name, functions in PARTS.items():
                for owner, function in functions:
                    timed = self.timed(name, getattr(owner, function))
                    patches.enter_context(mock.patch.object(owner, function, timed))
            yield


# --------------------------------------------------------------------------------- measurements


def geometry_costs(study: Study, sp: float, sf: float, watch: Stopwatch) -> Iterator[dict]:
    """A row per Deborah number of one geometry."""
    before = math.nan
    with watch.watching():
        flow = stages.flow(study)
        for _, solution in dns.solutions(flow, dns.triplet(flow, sp, sf)):
            yield {
                "sp": sp,
                "sf": sf,
                "deborah_before": before,
                "deborah": solution.deborah,
                "velocity_order": study.dns.velocity_order,
                "modes": len(study.dimensionless_fluid.modes),
                "elements": solution.flow.mesh.ne,
                "unknowns": solution.flow.space.ndof,
                "iterations": solution.iterations,
                "solved": solution.solved,
                "accurate": solution.accurate,
                "cpu_seconds": round(solution.seconds, 3),
                "velocity": solution.velocities.get("middle", math.nan),
                "estimated_error": solution.estimated_error,
            }
            before = solution.deborah


def sample(study: Study, number: int | None) -> list[tuple[float, float]]:
    """Triplets of the study's grid, all or as many as asked for, evenly spread; a pair, a sphere.

    The pair has the distance in the middle of the table.
    """
    triplets = [g for g in study.geometries if all(map(math.isfinite, g))]
    if number is not None and number < len(triplets):
        places = np.linspace(0, len(triplets) - 1, number).round().astype(int)
        triplets = [triplets[k] for k in places]
    distances = [s for s in study.table.sp if math.isfinite(s)]
    pair = distances[len(distances) // 2], math.inf
    return [*triplets, pair, (math.inf, math.inf)]


def finer(study: Study) -> Study:
    """The study with smaller elements and a higher order, whose solution is taken as exact."""
    settings = study.dns
    change = with_sizes(settings, FINER) | {
        "velocity_order": settings.velocity_order + 1,
        "accuracy": settings.accuracy * FINER_ACCURACY,
        "relative_accuracy": settings.relative_accuracy * FINER_ACCURACY,
        "max_velocity_order": settings.max_velocity_order + 1,
        "max_unknowns": settings.max_unknowns * MORE_UNKNOWNS,
    }
    return study.model_copy(update={"dns": settings.model_copy(update=change)})


def sphere(study: Study) -> pd.DataFrame:
    """One sphere of the study's fluid: cost and error of U at every De of `SPHERE_DEBORAHS`."""
    values = study.deborah.model_copy(
        update={"values": SPHERE_DEBORAHS, "definition": "longest_mode"}
    )
    study = study.model_copy(update={"deborah": values})
    found, exact = (
        pd.DataFrame(geometry_costs(variant, math.inf, math.inf, Stopwatch()))
        for variant in (study, finer(study))
    )
    return found.assign(
        error=(found.velocity - exact.velocity).abs(),
        error_to_published=(found.velocity - found.deborah.map(CONVERGED)).abs(),
    )


def start_up() -> float:
    """CPU seconds of a Python process that imports what a dns job imports."""

    def used() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = used()
    command = [sys.executable, "-c", "import viscotrain.studies.dns"]
    subprocess.run(command, check=True, cwd=ROOT / "scripts")
    return used() - before


# --------------------------------------------------------------------------------------- report


def verdict(measured: float, asked: float) -> str:
    """Words for a limit."""
    return f"asked: at most {asked:g}, {'met' if measured <= asked else 'NOT MET'}"


def report_geometries(name: str, costs: pd.DataFrame):
    """Print the cost of geometries per number of spheres and Deborah number."""
    print(f"\nStudy {name}: CPU seconds of a geometry")
    print("spheres      De  order  elements  not accurate   median  maximum")
    for (count, De), rows in costs.groupby([_spheres(costs), "deborah"]):
        print(
            f"{count:7d}{De:8g}  {rows.velocity_order.max():5d}  {rows.elements.median():8.0f}"
            f"  {(~rows.accurate).sum():5d} of {len(rows):3d}  {rows.cpu_seconds.median():7.2f}"
            f"  {rows.cpu_seconds.max():7.2f}"
        )
    elastic = costs[(costs.deborah > 0) & (_spheres(costs) == 3)].cpu_seconds
    if len(elastic):
        print(
            f"De > 0, triplets: median {elastic.median():.2f}, maximum {elastic.max():.2f}"
            f" ({verdict(elastic.median(), ASKED['triplet'])} for the demo)"
        )


def _spheres(costs: pd.DataFrame) -> pd.Series:
    return (1 + np.isfinite(costs[["sp", "sf"]]).sum(axis=1)).rename("spheres")


def report_sphere(costs: pd.DataFrame):
    """Print cost and error of one sphere."""
    print("\nOne sphere\n      De  elements  CPU s          U     error  estimated  to published")
    for row in costs.itertuples():
        print(
            f"{row.deborah:8g}  {row.elements:8d}  {row.cpu_seconds:5.2f}  {row.velocity:.7f}"
            f"  {row.error:8.1e}  {row.estimated_error:9.1e}  {row.error_to_published:12.1e}"
        )
    total, worst = costs.cpu_seconds.sum(), costs.error.max()
    print(f"solving: {total:.2f} CPU s ({verdict(total, ASKED['sphere'])})")
    print(f"largest error: {worst:.1e} ({verdict(worst, ASKED['sphere error'])})")


def report_parts(watch: Stopwatch, geometries: int, solving: float, imports: float):
    """Print where the time of a job goes."""
    inside = {name: seconds / geometries for name, seconds in watch.seconds.items()}
    per_geometry = solving / geometries
    # The first mesh and the first spaces are made before the first Deborah number's clock starts.
    total = max(per_geometry, sum(inside.values())) + imports
    rest = total - imports - sum(inside.values())
    print("\nWhere the time of a job goes, CPU seconds per geometry")
    for name, seconds in {"start-up (imports)": imports, **inside, "rest": max(rest, 0.0)}.items():
        print(f"  {name:<20s} {seconds:7.2f}  {seconds / total:6.1%}")
    print(f"  {'total':<20s} {total:7.2f}")


def geometries_of(study: Study, geometries: int | None, imports: float) -> pd.DataFrame:
    """Measure and print the cost of geometries of a study."""
    watch, rows = Stopwatch(), []
    chosen = sample(study, geometries)
    for sp, sf in chosen:
        new = list(geometry_costs(study, sp, sf, watch))
        print(f"{geometry_name(sp, sf)}: {sum(row['cpu_seconds'] for row in new):.1f} CPU s")
        rows += new
    costs = pd.DataFrame(rows)
    report_geometries(study.study, costs)
    report_parts(watch, len(chosen), costs.cpu_seconds.sum(), imports)
    return costs


def main(studies: list[Study], geometries: int | None, output: str | None):
    """Measure, print, and write the costs; the sphere is one of the first study's fluid."""
    use_one_core()
    imports = start_up()
    costs = pd.concat([geometries_of(study, geometries, imports) for study in studies])
    if output:
        costs.drop(columns=["velocity", "estimated_error"]).to_csv(output, index=False)
        print(f"\nwritten: {output}")
    report_sphere(sphere(studies[0]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    default = [ROOT / "config" / "config.yaml"]
    parser.add_argument(
        "--configfile", nargs="+", default=default, help="configs of studies; the demo's"
    )
    parser.add_argument("--geometries", type=int, help="number of triplets of each; all")
    parser.add_argument("--output", help="CSV file for the costs of the geometries")
    with reporting():
        arguments = parser.parse_args()
        studies = [load_study(path) for path in arguments.configfile]
        main(studies, arguments.geometries, arguments.output)
