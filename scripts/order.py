r"""Order stage: velocity table -> stability and ordering length over De and spacing, and a figure.

python scripts/order.py --configfile config/config.yaml OUTPUT TABLE UNITS \
    [--simulated DESIGN_MAP] [--duct CHANNEL_FLOW] [--figure FOLDER]
"""

import itertools
from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.drawing.order_figure import draw_order
from viscotrain.jobs import datasets, drawings
from viscotrain.jobs.entry import Duct, Job, Result, Table, Units, folder_of, made, run, taken
from viscotrain.table.drift import open_table
from viscotrain.trains import order, tolerance

Simulated = Annotated[Path | None, taken("design map of the study, to compare with", named=True)]
Folder = Annotated[Path | None, made("folder to draw into", convert=folder_of, named=True)]


def main(
    job: Job,
    result: Result,
    table: Table,
    units: Units,
    simulated: Simulated = None,
    duct: Duct = None,
    figure: Folder = None,
):
    """Analyse trains of every spacing, write and draw what was found."""
    own = job.settings
    velocities = open_table(table, duct)
    wanted = tolerance.Wanted(
        own.closure, own.injection, own.length, own.ordered_variation, own.section
    )
    found = order.orders(velocities, own.confinement, own.closure, section=own.section)
    found = tolerance.with_tolerance(found, velocities, wanted)
    job.write(found, result, "order of trains")
    print(order.summary(found, own.length))
    for De, fraction in itertools.product(own.deborah, own.fractions):
        print(tolerance.of_condition(velocities, De, fraction, wanted, own.feed))
    if figure:
        trains = datasets.read(simulated) if simulated else None
        drawing = draw_order(found, own.length, datasets.read(units), velocities.dataset, trains)
        made_by = job.attributes("data of the figure order")
        drawings.save(drawing, figure / "order", made_by, note=own.section.remark)


run(main, settings=stages.order)
