"""Settings of a design: the trains that it tries, and what its answer follows from."""

from typing import Self

from viscotrain.config.device_settings import OperatingConditionsSettings
from viscotrain.config.settings import Settings, TrainsSettings
from viscotrain.fluid.parameters import Fluid


class DesignTrainsSettings(Settings):
    """Trains that a design tries: of mean spacings in d, and of a rate of beads in 1/s, if any."""

    trains: TrainsSettings
    spacing: tuple[float, ...]
    bead_rate: float | None


class DesignSettings(Settings):
    """What the answer of a design follows from, besides the trains.

    Attributes:
        trains: As they were simulated, for what is tried beyond them.
        conditions: For the limits of validity.
        ordered_variation: CV of the spacing of a train that counts as ordered.
        bead_rate: Beads that are wanted in a second; None: any.
        droplet_frequency: Droplets in a second; None: the best.
    """

    trains: TrainsSettings
    conditions: OperatingConditionsSettings
    ordered_variation: float
    bead_rate: float | None
    droplet_frequency: float | None

    def with_fluid(self, fluid: Fluid) -> Self:
        """With the fluid in its place."""
        return self.model_copy(update={"conditions": self.conditions.with_fluid(fluid)})
