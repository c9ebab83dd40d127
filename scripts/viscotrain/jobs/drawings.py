"""Writing figures: PNG, PDF and the data they show, free of clocks."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from viscotrain.drawing.style import Drawing, styled
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
    stem.parent.mkdir(parents=True, exist_ok=True)
    table = isinstance(drawing.data, pd.DataFrame)
    # with_suffix would cut names at their decimal point
    paths = [
        stem.with_name(stem.name + end) for end in (".png", ".pdf", ".csv" if table else ".nc")
    ]
    if note:
        _add_note(drawing.figure, note)
    drawing.figure.savefig(paths[0], metadata={"Software": None})
    drawing.figure.set_layout_engine("none")  # found once; the PDF has that of the PNG
    drawing.figure.savefig(paths[1], metadata=HIDDEN)
    if table:
        drawing.data.to_csv(paths[2], index=False, lineterminator="\n")
    else:
        own = dict(drawing.data.attrs if attributes is None else attributes)
        marked = {"channel": note} if note else {}
        datasets.write(drawing.data.assign_attrs(own | marked), paths[2])
    return paths


def _add_note(figure: Figure, note: str):
    """Write a line into a strip that is added below a figure, all else as it is above."""
    width, height = figure.get_size_inches()
    share = NOTE_HEIGHT / (height + NOTE_HEIGHT)
    above = 0.0, share, 1.0, 1.0 - share
    figure.set_size_inches(width, height + NOTE_HEIGHT)
    figure.get_layout_engine().set(rect=above)
    for legend in figure.legends:  # anchored to the figure otherwise
        legend.set_bbox_to_anchor(above, transform=figure.transFigure)
    figure.text(0.5, 0.5 * share, note, ha="center", va="center", style="italic")
