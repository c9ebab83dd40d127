"""Write the tables of docs/results.md from the files of finished studies.

    python scripts/tools/generate_results_docs.py results/demo results/tiny

A place in the page names the files that it is about: `<!-- variables of trains/*.nc: begin -->`.
The first such file in the folders says which variables there are: dimensions, unit and meaning.
`--check` writes nothing and exits with 1 when the page is out of step.
"""

import argparse
import re
from collections.abc import Sequence
from pathlib import Path

import xarray as xr
from marked_blocks import filled, write

PAGE = Path(__file__).parents[2] / "docs" / "results.md"
PLACE = re.compile(r"<!-- (variables of (\S+)): begin -->")
KINDS = ("halfwidth", "model_error", "injected")  # of a statistic
HEAD = [("variable", "dimensions", "unit", "meaning"), ("---",) * 4]


def main(folders: Sequence[Path], check: bool):
    """Fill every place of the page."""
    text = PAGE.read_text(encoding="utf-8")
    blocks = {name: table(first(pattern, folders)) for name, pattern in PLACE.findall(text)}
    command = f"python scripts/tools/generate_results_docs.py {' '.join(map(str, folders))}"
    write({PAGE: filled(text, blocks)}, check, command)


def first(pattern: str, folders: Sequence[Path]) -> xr.Dataset:
    """The first file of a pattern."""
    for folder in folders:
        for path in sorted(folder.glob(pattern)):
            with xr.open_dataset(path) as dataset:
                return dataset
    raise SystemExit(f"no {pattern} in {', '.join(map(str, folders))}")


def table(dataset: xr.Dataset) -> str:
    """A Markdown table of the variables; statistics and their errors share a row."""
    own = {str(name): variable for name, variable in dataset.variables.items()}
    names = [name for name in own if not _base(name, own)]
    lines = [*HEAD, *(_row(name, own) for name in names)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _base(name: str, own: dict) -> str:
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
