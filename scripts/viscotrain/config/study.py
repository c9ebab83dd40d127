"""A whole study: all sections of a config, and what follows from them together."""

import itertools
from collections.abc import Sequence
from typing import Self

from pydantic import model_validator

from viscotrain.config.device_models import ChannelConfig, ParticleConfig
from viscotrain.config.keys import Section, key
from viscotrain.config.models import (
    BudgetConfig,
    DeborahConfig,
    DnsConfig,
    FluidConfig,
    TableConfig,
)
from viscotrain.config.outputs import (
    DesignConfig,
    DesignMapConfig,
    EncapsulationConfig,
    FieldConfig,
    FiguresConfig,
    MoviesConfig,
    TrainsConfig,
    VerificationConfig,
)
from viscotrain.config.problems import disagreements
from viscotrain.config.readable import Readable
from viscotrain.errors import ConfigError
from viscotrain.fluid.parameters import DimensionlessFluid
from viscotrain.words import FEWEST_TRAIN_SPHERES

STATIONS = 5  # at which spacings are recorded, from inlet to outlet
FIELD_OF_VIEW = 10.0  # of a movie's camera, in D
MAP_VOLUME_FRACTIONS = (0.002, 0.004, 0.006, 0.01)  # of the design map
CLOSEST_MAP_SPACING = 2.0  # mean spacing in d, below which injection leaves little to order
LARGEST_DRAWN_DEBORAH = 31.0  # above, stress strands are too thin to be seen in a figure
MOST_DRAWN_DEBORAHS = 4


class Study(Section):
    """A whole config, valid in itself; `load_study` and `parse_study` make one."""

    study: str = key(
        "name of the study; results go to `results/<study>/`",
        # the second part: of one diameter among several, see `sweep`
        pattern="^[A-Za-z0-9][A-Za-z0-9_-]{0,63}(/beta[0-9.e-]{1,24})?$",
        allowed="text of letters, digits, - and _ (a name made of digits in quotes)",
    )
    fluid: FluidConfig
    channel: ChannelConfig
    particle: ParticleConfig
    deborah: DeborahConfig
    table: TableConfig
    dns: DnsConfig = DnsConfig()
    trains: TrainsConfig
    figures: FiguresConfig = FiguresConfig()
    movies: MoviesConfig = MoviesConfig()
    design_map: DesignMapConfig = DesignMapConfig()
    encapsulation: EncapsulationConfig = EncapsulationConfig()
    design: DesignConfig = DesignConfig()
    verification: VerificationConfig = VerificationConfig()
    budget: BudgetConfig = BudgetConfig()

    @model_validator(mode="after")
    def _agree(self) -> Self:
        problems = disagreements(Readable(self.model_dump()))
        if problems:
            raise ConfigError("config", [str(problem) for problem in problems])
        return self

    @property
    def confinement(self) -> float:
        """Sphere diameter over channel diameter, beta = d/D."""
        return self.particle.diameter / self.channel.inscribed_diameter

    @property
    def dimensionless_fluid(self) -> DimensionlessFluid:
        """The fluid in units of its zero-shear viscosity and longest relaxation time.

        Raises:
            FluidError: The fluid is not fitted yet.
        """
        fluid = self.fluid.physical()
        return DimensionlessFluid.from_physical(fluid.solvent_viscosity, fluid.modes)

    @property
    def geometries(self) -> tuple[tuple[float, float], ...]:
        """The grid of the table: all (sp, sf), sf running fastest."""
        return tuple(itertools.product(self.table.sp, self.table.sf))

    def at(self, deborahs: Sequence[float]) -> Self:
        """The same study at some of its Deborah numbers."""
        section = self.deborah.model_copy(update={"values": tuple(deborahs)})
        return self.model_copy(update={"deborah": section})

    def deborah_longest_mode(self, deborah: float) -> float:
        """De of the longest mode, lambda_1 Ubar/D, for a De in the config's definition."""
        if self.deborah.definition == "longest_mode" or not self.fluid.modes:
            return deborah
        return deborah / self.dimensionless_fluid.mean_relaxation_time

    def mean_spacing(self, volume_fraction: float) -> float:
        """s* of an equally spaced train, in d."""
        return self.channel.section.mean_spacing(self.confinement, volume_fraction)

    @property
    def _elastic(self) -> tuple[float, ...]:
        """Deborah numbers but 0, unless there is no other."""
        return tuple(De for De in self.deborah.values if De > 0) or self.deborah.values

    @property
    def train_deborahs(self) -> tuple[float, ...]:
        """Deborah numbers of the trains."""
        given = self.trains.deborah
        return self._elastic if given is None else given

    @property
    def stations(self) -> tuple[float, ...]:
        """Where spacings are recorded, in D."""
        given, last = self.trains.stations, STATIONS - 1
        if given is None:
            return tuple(self.channel.length * n / last for n in range(STATIONS))
        return given

    @property
    def closure_deborahs(self) -> tuple[float, ...]:
        """Deborah numbers of the short trains that are simulated directly."""
        given = self.verification.closure.deborah
        return self.deborah.values if given is None else given

    def movie_conditions(self) -> tuple[tuple[float, float], ...]:
        """(De, volume fraction, as that of the trains) of the trains that are filmed."""
        deborah, phi = self.movies.deborah, self.movies.volume_fraction
        return tuple(
            itertools.product(
                self.train_deborahs if deborah is None else deborah,
                self.trains.fractions if phi is None else phi,
            )
        )

    def movie_field_of_view(self) -> float:
        """Length of a camera's window in D: as configured, else chosen."""
        chosen = min(FIELD_OF_VIEW, self.channel.length)
        return chosen if self.movies.field_of_view is None else self.movies.field_of_view

    def map_conditions(self) -> tuple[tuple[float, float], ...]:
        """(De, volume fraction, see `map_feed`) of the design map; the latter runs fastest."""
        deborah: Sequence[float] | None = self.design_map.deborah
        if deborah is None:
            deborah = self._elastic
        given = self.design_map.feed_volume_fraction or self.design_map.volume_fraction
        phi = self._usual_map() if given is None else given
        return tuple(itertools.product(deborah, phi or sorted(self.trains.fractions)))

    @property
    def map_feed(self) -> bool:
        """Whether the volume fractions of the design map are those of the feed."""
        if self.design_map.volume_fraction is None and not self._usual_map():
            return self.design_map.feed_volume_fraction is not None or self.trains.feed
        return self.design_map.feed_volume_fraction is not None

    def _usual_map(self) -> list[float]:
        return [phi for phi in MAP_VOLUME_FRACTIONS if self._suits_map(phi)]

    def _suits_map(self, volume_fraction: float) -> bool:
        spacing = self.mean_spacing(volume_fraction)
        fits = self.channel.length >= FEWEST_TRAIN_SPHERES * spacing * self.confinement
        return fits and spacing >= CLOSEST_MAP_SPACING

    def field_point(self) -> FieldConfig | None:
        """The triplet of the table whose field is drawn: as configured, else chosen.

        None where the table is given and no triplet is: nothing needs to be simulated then.
        """
        if self.figures.field is not None or self.table.file is not None:
            return self.figures.field
        moderate = [
            deborah
            for deborah in self.deborah.values
            if self.deborah_longest_mode(deborah) <= LARGEST_DRAWN_DEBORAH
        ] or self.deborah.values[:1]
        drawn, last = min(MOST_DRAWN_DEBORAHS, len(moderate)), len(moderate) - 1
        evenly = [round(n * last / max(drawn - 1, 1)) for n in range(drawn)]
        return FieldConfig(
            sp=self.table.sp[0],
            sf=self.table.sf[0],
            deborah=tuple(moderate[n] for n in evenly),
        )
