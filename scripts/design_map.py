r"""Design map stage: trains of all conditions -> the map in physical units, and its figures.

python scripts/design_map.py --configfile config/config.yaml OUTPUT UNITS FLOW POINT... \
    [--figures FOLDER]
"""

from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.drawing import figures as drawn
from viscotrain.jobs import datasets, drawings
from viscotrain.jobs.entry import Flow, Job, MapPoints, Result, Units, folder_of, made, run
from viscotrain.trains import design_map

Figures = Annotated[Path | None, made("folder", key="figure", convert=folder_of, named=True)]


def main(
    job: Job, result: Result, units: Units, flow: Flow, points: MapPoints, figures: Figures = None
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
    for name in ("spacing_law", "design_map") if figures else ():
        drawing = drawn.draw(name, combined, own.confinement)
        drawings.save(drawing, figures / name, note=own.section.remark)


run(main, settings=stages.design_map)
