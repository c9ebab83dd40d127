"""What each stage is given: typed, dimensionless where it computes, and nothing else.

A job's numbers follow from its settings, its input files and its code. `stages` makes settings from
a study; the workflow passes them to its jobs, which make them from there again, and datasets hold
them. A fluid that is to be fitted is not known when the workflow is planned: its place is empty
until `with_fluid` fills it from the fitted file, which is an input of the job.

Two settings are the same if their texts are, in which numbers have `DIGITS` significant digits. A
job computes with all digits; but d/D of a device that is scaled up, 30 um/150 um, may differ from
20 um/100 um in the last bit, and that must not repeat weeks of simulations.
"""

import math
from dataclasses import asdict
from typing import Any, Self

import yaml
from pydantic import BaseModel, ConfigDict

from viscotrain.config.models import FluidConfig, Resolution, TransientConfig
from viscotrain.errors import FluidError
from viscotrain.fluid.channel import CrossSection
from viscotrain.fluid.parameters import DimensionlessFluid, Fluid

DIGITS = 12  # far below the accuracy of any result, far above what a division rounds off


class Stated(dict):
    """Settings as plain data, all digits kept, whose text has numbers rounded to `DIGITS`.

    Snakemake compares the texts (`repr`) of parameters, and hands them on as they are.
    """

    def __repr__(self) -> str:
        return repr(_rounded(dict(self)))

    def text(self) -> str:
        """The same as YAML, as datasets hold it."""
        return _as_yaml(_rounded(dict(self)))


def _as_yaml(data: Any) -> str:
    """Plain data as YAML text, in the given order."""
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=99)


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return value


class Settings(BaseModel):
    """Settings of a stage: immutable, no unknown names."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def stated(self) -> Stated:
        """As plain data; `model_validate` makes the same settings of it."""
        return Stated(self.model_dump())

    def with_fluid(self, fluid: Fluid) -> Self:
        """With the fluid in its place, for settings that have one."""
        return self


class StudyConfigSettings(Settings):
    """The whole config with every default, to be written down."""

    config: dict[str, Any]

    def text(self) -> str:
        """As YAML, which loads to the same study."""
        return _as_yaml(self.config)

    def with_fluid(self, fluid: Fluid) -> Self:
        """With the fluid as a config writes it."""
        density = self.config["fluid"]["density"]
        written = FluidConfig.model_validate(asdict(fluid) | {"density": density}).model_dump()
        return self.model_copy(update={"config": self.config | {"fluid": written}})


class FluidFitSettings(Settings):
    """The fit of a fluid: number of modes, and what is known in Pa s, s and 1; None = to be found.

    Relaxation times and mobilities are those of the first modes, the slowest one first.
    """

    modes: int | None
    solvent_viscosity: float | None
    relaxation_times: tuple[float | None, ...]
    mobilities: tuple[float | None, ...]


class CaseSettings(Settings):
    """What velocities are of, however they are computed.

    Attributes:
        confinement: d/D.
        dimensionless_fluid: In eta_0 and lambda_1; None until it is fitted.
        deborah: Deborah numbers as the study defines them, by which results are named.
        longest_modes: lambda_1 Ubar/D of each; None if they follow from the fluid, which is to be
            fitted, as De of the mean relaxation time.
    """

    confinement: float
    dimensionless_fluid: DimensionlessFluid | None
    deborah: tuple[float, ...]
    longest_modes: tuple[float, ...] | None

    @property
    def known_fluid(self) -> DimensionlessFluid:
        """The fluid of a job that computes."""
        assert self.dimensionless_fluid is not None  # a job has it, by `with_fluid` if fitted
        return self.dimensionless_fluid

    def with_fluid(self, fluid: Fluid) -> Self:
        """With the fluid in its place, and De of its longest mode.

        Raises:
            FluidError: There is a Deborah number above 0, but no mode.
        """
        if not fluid.modes and max(self.deborah) > 0:
            raise FluidError(
                f"the fitted fluid has no modes, found De = {max(self.deborah):g}; "
                "allowed: 0 (deborah.values)"
            )
        scaled = DimensionlessFluid.from_physical(fluid.solvent_viscosity, fluid.modes)
        longest = self.longest_modes
        if longest is None:
            longest = tuple(longest_mode(De, scaled, mean=True) for De in self.deborah)
        return self.model_copy(update={"dimensionless_fluid": scaled, "longest_modes": longest})

    def at(self, deborahs: tuple[float, ...] | list[float]) -> Self:
        """The same at some of its Deborah numbers."""
        update: dict[str, Any] = {"deborah": tuple(deborahs)}
        if self.longest_modes is not None:
            update["longest_modes"] = tuple(map(self.deborah_longest_mode, deborahs))
        return self.model_copy(update=update)

    def deborah_longest_mode(self, deborah: float) -> float:
        """lambda_1 Ubar/D at a Deborah number of the study."""
        assert self.longest_modes is not None  # a job has them, by `with_fluid` if fitted
        return self.longest_modes[self.deborah.index(deborah)]

    def deborah_mean_relaxation_time(self, deborah: float) -> float:
        """lambda_mean Ubar/D at a Deborah number of the study."""
        longest = self.deborah_longest_mode(deborah)
        return longest * self.known_fluid.mean_relaxation_time if longest > 0 else 0.0


class FlowSettings(CaseSettings):
    """Flows around spheres that hold their distances, with their resolution and solution."""

    dns: Resolution


class FieldSettings(FlowSettings):
    """The flow around one triplet (sp, sf), in d."""

    sp: float
    sf: float


class TransientSettings(FlowSettings):
    """Spheres that move, from rest."""

    transient: TransientConfig


class ClosureTrainSettings(Settings):
    """A short train: the distances of its spheres at first, in d, for a duration in D/Ubar."""

    flow: TransientSettings
    distances: tuple[float, ...]
    duration: float

    def with_fluid(self, fluid: Fluid) -> Self:
        """With the fluid of the flow in its place."""
        return self.model_copy(update={"flow": self.flow.with_fluid(fluid)})


class ClosureGapSettings(Settings):
    """Equally spaced spheres, so many, at Deborah numbers out of those of the flow."""

    flow: FlowSettings
    spheres: int
    deborah: tuple[float, ...]

    def with_fluid(self, fluid: Fluid) -> Self:
        """With the fluid of the flow in its place."""
        return self.model_copy(update={"flow": self.flow.with_fluid(fluid)})


class TableSettings(Settings):
    """What the table holds, how exact it must be, and how many holes it may have.

    Attributes:
        sp, sf: Distances of triplets in d.
        pair: Distances of pairs alone in d, those of `sp` and `sf` among them.
        deborah: Deborah numbers as the study defines them.
        line_spacing: Distances from one line of triplets that are simulated to the next.
        accuracy: Error in Ubar that the interpolation may have then, in relative velocities.
        relative_accuracy: The same as a share of the largest relative velocity of a geometry.
        max_holes: Points that may be without a solution.
    """

    sp: tuple[float, ...]
    sf: tuple[float, ...]
    pair: tuple[float, ...]
    deborah: tuple[float, ...]
    line_spacing: int
    accuracy: float
    relative_accuracy: float
    max_holes: int


class TrainsSettings(Settings):
    """Trains in a channel of some length: lengths in D; stations ascending.

    Closure and injection are names; `feed`: volume fractions are those of what is poured in.
    """

    closure: str
    injection: str
    feed: bool
    memory: float
    diameter_variation: float
    confinement: float
    section: CrossSection
    length: float
    stations: tuple[float, ...]
    repeats: int
    passages: int
    seed: int


class MeasuredSettings(Settings):
    """What measured spacings may be of: stations in D, De and volume fractions of the trains."""

    station: tuple[float, ...]
    deborah: tuple[float, ...]
    volume_fraction: tuple[float, ...]


class ConditionsSettings(Settings):
    """De and volume fractions of trains, and the CV of the spacing of those that are ordered."""

    deborah: tuple[float, ...]
    fractions: tuple[float, ...]
    ordered_variation: float


class OrderSettings(ConditionsSettings):
    """Order of equally spaced trains in a channel of some length, in D, by an injection law."""

    closure: str
    injection: str
    feed: bool
    confinement: float
    section: CrossSection
    length: float


class ChannelFlowSettings(CaseSettings):
    """The flow without spheres, in a channel of some section."""

    section: CrossSection


class DiameterVariationSettings(ConditionsSettings):
    """Trains whose diameters vary by more and more; their own variation is one of them."""

    trains: TrainsSettings


class ConfinementSettings(Settings):
    """Several diameters: names of their folders, length of the channel in D, accuracy in Ubar."""

    diameters: tuple[str, ...]
    length: float
    accuracy: float


class FilmSettings(Settings):
    """What cameras see: the length of a window in D, the time between frames in D/Ubar."""

    field_of_view: float
    interval: float
    frames: int
    section: CrossSection


class MoviesSettings(Settings):
    """How a film is shown: width in pixels, frames per second."""

    width: int
    frame_rate: float


class DesignMapSettings(Settings):
    """The design map: when a train counts as ordered, by which closure trains were simulated."""

    closure: str
    section: CrossSection
    ordered_variation: float


class EncapsulationSettings(Settings):
    """Droplets in a second, None for the best; beads that are wanted in a second, None for none."""

    droplet_frequency: float | None
    bead_rate: float | None


def longest_mode(deborah: float, fluid: DimensionlessFluid | None, mean: bool) -> float:
    """lambda_1 Ubar/D for a De of the mean relaxation time, or of the longest one already."""
    if not mean or fluid is None or not fluid.modes or math.isnan(fluid.mean_relaxation_time):
        return deborah
    return deborah / fluid.mean_relaxation_time
