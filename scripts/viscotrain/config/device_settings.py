"""Settings of what shows a study in physical units, or as a drawing: its fluid, device, figures.

What `settings` says of the settings of stages holds for these.
"""

from typing import Any, Self

from viscotrain.config.settings import Settings, longest_mode
from viscotrain.fluid.channel import CrossSection
from viscotrain.fluid.parameters import DimensionlessFluid, Fluid


class SchematicSettings(Settings):
    """What is drawn to scale: distances in d, lengths in D; a volume fraction, at one De."""

    confinement: float
    section: CrossSection
    sp: tuple[float, ...]
    sf: tuple[float, ...]
    margin: float
    volume_fraction: float
    feed: bool
    deborah: float
    channel_length: float


class RheologySettings(Settings):
    """The fluid in physical units, and the Deborah numbers at which the study uses it."""

    fluid: Fluid | None
    deborah: tuple[float, ...]
    mean: bool

    @property
    def known_fluid(self) -> Fluid:
        """The fluid of a job that computes."""
        assert self.fluid is not None  # a job has it, by `with_fluid` if fitted
        return self.fluid

    def with_fluid(self, fluid: Fluid) -> Self:
        """With the fluid in its place."""
        return self.model_copy(update={"fluid": fluid})

    def longest_modes(self) -> dict[float, float]:
        """lambda_1 Ubar/D by De of the study."""
        fluid = self.known_fluid
        scaled = DimensionlessFluid.from_physical(fluid.solvent_viscosity, fluid.modes)
        return {De: longest_mode(De, scaled, self.mean) for De in self.deborah}

    def shear_rates(self) -> dict[float, float]:
        """Mean velocity over channel diameter, in 1/s, by De of the study, without De = 0."""
        fluid = self.known_fluid
        rates = {} if not fluid.modes else self.longest_modes()
        return {De: rate / fluid.longest_relaxation_time for De, rate in rates.items() if De > 0}


class UnitsSettings(RheologySettings):
    """The same fluid in its device: diameters D of the channel and d of particles in m."""

    channel_diameter: float
    section: CrossSection
    particle_diameter: float


class OperatingConditionsSettings(RheologySettings):
    """What decides on the validity of a condition: densities in kg/m^3, None of spheres unknown."""

    fluid_density: float
    particle_density: float | None
    section: CrossSection


class FitSpreadSettings(RheologySettings):
    """Draws of the fitted fluid in a channel: D in m, length in D; the config that they change."""

    draws: int
    channel_diameter: float
    section: CrossSection
    channel_length: float
    config: dict[str, Any]

    def relaxation_time(self, fluid: Fluid) -> float:
        """The one in s that De of the study is defined by; 1 without modes, where De is 0."""
        if not fluid.modes:
            return 1.0
        scaled = DimensionlessFluid.from_physical(fluid.solvent_viscosity, fluid.modes)
        share = scaled.mean_relaxation_time if self.mean else 1.0
        return fluid.longest_relaxation_time * share


class FiguresSettings(Settings):
    """What figures need besides their data; the last two for those of the study itself."""

    confinement: float
    section: CrossSection
    schematic: SchematicSettings | None = None
    rheology: RheologySettings | None = None

    def with_fluid(self, fluid: Fluid) -> Self:
        """With the fluid that is drawn in its place."""
        if self.rheology is None:
            return self
        return self.model_copy(update={"rheology": self.rheology.with_fluid(fluid)})
