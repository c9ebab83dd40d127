"""What a run made: points solved, holes, accuracy, trains, where the figures are.

From the command line:
python scripts/summary.py --table TABLE --trains TRAINS... --timing CSV... \
    --figures PNG... --movies FOLDER... --maps MAP OUTPUT
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import xarray as xr

from viscotrain.jobs.command import reporting
from viscotrain.table import attributes, description, points
from viscotrain.trains import design_map
from viscotrain.trains.repeats import headline


def main(
    velocity_table: str,
    trains: Sequence[str],
    timing: Sequence[str],
    figures: Sequence[str],
    movies: Sequence[str],
    maps: Sequence[str],
    output: str,
    config: str | None = None,
):
    """Write the summary and print it; also the resolved config, as the table holds it."""
    velocities = xr.load_dataset(velocity_table)
    total, missing = velocities["status"].size, len(list(points.holes(velocities)))
    twins = int((velocities["origin"] != attributes.ITSELF).sum()) if "origin" in velocities else 0
    shared = f"; {twins} by the simulation of the same flow" if twins else ""
    cpu = sum(pd.read_csv(path)["cpu_seconds"].sum() for path in timing)
    lines = [
        str(velocities.attrs["title"]),
        f"  points solved   {total - missing} of {total}, {missing} holes{shared}",
        f"  points not accurate: {points.inaccurate_points(velocities)}, "
        f"by the fall-back: {points.fallback_points(velocities)}, "
        f"largest estimated error {description.largest_error(velocities)}",
        f"  interpolation   {description.largest_check_error(velocities)}",
        f"  simulation      {cpu:.0f} CPU s in {len(timing)} jobs",
        f"  table           {velocity_table}",
    ]
    for path in trains:
        lines += [
            f"  train           {path}",
            f"                  {headline(xr.load_dataset(path))}",
        ]
    for path in maps:
        lines += [
            f"  design map      {path}",
            f"                  {design_map.headline(xr.load_dataset(path))}",
        ]
    if figures:
        lines.append(f"  figures         {len(figures)} in {Path(figures[0]).parent}/")
    for folder in movies:
        count = sum(path.suffix in (".mp4", ".gif") for path in Path(folder).iterdir())
        lines.append(f"  movies          {count} in {folder}/")
    text = "\n".join(lines)
    Path(output).write_text(text + "\n", encoding="utf-8")
    print(text)
    if config:
        Path(config).write_text(velocities.attrs["study_config"], encoding="utf-8")


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--table", required=True, help="velocity table")
    parser.add_argument("--trains", nargs="*", default=[], help="netCDF files of the trains")
    parser.add_argument("--timing", nargs="*", default=[], help="CSV files of the dns stage")
    parser.add_argument("--figures", nargs="*", default=[], help="PNG files")
    parser.add_argument("--movies", nargs="*", default=[], help="folders of movies")
    parser.add_argument("--maps", nargs="*", default=[], help="design map")
    parser.add_argument("output", help="text file to write")
    a = parser.parse_args()
    with reporting():
        main(a.table, a.trains, a.timing, a.figures, a.movies, a.maps, a.output)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(
            snakemake.input.table,  # noqa: F821
            snakemake.input.trains,  # noqa: F821
            snakemake.input.timing,  # noqa: F821
            snakemake.input.figures,  # noqa: F821
            snakemake.input.movies,  # noqa: F821
            snakemake.input.design_map,  # noqa: F821
            *snakemake.output,  # noqa: F821
        )
elif __name__ == "__main__":
    _command_line()
