"""Write the tables of docs/results.md from the files of finished studies.

    python scripts/tools/generate_results_docs.py results/demo results/tiny

A place in the page names the files that it is about: `<!-- variables of trains/*.nc: begin -->`.
The first such file in the folders says which variables there are: dimensions, unit and meaning; or
which columns (`<!-- columns of design/design.csv: begin -->`). `<!-- figures: begin -->` is of all
figures.
`--check` writes nothing and exits with 1 when the page is out of step.
"""

import argparse
import csv
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import xarray as xr
from csv_columns import MEANINGS, OF_FILES, UNITS
from figure_captions import figures
from marked_blocks import filled, write

PAGE = Path(__file__).parents[2] / "docs" / "results.md"
PLACE = re.compile(r"<!-- ((variables|columns) of (\S+)): begin -->")
KINDS = ("halfwidth", "model_error", "injected", "poisson", "low", "high")  # of a statistic
HEAD = [("variable", "dimensions", "unit", "meaning"), ("---",) * 4]
COLUMNS = [("column", "unit", "meaning"), ("---",) * 3]


def main(folders: Sequence[Path], check: bool):
    """Fill every place of the page."""
    text = PAGE.read_text(encoding="utf-8")
    blocks, words = {}, dict(MEANINGS)
    places = PLACE.findall(text)
    for name, kind, pattern in places:
        if kind == "variables":
            with xr.open_dataset(first(pattern, folders)) as dataset:
                blocks[name] = table(dataset)
            words = meanings(dataset) | words
    for name, kind, pattern in places:
        if kind == "columns":
            path = first(pattern, folders)
            own = OF_FILES.get(path.stem) or beside(path)
            blocks[name] = columns(path, words | own)
    blocks["figures"] = figures(folders)
    command = f"python scripts/tools/generate_results_docs.py {' '.join(map(str, folders))}"
    write({PAGE: filled(text, blocks)}, check, command)


def first(pattern: str, folders: Sequence[Path]) -> Path:
    """The first file of a pattern."""
    for folder in folders:
        for path in sorted(folder.glob(pattern)):
            return path
    raise SystemExit(f"no {pattern} in {', '.join(map(str, folders))}")


def meanings(dataset: xr.Dataset) -> dict[str, str]:
    """What the variables of a dataset are, by their names."""
    named = {str(name): each.attrs.get("long_name") for name, each in dataset.variables.items()}
    return {name: words for name, words in named.items() if words}


def beside(path: Path) -> dict[str, str]:
    """Meanings of the dataset of the same name, if there is one."""
    same = path.with_suffix(".nc")
    if not same.exists():
        return {}
    with xr.open_dataset(same) as dataset:
        return meanings(dataset)


def columns(path: Path, words: Mapping[str, str]) -> str:
    """A Markdown table of the columns of a CSV file; statistics and their errors share a row.

    Args:
        path: The file.
        words: Meanings by the names of columns or variables, with or without the unit.

    Raises:
        ValueError: A column has no meaning.
    """
    with path.open(newline="", encoding="utf-8") as file:
        names = next(csv.reader(file))
    rows = [*COLUMNS]
    for name in (name for name in names if not _base(name, names)):
        end = next((end for end in UNITS if name.endswith(end)), "")
        meaning = words.get(name) or words.get(name.removesuffix(end))
        if meaning is None:
            raise ValueError(f"{path.name}: no meaning of the column {name}")
        more = [f"`_{kind}`" for kind in KINDS if f"{name}_{kind}" in names]
        meaning += f"; also {', '.join(more)}" if more else ""
        rows.append((f"`{name}`", UNITS.get(end, ""), meaning.replace("|", r"\|")))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def table(dataset: xr.Dataset) -> str:
    """A Markdown table of the variables; statistics and their errors share a row."""
    own = {str(name): variable for name, variable in dataset.variables.items()}
    names = [name for name in own if not _base(name, own)]
    lines = [*HEAD, *(_row(name, own) for name in names)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _base(name: str, own: Collection[str]) -> str:
    """The statistic of which this is an error, or what the injection makes; else empty."""
    for kind in KINDS:
        if name.endswith(f"_{kind}") and name.removesuffix(f"_{kind}") in own:
            return name.removesuffix(f"_{kind}")
    return ""


def _row(name: str, own: dict) -> tuple[str, ...]:
    variable = own[name]
    more = [f"`_{kind}`" for kind in KINDS if f"{name}_{kind}" in own]
    meaning = variable.attrs.get("long_name", "") + _flags(variable)
    meaning += f"; also {', '.join(more)}" if more else ""
    dimensions = ", ".join(map(str, variable.dims))
    return f"`{name}`", dimensions, variable.attrs.get("units", ""), meaning.replace("|", r"\|")


def _flags(variable: xr.Variable) -> str:
    """What the values of a flag mean."""
    if "flag_values" not in variable.attrs:
        return ""
    words = variable.attrs["flag_meanings"].split()
    values = variable.attrs["flag_values"]
    return ": " + ", ".join(
        f"{value} {word.replace('_', ' ')}" for value, word in zip(values, words, strict=True)
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folders", nargs="+", type=Path, help="results of finished studies")
    parser.add_argument("--check", action="store_true", help="compare only, write nothing")
    given = parser.parse_args()
    main(given.folders, given.check)
