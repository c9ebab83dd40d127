"""A line on every figure of a study: its first sentences in the report, and the data beside it."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

REPORT = Path(__file__).parents[2] / "workflow" / "report"
FOLDERS = ("figures", "verification")
OF_ONE = re.compile(r"(De|phi|phi_feed)[0-9][0-9.e+-]*")
CONDITION = re.compile(r"[,;] (at )?De = {{.*?}}, phi{{.*?}} \(.*?\)")
FEW = 60  # letters of a sentence that says too little
CONVERGENCE = ("mesh", "order", "box", "time_step")
FIGURES = [("figure", "data", "what it shows"), ("---",) * 3]


def figures(folders: Sequence[Path]) -> str:
    """A Markdown table of the figures that are there, a row for all that differ in De and phi."""
    found = {}
    for path in sorted(path for folder in folders for path in _pictures(folder)):
        name = OF_ONE.sub(r"\1*", path.stem)
        kept = [path.with_suffix(end) for end in (".csv", ".nc")]
        data = ", ".join(f"`{each.suffix}`" for each in kept if each.exists())
        where = f"{path.parent.name}/{name}"
        found[where] = (f"`{where}`", data, first_sentences(caption(path)))
    rows = [*FIGURES, *(found[name] for name in sorted(found))]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _pictures(folder: Path) -> Iterator[Path]:
    for name in FOLDERS:
        yield from (folder / name).glob("*.png")


def caption(picture: Path) -> str:
    """Text of the report on a figure."""
    name = OF_ONE.sub("", picture.stem).rstrip("_")
    if picture.parent.name == "verification" and name in CONVERGENCE:
        name = "convergence"
    return (REPORT / f"{name}.rst").read_text(encoding="utf-8")


def first_sentences(text: str) -> str:
    """The first one, or two if it is short, without conditions; cells of a table have no |."""
    sentences = CONDITION.sub("", text).replace("|", "/").strip().split(". ")
    count = 1 if len(sentences[0]) > FEW else 2
    return ". ".join(sentences[:count]).rstrip(".") + "."
