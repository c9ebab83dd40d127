"""Interactive stage: velocity table and trains -> one page for a browser.

python scripts/interactive.py --configfile config/config.yaml TABLE UNITS OUTPUT TRAIN...
"""

from viscotrain import files
from viscotrain.drawing import interactive
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Job, Result, Table, Trains, Units, run


def main(job: Job, table: Table, units: Units, page: Result, trains: Trains = ()):
    """Write the page."""
    tracks = [datasets.read(path) for path in trains]
    text = interactive.page(datasets.read(table), datasets.read(units), tracks, job.study)
    files.write_text(text, page)
    print(f"{page}: {len(text) / 1e6:.1f} MB")


run(main, config=True)
