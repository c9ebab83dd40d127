"""Interactive stage: velocity table and trains -> one page for a browser.

python scripts/interactive.py --configfile config/config.yaml TABLE UNITS OUTPUT TRAIN...
"""

from pathlib import Path

import xarray as xr

from viscotrain.drawing import interactive
from viscotrain.jobs.entry import Job, made, run, taken


def main(job: Job, table: Path, units: Path, page: Path, trains: list[Path]):
    """Write the page."""
    text = interactive.page(
        xr.load_dataset(table),
        xr.load_dataset(units),
        [xr.load_dataset(path) for path in trains],
        job.study,
    )
    page.write_text(text, encoding="utf-8")
    print(f"{page}: {len(text) / 1e6:.1f} MB")


run(
    main,
    config=True,
    arguments=[
        taken("table", "velocity table"),
        taken("units", "physical units of the study"),
        made("page", "HTML file to write"),
        taken("trains", "netCDF files of the trains", many=True, optional=True),
    ],
)
