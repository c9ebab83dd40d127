"""Figures by their names: each a function from a dataset to a drawing and the data it shows."""

import re
from pathlib import Path

import xarray as xr

from viscotrain import files
from viscotrain.config.device_settings import (
    FiguresSettings,
)
from viscotrain.drawing import rheology_figure, schematic
from viscotrain.drawing.conventions import with_sphere_rate
from viscotrain.drawing.design_figures import spacing_law
from viscotrain.drawing.movies import stations
from viscotrain.drawing.pair_velocities import pair_velocity
from viscotrain.drawing.relative_velocities import relative_velocities
from viscotrain.drawing.stress_field import stress_field
from viscotrain.drawing.string_figures import strings
from viscotrain.drawing.style import Drawing
from viscotrain.drawing.train_figures import spacing, train
from viscotrain.errors import FluidError, ViscotrainError
from viscotrain.fluid.parameters import DimensionlessFluid
from viscotrain.fluid.pipe import pipe_flow
from viscotrain.words import FASTEST

OF_TRAINS = {"spacing": spacing, "strings": strings, "train": train}


class FigureError(ViscotrainError, ValueError):
    """A figure is asked for that does not exist, or that the data cannot give."""


def draw_with(
    settings: FiguresSettings,
    name: str,
    source: Path | None,
    units: Path | None,
    measured: Path | None = None,
    duct: Path | None = None,
) -> Drawing:
    """Make the figure of this name, of the study itself or of what a file holds.

    Args:
        settings: Of the figure.
        name: File name of the figure, without extension.
        source: The file; measured data for `rheology`.
        units: File with the physical units of the study, for figures of trains.
        measured: File with measured spacings, for their distribution.
        duct: File with the flow of a duct, for `schematic`.

    Raises:
        FigureError: There is no such figure, or it lacks a file.
    """
    if name == "schematic" and settings.schematic is not None:
        return schematic.draw(schematic.geometry(settings.schematic, _on_the_axis(settings, duct)))
    if name == "rheology" and settings.rheology is not None:
        fluid, rates = settings.rheology.known_fluid, settings.rheology.shear_rates()
        measured = rheology_figure.measured(source) if source else None
        return rheology_figure.rheology(fluid, measured, rates)
    if source is None:
        raise FigureError(f"{name} shows a file; found none")
    physical = files.read_dataset(units) if units else None
    dataset = files.read_dataset(source)
    if measured:
        dataset = dataset.assign(files.read_dataset(measured).data_vars)
    return draw(name, dataset, settings.confinement, physical)


def _on_the_axis(settings: FiguresSettings, duct: Path | None) -> float:
    """Velocity on the axis, in Ubar, at the De of the schematic."""
    assert settings.rheology is not None and settings.schematic is not None
    if duct is not None:
        largest = xr.load_dataset(duct)["centreline_velocity"]
        return float(largest.sel(deborah=settings.schematic.deborah).fillna(FASTEST))
    fluid = settings.rheology.known_fluid
    scaled = DimensionlessFluid.from_physical(fluid.solvent_viscosity, fluid.modes)
    De = settings.rheology.longest_modes()[settings.schematic.deborah]
    try:
        return pipe_flow(scaled, De).centreline_velocity
    except FluidError:  # no unique flow; a drawing needs some velocity
        return FASTEST


def draw(
    name: str, dataset: xr.Dataset, confinement: float, units: xr.Dataset | None = None
) -> Drawing:
    """Make the figure of this name, as in `relative_velocities_De5`.

    Args:
        name: File name of the figure, without extension.
        dataset: The velocity table, the field, the trains, the film or the design map, whichever
            the figure shows.
        confinement: d/D.
        units: Physical units of the study, for figures of trains.

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
    for figure, of_train in OF_TRAINS.items():
        if re.fullmatch(f"{figure}_De{number}_phi(_feed)?{number}", name):
            return of_train(with_sphere_rate(dataset, units))
    if re.fullmatch(f"stations_De{number}_phi(_feed)?{number}", name):
        if units is None:
            raise FigureError(f"{name} is drawn to scale; allowed: with the file units.nc")
        return stations(dataset, units)
    if name == "spacing_law":
        return spacing_law(dataset)
    raise FigureError(
        f"figure is {name!r}; allowed: relative_velocities_De*, pair_velocity, stress_field, "
        "spacing_De*_phi*, strings_De*_phi*, train_De*_phi*, stations_De*_phi*, spacing_law"
    )
