r"""Design map stage: trains of all conditions -> the map in physical units, and its figures.

python scripts/design_map.py --configfile config/config.yaml OUTPUT UNITS POINT... \
    [--figures FOLDER]
"""

from pathlib import Path

import xarray as xr

from viscotrain.config import stages
from viscotrain.drawing import figures
from viscotrain.jobs import drawings
from viscotrain.jobs.entry import Job, folder_of, made, run, taken
from viscotrain.trains import design_map


def main(job: Job, result: Path, units: Path, points: list[Path], figures_folder: Path | None):
    """Combine the trains of all conditions, write the map and draw it."""
    combined = design_map.combine(
        [xr.load_dataset(path) for path in points],
        units=xr.load_dataset(units),
        fluid=job.settings.dimensionless_fluid,
        ordered_variation=job.settings.ordered_variation,
    )
    job.write(combined, result, "design map")
    print(design_map.headline(combined))
    for name in ("spacing_law", "design_map") if figures_folder else ():
        drawing = figures.draw(name, combined, job.settings.confinement)
        drawings.save(drawing, figures_folder / name)


run(
    main,
    settings=stages.design_map,
    arguments=[
        made("result", "netCDF file to write"),
        taken("units", "physical units of the study"),
        taken("points", "files that trains.py --design-map wrote", many=True),
        made(
            "figures_folder",
            "folder to draw into",
            key="figure",
            convert=folder_of,
            flag="--figures",
            optional=True,
        ),
    ],
)
