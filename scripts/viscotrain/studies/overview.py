"""What a run made, in words: points solved, holes, accuracy, trains, where pictures are."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from viscotrain import files
from viscotrain.studies import fit_spread
from viscotrain.table import attributes, description, points
from viscotrain.trains import design_map, encapsulation, operating_conditions, repeats
from viscotrain.trains.measured import headline as measured_headline


def of_table(path: Path, timing: Sequence[Path]) -> list[str]:
    """Points and errors of a velocity table, and where the CPU times of its simulations are."""
    table = files.read_dataset(path)
    total, missing = points.count(table), len(list(points.holes(table)))
    twins = int(table["origin"].isin([attributes.SAME_PAIR, attributes.MIRROR]).sum())
    shared = f"; {twins} by the simulation of the same flow" if twins else ""
    if between := points.interpolated_points(table):
        shared += f"; {between} from those on lines of the grid"
    for file in timing:  # a damaged one is named here
        files.read_csv(file, ["cpu_seconds"])
    return [
        str(table.attrs["title"]),
        f"  points solved   {total - missing} of {total}, {missing} holes{shared}",
        f"  points not accurate: {points.inaccurate_points(table)}, "
        f"by the fall-back: {points.fallback_points(table)}, "
        f"largest estimated error {description.largest_error(table)}",
        f"  interpolation   {description.largest_check_error(table)}",
        f"  distances held  {description.memory_headline(table)}",
        f"  simulation      {len(timing)} files, CPU times in {timing[0].parent}/"
        if timing
        else f"  simulation      none; {table.attrs.get('given_table', 'CPU times not given')}",
        f"  table           {path}",
    ]


def of_trains(trains: Sequence[Path], maps: Sequence[Path], units: Path) -> Iterator[str]:
    """The headlines of trains and design maps."""
    time = files.read_dataset(units)["time"]
    for path in trains:
        train = files.read_dataset(path)
        yield f"  train           {path}"
        seconds = float(time.sel(deborah=float(train["deborah"])))
        yield from (f"{'':18}{line}" for line in repeats.headline(train, seconds))
    for path in maps:
        yield f"  design map      {path}"
        yield from (f"{'':18}{line}" for line in design_map.headline(files.read_dataset(path)))


def of_conditions(path: Path | None) -> Iterator[str]:
    """The numbers of all conditions and the limits that they exceed."""
    if path is not None:
        yield f"  conditions      {path}"
        found = files.read_dataset(path)
        yield from (f"{'':4}{line}" for line in operating_conditions.summary(found))


def of_measured(measured: Sequence[Path]) -> Iterator[str]:
    """The headlines of measured spacings beside those of trains."""
    for path in measured:
        yield f"  measured        {path}"
        yield from (f"{'':18}{line}" for line in measured_headline(files.read_dataset(path)))


def of_droplets(path: Path | None) -> Iterator[str]:
    """The headline of beads in droplets."""
    if path is not None:
        yield f"  droplets        {path}"
        yield from (f"{'':18}{line}" for line in encapsulation.headline(files.read_dataset(path)))


def of_fits(spreads: Sequence[Path]) -> Iterator[str]:
    """What the uncertainty of a fit does."""
    for path in spreads:
        yield f"  fitted fluid    {path}"
        yield from (f"{'':18}{line}" for line in fit_spread.headline(files.read_dataset(path)))


def of_pictures(figures: Sequence[Path], movies: Sequence[Path]) -> list[str]:
    """How many figures and movies there are, and where."""
    lines = [f"  figures         {len(figures)} in {figures[0].parent}/"] if figures else []
    for folder in movies:
        count = sum(path.suffix in (".mp4", ".gif") for path in folder.iterdir())
        lines.append(f"  movies          {count} in {folder}/")
    return lines
