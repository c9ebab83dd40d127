r"""Interactive stage: velocity table, order and trains -> one page for a browser.

python scripts/interactive.py --configfile config/config.yaml TABLE UNITS OUTPUT TRAIN... \
    [--order ORDER] [--flow CHANNEL_FLOW]
"""

from pathlib import Path
from typing import Annotated

from viscotrain import files
from viscotrain.drawing import interactive
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Job, Result, Table, Trains, Units, run, taken

Order = Annotated[Path | None, taken("file of order.py", named=True)]
Flow = Annotated[Path | None, taken("file of channel_flow.py", named=True)]


def main(
    job: Job,
    table: Table,
    units: Units,
    page: Result,
    trains: Trains = (),
    order: Order = None,
    flow: Flow = None,
):
    """Write the page."""
    tracks = [datasets.read(path) for path in trains]
    also = [datasets.read(path) if path else None for path in (order, flow)]
    text = interactive.page(datasets.read(table), datasets.read(units), tracks, job.study, *also)
    files.write_text(text, page)
    print(f"{page}: {len(text) / 1e6:.1f} MB")


run(main, config=True)
