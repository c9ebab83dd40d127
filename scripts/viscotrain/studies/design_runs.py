"""A design: trains of every spacing at one Deborah number, and the answer."""

import math
from collections.abc import Iterator, Sequence

import pandas as pd
import xarray as xr

from viscotrain.config.design_settings import DesignSettings, DesignTrainsSettings
from viscotrain.errors import TrainError
from viscotrain.fluid.units import MICROMETRES
from viscotrain.studies import train_runs
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import design, design_answer, design_conditions, encapsulation
from viscotrain.trains.operating_conditions import operating_conditions
from viscotrain.trains.tolerance import Wanted
from viscotrain.trains.variables import described

NOT_TRIED = "not_tried"  # attribute of a condition without a train: why


def simulate(
    settings: DesignTrainsSettings, velocities: VelocityTable, deborah: float, seconds: float
) -> Iterator[xr.Dataset]:
    """Trains of all conditions at one De; without data, and with the reason, where there are none.

    Args:
        settings: Trains, mean spacings, and the rate of beads.
        velocities: Of the table.
        deborah: One of its Deborah numbers.
        seconds: D/Ubar in s.
    """
    own = settings.trains
    isolated = float(velocities.at(deborah)(math.inf, math.inf)[1])
    rate = None if settings.bead_rate is None else settings.bead_rate * seconds
    fractions = design_conditions.volume_fractions(
        settings.spacing,
        rate=rate,
        isolated=isolated,
        confinement=own.confinement,
        section=own.section,
    )
    for phi in fractions:
        if math.isnan(phi):
            assert rate is not None
            s = design_conditions.wanted_spacing(rate, isolated, own.confinement)
            yield _nothing(
                deborah,
                f"{settings.bead_rate:g} beads/s would be {s:.2g} d apart, centre to centre",
            )
            continue
        try:
            yield train_runs.simulate(own, velocities, deborah, phi)
        except TrainError as error:
            yield _nothing(deborah, str(error))


def _nothing(deborah: float, why: str) -> xr.Dataset:
    De = described(deborah, [], "Deborah number, as the study defines it")
    return xr.Dataset({"deborah": De}, attrs={NOT_TRIED: why})


def answer(
    settings: DesignSettings,
    tried: Sequence[xr.Dataset],
    units: xr.Dataset,
    flow: xr.Dataset,
    velocities: VelocityTable,
) -> tuple[pd.DataFrame, design_answer.Answer, design_answer.Device]:
    """All conditions, the best first; the answer in words; and what was asked.

    Args:
        settings: Of the design.
        tried: Of `simulate`, of all Deborah numbers.
        units: Physical units of the study.
        flow: Without spheres.
        velocities: Of the table.
    """
    trains = [train for train in tried if NOT_TRIED not in train.attrs]
    without = [
        f"De = {float(train['deborah']):g}: {train.attrs[NOT_TRIED]}"
        for train in tried
        if NOT_TRIED in train.attrs
    ]
    if not trains:
        raise TrainError("no condition of the design can be simulated:\n  " + "\n  ".join(without))
    device = _device(settings, units)
    own = settings.conditions
    conditions = operating_conditions(
        trains,
        units=units,
        flow=flow,
        fluid=own.known_fluid,
        fluid_density=own.fluid_density,
        particle_density=own.particle_density,
        section=own.section,
    )
    droplets = encapsulation.combine(trains, [], units, device.droplet_frequency, None)
    found = design.table(
        trains,
        conditions,
        droplets,
        bead_rate=device.bead_rate,
        droplet_frequency=device.droplet_frequency,
        ordered_variation=device.wanted.ordered_variation,
    )
    found = design.with_linear_law(found, velocities, device.wanted, device.variation)
    helped = design.remedies(found.iloc[0], velocities, device.wanted, device.variation)
    notes = [settings.trains.section.remark] if settings.trains.section.remark else []
    words = design_answer.answer(found, without, helped, device, notes)
    return found, words, device


def _device(settings: DesignSettings, units: xr.Dataset) -> design_answer.Device:
    own = settings.trains
    particle, channel = (
        MICROMETRES * float(units[f"{name}_diameter"]) for name in ("particle", "channel")
    )
    return design_answer.Device(
        particle=particle,
        channel=channel,
        section=own.section.name,
        wanted=Wanted(own.closure, own.injection, own.length, settings.ordered_variation),
        variation=own.diameter_variation,
        bead_rate=settings.bead_rate,
        droplet_frequency=settings.droplet_frequency,
    )
