"""One condition: what its trains share, its records, baseline and model errors."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from viscotrain.fluid.channel import ROUND, CrossSection
from viscotrain.trains import model_error
from viscotrain.trains.closures import Closure
from viscotrain.trains.injection import InjectionLaw, injection_law
from viscotrain.trains.recording import Record, record_train
from viscotrain.trains.sizes import EQUAL, Sizes
from viscotrain.trains.statistics import MODE, injected
from viscotrain.words import repeated


@dataclass(frozen=True)
class Condition:
    """What all trains of one condition share.

    Attributes:
        closure: Velocities of trains.
        injection: Name of one of `INJECTIONS`.
        confinement: beta = d/D.
        volume_fraction: phi, in the channel.
        length: Of the channel in D.
        passages: Spheres to record.
        seed: Of all repeats.
        sizes: How diameters vary.
        section: Of the channel.
    """

    closure: Closure
    injection: str
    confinement: float
    volume_fraction: float
    length: float
    passages: int
    seed: int
    sizes: Sizes = EQUAL
    section: CrossSection = ROUND

    @property
    def law(self) -> InjectionLaw:
        """Of the intervals at which spheres enter."""
        return injection_law(
            injection=self.injection,
            confinement=self.confinement,
            volume_fraction=self.volume_fraction,
            velocity=self.closure.isolated,
            slowest=self.closure.slowest,
            section=self.section,
        )

    @property
    def mean_spacing(self) -> float:
        """Of an equally spaced train, in d."""
        return self.section.mean_spacing(self.confinement, self.volume_fraction)

    def record(self, repeat: int, stations: NDArray) -> Record:
        """One repeat, recorded at stations in D."""
        return record_train(
            self.closure,
            confinement=self.confinement,
            volume_fraction=self.volume_fraction,
            injection=self.injection,
            length=self.length,
            stations=stations,
            passages=self.passages,
            rng=generator(self.seed, repeat),
            sizes=self.sizes,
            section=self.section,
        )

    def with_sizes(self, sizes: Sizes) -> "Condition":
        """The same with other diameters; where they do not vary there is no response."""
        return replace(self, sizes=sizes if sizes.variation > 0 else EQUAL)

    def a_little_wrong(
        self, closures: Mapping[str, Closure], response_error: float
    ) -> dict[str, "Condition"]:
        """The same with other velocities, by name, and with another response of unequal spheres.

        Args:
            closures: `model_error.variants`.
            response_error: Of U' in Ubar; NaN: not known.
        """
        found = {name: replace(self, closure=other) for name, other in closures.items()}
        if self.sizes.variation > 0 and math.isfinite(response_error):
            response = self.sizes.response + response_error
            found["sizes"] = self.with_sizes(Sizes(self.sizes.variation, response))
        return found


def generator(seed: int, repeat: int) -> np.random.Generator:
    """Source of the random numbers of one repeat, which depends on (seed, repeat) only.

    So more repeats leave the earlier ones as they were, bit by bit.
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(repeat,)))


def model_errors(
    own: Condition, dataset: xr.Dataset, others: Mapping[str, Condition]
) -> dict[str, xr.DataArray]:
    """Model errors of all statistics, from some repeats of conditions that are a little wrong."""
    places = dataset["station"].values
    again = range(repeated(dataset.sizes["repeat"]))
    wrong = {
        name: np.stack([other.record(n, places).spacing for n in again])
        for name, other in others.items()
    }
    right, contact = (dataset[name].values[again] for name in ("spacing", "contact_distance"))
    errors = model_error.model_error(right, wrong, own.mean_spacing, contact[:, None])
    name = f"{MODE}_model_error"
    errors[name] = errors[name].where(dataset[MODE].notnull())
    return {str(key): value for key, value in errors.data_vars.items()}


def baseline(own: Condition) -> dict[str, xr.DataArray]:
    """What the injection law itself makes."""
    found = injected(
        own.law,
        confinement=own.confinement,
        velocity=own.closure.isolated,
        mean_spacing=own.mean_spacing,
    )
    return {str(key): value for key, value in found.data_vars.items()}
