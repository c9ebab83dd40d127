"""Take the accuracy statements of README and docs from the verification of a study.

    python scripts/tools/generate_accuracy_docs.py results/demo/verification

keeps the statement and the numbers behind it in `tests/verification/`, and puts the statement into
`docs/accuracy.md`, that of `whole_channel.py` into `docs/memory.md`, and what both say into five
lines of README.md. Without an argument it puts there what is kept; with `--check` it compares only.
"""

import argparse
import re
import shutil
from pathlib import Path

from marked_blocks import filled, write

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "tests" / "verification"
STATEMENT, OUTLET = KEPT / "accuracy.md", KEPT / "memory" / "outlet.md"
NUMBER = re.compile(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?")


def main(folder: Path | None, check: bool):
    """Keep the results of a verification, if there are new ones, and write the pages."""
    if folder:
        for path in [folder / "accuracy.md", *folder.glob("*.csv")]:
            shutil.copyfile(path, KEPT / path.name)
    write(pages(), check, "python scripts/tools/generate_accuracy_docs.py")


def pages() -> dict[Path, str]:
    """What the pages should say."""
    statement, outlet = (path.read_text(encoding="utf-8") for path in (STATEMENT, OUTLET))
    blocks = {
        ROOT / "README.md": {"headline": headline(rows(statement), rows(outlet))},
        ROOT / "docs" / "accuracy.md": {"accuracy": statement},
        ROOT / "docs" / "memory.md": {"memory": outlet},
    }
    return {path: filled(path.read_text(encoding="utf-8"), own) for path, own in blocks.items()}


def rows(table: str) -> list[list[str]]:
    """Cells of a Markdown table, without its head."""
    lines = table.strip().splitlines()[2:]
    return [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in lines]


def headline(statement: list[list[str]], outlet: list[list[str]]) -> str:
    """The largest errors in five lines."""

    def worst(*beginnings: str) -> str:
        cells = [row[-1] for row in statement if row[0].startswith(beginnings)]
        found, unit = max((_first(cell), cell.split()[1]) for cell in cells)
        return f"{found:.1e} {unit}" if unit == "Ubar" else f"{found:g} {unit}"

    at_the_outlet = {De: [row for row in outlet if row[1] == De] for De in ("5", "31", "62")}
    remembered = ", ".join(
        f"{max(_largest(row[5]) for row in own):.2f} d at De = {De}"
        for De, own in at_the_outlet.items()
    )
    table = [
        ("what, in the demo where not said otherwise", "against", "largest error"),
        ("---",) * 3,
        (
            "relative velocities of a simulation",
            "finer meshes, higher order, longer boxes",
            worst(*(f"relative velocities: {of}" for of in ("meshes", "polynomial", "periodic"))),
        ),
        (
            "those of the table between its distances",
            "simulations",
            worst("interpolation of the table"),
        ),
        (
            "distances that are held",
            "spheres that move, ten relaxation times after rest",
            worst("quasi-steady"),
        ),
        (
            "a train of six by the table, until 100 D/Ubar",
            "a simulation of all six",
            worst("train model, 6 spheres, every sphere"),
        ),
        (
            "pairs and triplets through 800 D, by the table of `config/paper.yaml`",
            "their simulation",
            f"at the outlet {remembered}",
        ),
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in table)


def _first(cell: str) -> float:
    return float(NUMBER.findall(cell)[0])


def _largest(cell: str) -> float:
    return max(abs(float(number)) for number in NUMBER.findall(cell))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, help="results/<study>/verification")
    parser.add_argument("--check", action="store_true", help="compare only, write nothing")
    given = parser.parse_args()
    main(given.folder, given.check)
