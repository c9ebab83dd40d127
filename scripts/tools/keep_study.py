"""Copy what a reader wants of a finished study into the repository: table, words and figures.

Usage: python scripts/tools/keep_study.py results/paper docs/study
"""

import argparse
import shutil
from pathlib import Path

KEPT = {
    "table/velocity_table.nc": 1e6,  # most bytes
    "summary.txt": 1e5,
    "verification/accuracy.md": 1e5,
}
FIGURES = (
    *("schematic", "rheology", "pair_velocity", "stress_field"),
    *(f"relative_velocities_De{De}" for De in (5, 31, 62)),
    *("train_De5_phi0.004", "spacing_De5_phi0.004", "stations_De5_phi0.004"),
    *(f"spacing_De{De}_phi{phi}" for De in (31, 62) for phi in (0.006, 0.01)),
    *("spacing_law", "design_map", "order"),
)
CHECKS = ("closure", "start_up")  # figures of the verification
MOST_BYTES_OF_FIGURES = 5e6


def main(results: Path, folder: Path):
    """Copy, and refuse what is too large for a repository."""
    figures = [results / "figures" / f"{name}.png" for name in FIGURES]
    figures += [results / "verification" / f"{name}.png" for name in CHECKS]
    size = sum(path.stat().st_size for path in figures)
    if size > MOST_BYTES_OF_FIGURES:
        raise SystemExit(f"figures have {size:.2g} bytes; allowed: {MOST_BYTES_OF_FIGURES:.2g}")
    folder.mkdir(parents=True, exist_ok=True)
    for name, most in KEPT.items():
        path = results / name
        if path.stat().st_size > most:
            raise SystemExit(f"{path} has {path.stat().st_size} bytes; allowed: {most:.2g}")
        shutil.copy2(path, folder)
    for path in figures:
        shutil.copy2(path, folder)
    print(f"{len(KEPT)} files and {len(figures)} figures, {size / 1e6:.1f} MB, in {folder}/")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("results", type=Path, help="folder of the study, verified")
    parser.add_argument("folder", type=Path, help="where to")
    given = parser.parse_args()
    main(given.results, given.folder)
