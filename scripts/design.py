r"""Design stage: trains of all conditions -> whether and where they form, a page and plain text.

python scripts/design.py --configfile CONFIG TABLE UNITS CHANNEL_FLOW PAGE TEXT CSV TRAIN... \
    [--duct CHANNEL_FLOW] [--figure FOLDER]
"""

from pathlib import Path
from typing import Annotated

from viscotrain import files
from viscotrain.config import stages
from viscotrain.drawing import design_page
from viscotrain.jobs import datasets, drawings
from viscotrain.jobs.entry import (
    Duct,
    Flow,
    Job,
    Table,
    Trains,
    Units,
    folder_of,
    made,
    run,
)
from viscotrain.studies import design_runs
from viscotrain.table.drift import open_table

Text = Annotated[Path, made("text file to write")]
Csv = Annotated[Path, made("CSV file of all conditions")]
Page = Annotated[Path, made("page to write")]
Folder = Annotated[Path | None, made("folder to draw into", convert=folder_of, named=True)]


def main(
    job: Job,
    table: Table,
    units: Units,
    flow: Flow,
    page: Page,
    text: Text,
    conditions: Csv,
    trains: Trains,
    duct: Duct = None,
    figure: Folder = None,
):
    """Rank all conditions, put the answer into words, write and draw it."""
    tried = [datasets.read(path) for path in trains]
    physical, undisturbed = datasets.read(units), datasets.read(flow)
    found, answer, device = design_runs.answer(
        job.settings, tried, physical, undisturbed, open_table(table, duct)
    )
    drawing = design_page.draw_design(found, device)
    source = job.attributes("design")["source"]
    datasets.write_csv(found, conditions, digits=6)
    files.write_text(answer.text() + "\n", text)
    files.write_text(design_page.page(answer, found, drawing, job.study, source), page)
    if figure:
        drawings.save(drawing, figure / "design")
    print(answer.text())


run(main, settings=stages.design)
