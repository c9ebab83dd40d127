r"""What a run made: points solved, holes, accuracy, trains, where the figures are.

python scripts/summary.py OUTPUT --table TABLE --units UNITS --trains TRAINS... \
    --measured MEASURED... --timing CSV... --figures PNG... --movies FOLDER... --maps MAP \
    --droplets ENCAPSULATION --spread SPREAD --conditions CONDITIONS
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain import files
from viscotrain.jobs.entry import Job, Result, run, taken
from viscotrain.studies import overview


def main(
    job: Job,
    summary: Result,
    table: Annotated[Path, taken("velocity table", named=True)],
    units: Annotated[Path, taken("physical units of the study, units.nc", named=True)],
    conditions: Annotated[Path | None, taken("operating conditions", named=True)] = None,
    trains: Annotated[Sequence[Path], taken("files of the trains", named=True)] = (),
    measured: Annotated[Sequence[Path], taken("files of measured.py", named=True)] = (),
    timing: Annotated[Sequence[Path], taken("CSV files of the dns stage", named=True)] = (),
    spread: Annotated[Sequence[Path], taken("spread of a fit", named=True)] = (),
    figures: Annotated[Sequence[Path], taken("PNG files", named=True)] = (),
    movies: Annotated[Sequence[Path], taken("folders of movies", named=True)] = (),
    maps: Annotated[Sequence[Path], taken("design map", named=True)] = (),
    droplets: Annotated[Path | None, taken("encapsulation.nc", named=True)] = None,
):
    """Write the summary and print it."""
    lines = overview.of_table(table, timing)
    lines += [*overview.of_trains(trains, maps, units), *overview.of_measured(measured)]
    lines += overview.of_conditions(conditions)
    lines += [*overview.of_droplets(droplets), *overview.of_fits(spread)]
    lines += overview.of_pictures(figures, movies)
    text = "\n".join(lines)
    files.write_text(text + "\n", summary)
    print(text)


run(main)
