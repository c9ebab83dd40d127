"""Writing figures: PNG, PDF and the data they show, free of clocks."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from viscotrain import files
from viscotrain.drawing.style import Drawing, styled
from viscotrain.jobs import datasets

HIDDEN = {"CreationDate": None, "ModDate": None}  # clocks, which would spoil identical bytes


@styled
def save(
    drawing: Drawing, stem: str | Path, attributes: Mapping[str, str] | None = None
) -> list[Path]:
    """Write `stem`.png, `stem`.pdf and `stem`.nc or `stem`.csv; bytes depend on content only.

    Args:
        drawing: A figure with its data.
        stem: Path without an ending.
        attributes: Global ones of the data, if these are a dataset; None leaves its own.
    """
    stem = Path(stem)
    table = isinstance(drawing.data, pd.DataFrame)
    # with_suffix would cut names at their decimal point
    paths = [
        stem.with_name(stem.name + end) for end in (".png", ".pdf", ".csv" if table else ".nc")
    ]
    with files.whole(paths[0]) as part:
        drawing.figure.savefig(part, metadata={"Software": None})
    drawing.figure.set_layout_engine("none")  # found once; the PDF has that of the PNG
    with files.whole(paths[1]) as part:
        drawing.figure.savefig(part, metadata=HIDDEN)
    if isinstance(drawing.data, pd.DataFrame):
        datasets.write_csv(drawing.data, paths[2])
    else:
        own = drawing.data.attrs if attributes is None else attributes
        datasets.write(drawing.data.assign_attrs(own), paths[2])
    return paths
