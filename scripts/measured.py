"""Measured stage: measured spacings beside those of the trains of one condition.

python scripts/measured.py --configfile config/config.yaml spacings.csv TRAIN OUTPUT
"""

from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Job, Result, run, taken
from viscotrain.trains import measured, spacings_file


def main(
    job: Job,
    spacings: Annotated[Path, taken("CSV file; columns: config/README.md")],
    trains: Annotated[Path, taken("file of trains.py")],
    result: Result,
):
    """Compare the spacings that were measured at the condition of the trains."""
    simulated = datasets.read(trains)
    De, fraction = (float(simulated[name]) for name in ("deborah", simulated.attrs["given"]))
    rows = measured.of_condition(spacings_file.read(spacings, dict(job.settings)), De, fraction)
    found = measured.compare(simulated, rows)
    job.write(found, result, f"measured spacings at De = {De:g}, {simulated.attrs['given']}")
    print(*measured.headline(found), sep="\n")


run(main, settings=stages.measured)
