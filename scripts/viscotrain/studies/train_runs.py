"""Trains of one condition: all repeats, by the table's velocities at a Deborah number."""

import xarray as xr

from viscotrain.config.settings import TrainsSettings
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.points import largest_error
from viscotrain.table.size_response import UNKNOWN, demanded
from viscotrain.trains import repeats
from viscotrain.trains.model_error import interpolation_error
from viscotrain.trains.variables import described


def simulate(
    settings: TrainsSettings, table: VelocityTable, deborah: float, volume_fraction: float
) -> xr.Dataset:
    """All repeats with their statistics, and De in all definitions."""
    own = dict(settings)
    De = table.deborah_longest_mode(deborah)
    strength = own.pop("memory") * De / settings.confinement
    unequal = settings.diameter_variation > 0
    trains = repeats.run_repeats(
        table.at(deborah),
        volume_fraction=volume_fraction,
        centreline_velocity=table.centreline_velocity(deborah),
        interpolation_error=interpolation_error(table, deborah),
        memory_strength=strength,
        size_response=demanded(table, deborah) if unequal else UNKNOWN,
        **own,
    ).assign(repeats.deborah_numbers(table, deborah))
    error = largest_error(table.dataset.isel(deborah=table.index(deborah)))
    words = "largest error of the relative velocities in the table over mean velocity of the flow"
    return repeats.with_memory_numbers(trains.assign(velocity_error=described(error, [], words)))
