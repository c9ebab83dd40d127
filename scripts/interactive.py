"""Interactive stage: velocity table and trains -> one page for a browser.

python scripts/interactive.py --configfile config/config.yaml TABLE UNITS OUTPUT TRAIN...
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain.drawing import interactive
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Job, Result, Table, Units, run, taken


def main(
    job: Job,
    table: Table,
    units: Units,
    page: Result,
    trains: Annotated[Sequence[Path], taken("files of trains.py")] = (),
):
    """Write the page."""
    tracks = [datasets.read(path) for path in trains]
    text = interactive.page(datasets.read(table), datasets.read(units), tracks, job.study)
    page.write_text(text, encoding="utf-8")
    print(f"{page}: {len(text) / 1e6:.1f} MB")


run(main, config=True)
