r"""Design map stage: trains of all conditions -> the map in physical units, and its figures.

python scripts/design_map.py --configfile config/config.yaml OUTPUT TABLE UNITS FLOW POINT... \
    [--figures FOLDER]
"""

from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.drawing.design_figures import spacing_law
from viscotrain.drawing.design_map_figure import draw_design_map
from viscotrain.jobs import datasets, drawings
from viscotrain.jobs.entry import Flow, Job, MapPoints, Result, Table, Units, folder_of, made, run
from viscotrain.table.drift import open_table
from viscotrain.trains import design_map

Figures = Annotated[Path | None, made("folder", key="figure", convert=folder_of, named=True)]


def main(
    job: Job,
    result: Result,
    table: Table,
    units: Units,
    flow: Flow,
    points: MapPoints,
    figures: Figures = None,
):
    """Combine the trains of all conditions, write the map and draw it."""
    own = job.settings
    combined = design_map.combine(
        [datasets.read(path) for path in points],
        units=datasets.read(units),
        flow=datasets.read(flow),
        ordered_variation=own.ordered_variation,
        section=own.section,
    )
    job.write(combined, result, "design map")
    print(*design_map.headline(combined), sep="\n")
    if figures:
        velocities = open_table(table, flow if own.section.is_duct else None)
        found = design_map.ordering(combined, velocities, own.closure, own.section)
        drawings.save(spacing_law(combined), figures / "spacing_law", note=own.section.remark)
        drawing = draw_design_map(combined, found, velocities.dataset)
        drawings.save(drawing, figures / "design_map", note=own.section.remark)


run(main, settings=stages.design_map)
