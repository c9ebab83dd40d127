"""Copy what a reader wants of a finished study into the repository: table, words and figures.

Two pictures of a film are drawn beside the folder: both ends of the channel, and the first and the
last frame of the camera that moves along.

Usage: python scripts/tools/keep_study.py results/paper docs/study
"""

import argparse
import shutil
from pathlib import Path

import numpy as np
import xarray as xr
from PIL import Image

from viscotrain.drawing import movies
from viscotrain.drawing.style import STYLE

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
FILM, WIDTH, FRAME_RATE = "De62_phi0.006", 1280, 25.0  # of which there are pictures in docs
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
    draw_film(results, folder.parent)
    print(f"{len(KEPT)} files and {len(figures)} figures, {size / 1e6:.1f} MB, in {folder}/")


def draw_film(results: Path, folder: Path):
    """Pictures of a film: what is seen at both ends, and its first and last moving frame."""
    film = xr.load_dataset(results / "movies" / f"{FILM}.nc")
    units = xr.load_dataset(results / "units.nc")
    ends = movies.stations(film.isel(station=[0, -1]), units).figure
    ends.savefig(folder / f"film_{FILM}.png", dpi=STYLE["savefig.dpi"], metadata={"Software": None})
    data = movies.labelled(film, units)
    first, *_, last = movies.moving_frames(data, width=WIDTH, frame_rate=FRAME_RATE)
    both = Image.fromarray(np.concatenate([first, last]))
    both.convert("RGB").quantize(64).save(folder / f"moving_{FILM}.png", optimize=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("results", type=Path, help="folder of the study, verified")
    parser.add_argument("folder", type=Path, help="where to")
    given = parser.parse_args()
    main(given.results, given.folder)
