r"""Diameter variation stage: velocity table -> trains whose diameters vary by more and more.

python scripts/diameter_variation.py --configfile config/config.yaml OUTPUT TABLE \
    [--duct CHANNEL_FLOW] [--figure FOLDER]
"""

from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.drawing.bead_figure import draw_diameter_variation
from viscotrain.jobs import drawings
from viscotrain.jobs.entry import Duct, Job, Result, Table, folder_of, made, run
from viscotrain.studies import diameter_variation
from viscotrain.table.drift import open_table

Folder = Annotated[Path | None, made("folder to draw into", convert=folder_of, named=True)]


def main(job: Job, result: Result, table: Table, duct: Duct = None, figure: Folder = None):
    """Simulate the study's trains at several variations of the diameters, and draw them."""
    found = diameter_variation.simulate(job.settings, open_table(table, duct))
    job.write(found, result, "trains of unequal spheres")
    print(diameter_variation.summary(found))
    if figure:
        own = job.attributes("data of the figure diameter_variation")
        note = job.settings.trains.section.remark
        drawings.save(draw_diameter_variation(found), figure / "diameter_variation", own, note)


run(main, settings=stages.diameter_variation)
