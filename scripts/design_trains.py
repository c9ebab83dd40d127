r"""Design stage: velocity table -> trains of all spacings that a design tries, at one De.

python scripts/design_trains.py --configfile CONFIG --deborah 5 TABLE UNITS OUTPUT... \
    [--duct CHANNEL_FLOW]
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.jobs import datasets
from viscotrain.jobs.entry import Deborah, Duct, Job, Table, Units, made, run
from viscotrain.studies import design_runs
from viscotrain.table.drift import open_table

Outputs = Annotated[Sequence[Path], made("files to write, one per spacing, and one of the rate")]


def main(
    job: Job, deborah: Deborah, table: Table, units: Units, trains: Outputs, duct: Duct = None
):
    """Simulate trains of every condition and write them with their statistics."""
    seconds = float(datasets.read(units)["time"].sel(deborah=deborah))
    tried = design_runs.simulate(job.settings, open_table(table, duct), deborah, seconds)
    for train, output in zip(tried, trains, strict=True):
        job.write(train, output, f"trains of a design at De = {deborah:g}")
        print(train.attrs.get(design_runs.NOT_TRIED, output))


run(main, settings=stages.design_trains)
