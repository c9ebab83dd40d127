"""Figures by their names: each a function from a dataset to a drawing and the data it shows."""

import re

import xarray as xr

from viscotrain.drawing.design_figures import draw_design_map, spacing_law, stations
from viscotrain.drawing.pair_velocities import pair_velocity
from viscotrain.drawing.relative_velocities import relative_velocities
from viscotrain.drawing.stress_field import stress_field
from viscotrain.drawing.style import Drawing
from viscotrain.drawing.train_figures import spacing, train
from viscotrain.errors import ViscotrainError


class FigureError(ViscotrainError, ValueError):
    """A figure is asked for that does not exist, or that the data cannot give."""


def draw(
    name: str, dataset: xr.Dataset, confinement: float, units: xr.Dataset | None = None
) -> Drawing:
    """Make the figure of this name, as in `relative_velocities_De5`.

    Args:
        name: File name of the figure, without extension.
        dataset: The velocity table, the field, the trains, the film or the design map, whichever
            the figure shows.
        confinement: d/D.
        units: Physical units of the study, for the figure of all stations.

    Raises:
        FigureError: There is no such figure, or it lacks units.
    """
    number = r"([0-9.e+-]+)"
    if found := re.fullmatch(f"relative_velocities_De{number}", name):
        return relative_velocities(dataset, float(found[1]), confinement)
    if name == "pair_velocity":
        return pair_velocity(dataset, confinement)
    if name == "stress_field":
        return stress_field(dataset)
    if re.fullmatch(f"spacing_De{number}_phi{number}", name):
        return spacing(dataset)
    if re.fullmatch(f"train_De{number}_phi{number}", name):
        return train(dataset)
    if re.fullmatch(f"stations_De{number}_phi{number}", name):
        if units is None:
            raise FigureError(f"{name} is drawn to scale; allowed: with the file units.nc")
        return stations(dataset, units)
    if name == "spacing_law":
        return spacing_law(dataset)
    if name == "design_map":
        return draw_design_map(dataset)
    raise FigureError(
        f"figure is {name!r}; allowed: relative_velocities_De*, pair_velocity, stress_field, "
        "spacing_De*_phi*, train_De*_phi*, stations_De*_phi*, spacing_law, design_map"
    )
