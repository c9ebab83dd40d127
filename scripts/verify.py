"""Convergence of the direct numerical simulation: default settings against finer ones.

    python scripts/verify.py                # about half an hour on one core

solves a few triplets of the study's fluid (`config/config.yaml`) with the default settings, with
smaller elements, with a higher order and with a longer box, and writes the relative velocities and
their changes to `tests/verification/convergence.csv`. The Deborah numbers up to 5 are solved as in
a study that goes no further, and again, up to 62, as in a study that does.
"""

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy and ngsolve are imported

from pathlib import Path

import numpy as np
import pandas as pd
from ngsolve import SetNumThreads

from viscotrain.config import Study, load_study
from viscotrain.provenance import PHYSICS, digest
from viscotrain.simulation import solutions, triplet

ROOT = Path(__file__).parents[1]
GEOMETRIES = [(1.1, 1.1), (1.5, 2.5), (4.5, 1.5)]
DEBORAHS = {"moderate": (0.0, 1.0, 5.0), "high": (0.0, 1.0, 5.0, 31.0, 62.0)}
FINER = 0.7  # element sizes over the default ones


def variants(study: Study) -> dict[str, Study]:
    """The study with its own settings and with finer ones."""
    dns, high = study.dns, study.dns.high_deborah

    def finer(section) -> dict:
        return {
            "sphere_elements": round(section.sphere_elements / FINER),
            "axis_size": section.axis_size * FINER,
            "wall_size": section.wall_size * FINER,
        }

    def higher(section) -> dict:
        orders = {name for name in type(section).model_fields if name.endswith("velocity_order")}
        return {name: getattr(section, name) + 1 for name in orders}

    def changed(change) -> Study:
        raised = high.model_copy(update=change(high))
        return study.model_copy(
            update={"dns": dns.model_copy(update=change(dns) | {"high_deborah": raised})}
        )

    longer = dns.model_copy(update={"margin": dns.margin + 1})
    return {
        "default": study,
        "smaller elements": changed(finer),
        "higher order": changed(higher),
        "longer box": study.model_copy(update={"dns": longer}),
    }


def relative_velocities(study: Study, sp: float, sf: float, settings: str, mode: str):
    """One row per Deborah number of a geometry, as it comes."""
    for De, solution in solutions(study, triplet(study, sp, sf)):
        U = np.array(list(solution.velocities.values()) if solution.solved else [np.nan] * 3)
        yield {
            "study": mode,
            "sp": sp,
            "sf": sf,
            "deborah": De,
            "settings": settings,
            "elements": solution.flow.mesh.ne,
            "unknowns": solution.flow.space.ndof,
            "middle_minus_trailing": U[1] - U[0],
            "leading_minus_middle": U[2] - U[1],
            "cpu_seconds": round(solution.seconds, 1),
        }


def with_changes(table: pd.DataFrame) -> pd.DataFrame:
    """Add the largest change of a relative velocity from the default settings, two ways."""
    point = ["study", "sp", "sf", "deborah"]
    pairs = ["middle_minus_trailing", "leading_minus_middle"]
    default = table[table.settings == "default"].set_index(point)[pairs]
    reference = default.loc[pd.MultiIndex.from_frame(table[point])].to_numpy()
    change = np.abs(table[pairs].to_numpy() - reference).max(axis=1)
    return table.assign(change=change, change_relative=change / np.abs(reference).max(axis=1))


def main(output: Path):
    """Solve everything; the file grows as results come."""
    SetNumThreads(1)
    base = load_study(ROOT / "config" / "config.yaml")
    output.parent.mkdir(parents=True, exist_ok=True)
    rows = []
    for mode, deborahs in DEBORAHS.items():
        values = base.deborah.model_copy(update={"values": deborahs})
        study = base.model_copy(update={"deborah": values})
        for sp, sf in GEOMETRIES:
            for settings, variant in variants(study).items():
                for row in relative_velocities(variant, sp, sf, settings, mode):
                    rows.append(row)
                    print(row, flush=True)
                table = with_changes(pd.DataFrame(rows))
                header = f"# made by scripts/verify.py; physics digest {digest(PHYSICS)}\n"
                text = table.to_csv(index=False, float_format="%.9g")
                output.write_text(header + text, encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    default_output = ROOT / "tests" / "verification" / "convergence.csv"
    parser.add_argument("output", nargs="?", type=Path, default=default_output)
    main(parser.parse_args().output)
