"""Writing figures: PNG, PDF and the data they show, free of clocks."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from viscotrain import files
from viscotrain.drawing.style import STYLE, Drawing, styled
from viscotrain.jobs import datasets

HIDDEN = {"CreationDate": None, "ModDate": None}  # clocks, which would spoil identical bytes
NOTE_HEIGHT = 0.2  # inches


@styled
def save(
    drawing: Drawing,
    stem: str | Path,
    attributes: Mapping[str, str] | None = None,
    note: str = "",
) -> list[Path]:
    """Write `stem`.png, `stem`.pdf and `stem`.nc or `stem`.csv; bytes depend on content only.

    Args:
        drawing: A figure with its data.
        stem: Path without an ending.
        attributes: Global ones of the data, if these are a dataset; None leaves its own.
        note: A line below the figure, which becomes as much higher, and `channel` of the data.
    """
    stem = Path(stem)
    table = isinstance(drawing.data, pd.DataFrame)
    # with_suffix would cut names at their decimal point
    paths = [
        stem.with_name(stem.name + end) for end in (".png", ".pdf", ".csv" if table else ".nc")
    ]
    around: dict[str, Any] = _with_note(drawing.figure, note) if note else {}
    with files.whole(paths[0]) as part:
        drawing.figure.savefig(part, metadata={"Software": None}, **around)
    drawing.figure.set_layout_engine("none")  # found once; the PDF has that of the PNG
    with files.whole(paths[1]) as part:
        drawing.figure.savefig(part, metadata=HIDDEN, **around)
    if isinstance(drawing.data, pd.DataFrame):
        datasets.write_csv(drawing.data, paths[2])
    else:
        own = dict(drawing.data.attrs if attributes is None else attributes)
        marked = {"channel": note} if note else {}
        datasets.write(drawing.data.assign_attrs(own | marked), paths[2])
    return paths


def _with_note(figure: Figure, note: str) -> dict[str, Any]:
    """Write below a figure, and how it is to be saved with that, all else in its place."""
    figure.set_dpi(STYLE["savefig.dpi"])
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for legend in figure.legends:  # their anchor would grow with what is saved
        legend.set_bbox_to_anchor((0.0, 0.0, 1.0, 1.0), transform=figure.transFigure)
    width, height = figure.get_size_inches()
    figure.text(0.5, -NOTE_HEIGHT / 2 / height, note, ha="center", va="center", style="italic")
    return {"bbox_inches": Bbox([[0.0, -NOTE_HEIGHT], [width, height]])}
