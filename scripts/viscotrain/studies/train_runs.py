"""Trains of one condition: all repeats, by the table's velocities at a Deborah number."""

import xarray as xr

from viscotrain.config.settings import TrainsSettings
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import repeats
from viscotrain.trains.model_error import interpolation_error


def simulate(
    settings: TrainsSettings, table: VelocityTable, deborah: float, volume_fraction: float
) -> xr.Dataset:
    """All repeats with their statistics, and De in all definitions."""
    trains = repeats.run_repeats(
        table.at(deborah),
        volume_fraction=volume_fraction,
        centreline_velocity=table.centreline_velocity(deborah),
        interpolation_error=interpolation_error(table, deborah),
        **dict(settings),
    )
    return trains.assign(repeats.deborah_numbers(table, deborah))
