r"""What a run made: points solved, holes, accuracy, trains, where the figures are.

python scripts/summary.py --table TABLE --trains TRAINS... --timing CSV... \
    --figures PNG... --movies FOLDER... --maps MAP OUTPUT
"""

from pathlib import Path

import pandas as pd
import xarray as xr

from viscotrain.jobs.entry import Job, made, run, taken
from viscotrain.table import attributes, description, points
from viscotrain.trains import design_map, repeats


def of_table(path: Path, timing: list[Path]) -> list[str]:
    """Points, errors and times."""
    table = xr.load_dataset(path)
    total, missing = points.count(table), len(list(points.holes(table)))
    twins = int(table["origin"].isin([attributes.SAME_PAIR, attributes.MIRROR]).sum())
    shared = f"; {twins} by the simulation of the same flow" if twins else ""
    if between := points.interpolated_points(table):
        shared += f"; {between} interpolated between every second distance"
    cpu = sum(pd.read_csv(file)["cpu_seconds"].sum() for file in timing)
    return [
        str(table.attrs["title"]),
        f"  points solved   {total - missing} of {total}, {missing} holes{shared}",
        f"  points not accurate: {points.inaccurate_points(table)}, "
        f"by the fall-back: {points.fallback_points(table)}, "
        f"largest estimated error {description.largest_error(table)}",
        f"  interpolation   {description.largest_check_error(table)}",
        f"  simulation      {cpu:.0f} CPU s in {len(timing)} jobs",
        f"  table           {path}",
    ]


def of_pictures(figures: list[Path], movies: list[Path]) -> list[str]:
    """How many there are, and where."""
    lines = [f"  figures         {len(figures)} in {figures[0].parent}/"] if figures else []
    for folder in movies:
        count = sum(path.suffix in (".mp4", ".gif") for path in folder.iterdir())
        lines.append(f"  movies          {count} in {folder}/")
    return lines


def main(job: Job, table, trains, timing, figures, movies, maps, summary: Path):
    """Write the summary and print it."""
    lines = of_table(table, timing)
    for what, files, headline in (
        ("train     ", trains, repeats.headline),
        ("design map", maps, design_map.headline),
    ):
        for path in files:
            lines += [f"  {what}      {path}", f"{'':18}{headline(xr.load_dataset(path))}"]
    text = "\n".join([*lines, *of_pictures(figures, movies)])
    summary.write_text(text + "\n", encoding="utf-8")
    print(text)


run(
    main,
    [
        taken("table", "velocity table", flag="--table"),
        taken("trains", "files of the trains", flag="--trains", many=True, optional=True),
        taken("timing", "CSV files of the dns stage", flag="--timing", many=True, optional=True),
        taken("figures", "PNG files", flag="--figures", many=True, optional=True),
        taken("movies", "folders of movies", flag="--movies", many=True, optional=True),
        taken("maps", "design map", flag="--maps", many=True, optional=True),
        made("summary", "text file to write"),
    ],
)
