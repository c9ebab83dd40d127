"""Trains of the study whose diameters vary by more and more: CV at the outlet, and the linear law.

Spheres enter by the law of the study, and evenly, to tell what diameters do from what the injection
does. Random numbers, of intervals and of diameters, are the same at every variation.
"""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from viscotrain.config.settings import DiameterVariationSettings
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.size_response import size_response
from viscotrain.trains import order, tolerance
from viscotrain.trains.closures import CLOSURES, with_memory
from viscotrain.trains.condition import Condition
from viscotrain.trains.injection import channel_volume_fraction
from viscotrain.trains.sizes import Sizes
from viscotrain.trains.statistics import confidence
from viscotrain.trains.variables import described

VARIATIONS = (0.0, 0.005, 0.01, 0.02, 0.05)  # what beads are sold with, and none
LAW = np.linspace(0.0, max(VARIATIONS), 51)  # where the law is drawn
PARTS = 5  # of a train, successive ones, each with a CV of its own
EVEN = "even"  # the injection law
GRID = ("condition", "injection", "diameter_variation")
LAW_GRID = (*GRID[:2], "law_diameter_variation")
CV = "coefficient of variation of the spacing at the outlet"


def simulate(settings: DiameterVariationSettings, table: VelocityTable) -> xr.Dataset:
    """CV of the spacing at the outlet over condition, injection and variation of the diameters.

    Args:
        settings: Of the trains.
        table: Of velocities. Where it does not say what diameters change, only equal spheres are
            simulated, and everything else is NaN.

    Returns:
        `spacing_variation` (condition, injection, diameter_variation) with its `_halfwidth`, as
        simulated, and `law_variation` (condition, injection, law_diameter_variation) by
        `tolerance`; NaN at an unstable condition.
    """
    own = settings.trains
    variations = sorted({*VARIATIONS, own.diameter_variation})
    injections = list(dict.fromkeys([own.injection, EVEN]))
    conditions = list(itertools.product(settings.deborah, settings.fractions))
    found = [_of_condition(settings, table, *each, injections, variations) for each in conditions]
    phi, cv, halfwidth, law = (np.array(values) for values in zip(*found, strict=True))
    De = np.array([each for each, _ in conditions])
    variables = {
        "spacing_variation": described(cv, GRID, CV),
        "spacing_variation_halfwidth": described(
            halfwidth, GRID, f"sampling error, half width of the 95 % interval, of the {CV}"
        ),
        "law_variation": described(law, LAW_GRID, f"{CV}, by the linear theory"),
        "ordered_variation": described(settings.ordered_variation, [], f"{CV} of ordered trains"),
        "study_variation": described(own.diameter_variation, [], "CV of the study's diameters"),
        "confinement": described(own.confinement, [], "sphere over channel diameter"),
        "length": described(own.length, [], "length of the channel over its diameter"),
    }
    diameters = "coefficient of variation of the diameters"
    coordinates = {
        "deborah": described(De, GRID[:1], "Deborah number, as the study defines it"),
        "volume_fraction": described(phi, GRID[:1], "volume fraction in the channel"),
        "given_fraction": described(
            [each for _, each in conditions], GRID[:1], "the volume fraction that the study gives"
        ),
        GRID[2]: described(variations, GRID[2:], diameters),
        LAW_GRID[2]: described(LAW, LAW_GRID[2:], f"{diameters}, of the law"),
        "injection": ("injection", injections, {"long_name": "law by which spheres enter"}),
    }
    given = "feed_volume_fraction" if own.feed else "volume_fraction"
    attributes = {"given": given, **own.section.attributes}
    return xr.Dataset(variables, coordinates, attributes)


def _of_condition(
    settings: DiameterVariationSettings,
    table: VelocityTable,
    deborah: float,
    fraction: float,
    injections: Sequence[str],
    variations: Sequence[float],
) -> tuple[float, NDArray, NDArray, NDArray]:
    """phi, CV and its error over (injection, variation), and the law over (injection, `LAW`)."""
    own, beta = settings.trains, settings.trains.confinement
    held = CLOSURES[own.closure](table.at(deborah))
    closed = with_memory(held, own.memory * table.deborah_longest_mode(deborah) / beta)
    phi = channel_volume_fraction(fraction, held.isolated) if own.feed else fraction
    U = size_response(table, deborah).value
    answer = order.response(held, own.section.mean_spacing(beta, phi))
    theory = tolerance.law(answer, beta, U, own.length)
    valid = 1.0 if order.stability(answer, beta) >= 0 else math.nan
    cv, law = [], []
    for injection in injections:
        train = Condition(
            closed, injection, beta, phi, own.length, own.passages, own.seed, section=own.section
        )
        cv.append([_outlet(train, Sizes(v, U)) for v in variations])
        initial = tolerance.injected_variation(held, injection, beta, phi, own.section)
        law.append(valid * theory.variation(initial, LAW))
    values = np.moveaxis(np.array(cv), -1, 0)
    return phi, values[0], values[1], np.array(law)


def _outlet(train: Condition, sizes: Sizes) -> tuple[float, float]:
    """CV of the spacing at the outlet of one train, and its sampling error from its parts."""
    if sizes.variation > 0 and math.isnan(sizes.response):
        return math.nan, math.nan
    s = train.with_sizes(sizes).record(0, np.array([train.length])).spacing[0]
    parts = [np.nanstd(part) / np.nanmean(part) for part in np.array_split(s, PARTS)]
    _, halfwidth = confidence(np.array(parts))
    return float(np.nanstd(s) / np.nanmean(s)), float(halfwidth)


def summary(found: xr.Dataset) -> str:
    """Largest variation that was simulated with which each condition is ordered, in words."""
    lines = []
    for own in (found.isel(condition=n) for n in range(found.sizes["condition"])):
        words = []
        for injection in own["injection"].values:
            cv = own["spacing_variation"].sel(injection=injection)
            ordered = own["diameter_variation"].values[(cv <= own["ordered_variation"]).values]
            most = f"up to {100 * ordered.max():g} %" if ordered.size else "not at all"
            words.append(f"{injection} injection {most}")
        name = f"De = {float(own['deborah']):g}, phi = {100 * float(own['volume_fraction']):.3g} %"
        lines.append(f"{name}, ordered with diameters that vary: {', '.join(words)}")
    return "\n".join(lines)
