"""The config of a study: what may be written, what it means, and what is wrong with it.

The pydantic models below are the only place where a key's meaning, unit, range and default stand;
`config/README.md` and `config/schema.json` are generated from them. Models are frozen and refuse
unknown keys. What a single key may hold stands in the models, what keys must agree on in
`config_problems`; one message lists every problem.

This module imports neither NGSolve nor numpy: the workflow reads it for every job.
"""

import itertools
import math
import os
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

import yaml
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_serializer,
    model_validator,
)

from viscotrain.config.problems import (
    INFINITY,
    Readable,
    disagreements,
    dotted,
    inlined,
    order_of_sections,
    problem_of_key,
)
from viscotrain.errors import ConfigError, FluidError
from viscotrain.fluid.parameters import DimensionlessFluid, Fluid, Mode, Scales, mean_spacing
from viscotrain.table.triplets import Triplet, simulations
from viscotrain.words import FEWEST_TRAIN_SPHERES

FIELD_OF_VIEW = 10.0  # of a movie's camera, in D
MAP_VOLUME_FRACTIONS = (0.002, 0.004, 0.006, 0.01)  # of the design map
CLOSEST_MAP_SPACING = 2.0  # mean spacing in d, below which injection leaves little to order
LARGEST_DRAWN_DEBORAH = 5.0  # above, stress strands are too thin to be seen in a figure

# --------------------------------------------------------------------------------------- models


def _key(
    meaning: str,
    *,
    symbol: str | None = None,
    unit: str | None = None,
    allowed: str | None = None,
    rule: str | None = None,
    default: Any = ...,
    **limits: Any,
) -> Any:
    """Declare a key; `allowed` replaces its range in words, `rule` adds to it."""
    extra = {"symbol": symbol, "unit": unit, "allowed": allowed, "rule": rule}
    extra = {name: text for name, text in extra.items() if text is not None}
    return Field(default, description=meaning, json_schema_extra=extra, **limits)


class _Section(BaseModel):
    """A part of the config: immutable, no unknown keys, no conversion of wrong types."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


DeborahNumber = Annotated[float, Field(ge=0)]
Distance = Annotated[
    float,
    Field(gt=1, allow_inf_nan=True, json_schema_extra={"allowed": "number > 1 or .inf"}),
]
FiniteDistance = Annotated[float, Field(gt=1)]
Gap = Annotated[float, Field(gt=0)]
VolumeFraction = Annotated[float, Field(gt=0, lt=1)]
Station = Annotated[float, Field(ge=0)]

Item = TypeVar("Item")
ListOf = Annotated[  # immutable, but written as a list
    tuple[Item, ...], BeforeValidator(lambda value: tuple(value) if type(value) is list else value)
]


class ModeConfig(_Section):
    """One Giesekus mode of the fluid."""

    viscosity: float = _key("polymer viscosity of the mode", symbol="eta_k", unit="Pa s", gt=0)
    relaxation_time: float = _key("relaxation time of the mode", symbol="lambda_k", unit="s", gt=0)
    mobility: float = _key(
        "Giesekus mobility of the mode; 0 is Oldroyd-B", symbol="alpha_k", unit="1", ge=0, lt=1
    )


class FluidFitConfig(_Section):
    """How a fluid is fitted to measured data."""

    modes: int | None = _key(
        "number of modes; null = chosen, up to 4, by the Bayesian information criterion",
        default=None,
        ge=0,
        le=6,
    )


class FluidConfig(_Section):
    """The fluid: a Newtonian solvent and Giesekus modes, written here or fitted to `data`."""

    solvent_viscosity: float | None = _key(
        "viscosity of the solvent; with `data` it may be left out, and is fitted then",
        symbol="eta_s",
        unit="Pa s",
        default=None,
        gt=0,
        rule="required unless data are given",
    )
    modes: ListOf[ModeConfig] | None = _key(
        "Giesekus modes in any order; an empty list is a Newtonian fluid",
        default=None,
        rule="required unless data are given",
    )
    data: ListOf[str] | None = _key(
        "CSV files of measured moduli and viscosities, relative to the config file, to which the "
        "fluid is fitted; columns below",
        default=None,
        min_length=1,
        allowed="list of paths, at least 1, none twice, in place of modes",
    )
    fit: FluidFitConfig = FluidFitConfig()

    @model_serializer(mode="wrap")
    def _as_written(self, serialize) -> dict[str, Any]:
        """Without the keys of the other way to give the fluid."""
        unused = {name for name, value in self if value is None}
        if self.data is None and self.fit == FluidFitConfig():
            unused.add("fit")
        return {name: value for name, value in serialize(self).items() if name not in unused}


class ChannelConfig(_Section):
    """The cylindrical channel."""

    diameter: float = _key("inner diameter of the channel", symbol="D", unit="m", gt=0)
    length: float = _key("length of the channel", symbol="L", unit="D", gt=0)


class ParticleConfig(_Section):
    """The spheres, all equal."""

    diameter: float = _key(
        "diameter of the spheres, less than channel.diameter", symbol="d", unit="m", gt=0
    )


class DeborahConfig(_Section):
    """The Deborah numbers of the study."""

    values: ListOf[DeborahNumber] = _key(
        "Deborah numbers of the table; 0 is the Newtonian limit, and the only one without modes",
        symbol="De",
        unit="1",
        min_length=1,
        rule="ascending",
    )
    definition: Literal["longest_mode", "mean_relaxation_time"] = _key(
        "relaxation time in De = time * Ubar/D: the longest one, or the mean over the modes "
        "weighted by their viscosities. It holds for every De in this file",
        default="longest_mode",
    )


class TableConfig(_Section):
    """The grid of triplets whose velocities are computed."""

    sp: ListOf[Distance] = _key(
        "distances of the middle sphere to the trailing one, centre to centre; "
        ".inf = no trailing neighbour",
        symbol="sp",
        unit="d",
        min_length=2,
        rule="ascending, the last one .inf",
    )
    sf: ListOf[Distance] = _key(
        "distances of the leading sphere to the middle one, centre to centre; "
        ".inf = no leading neighbour",
        symbol="sf",
        unit="d",
        min_length=2,
        rule="ascending, the last one .inf",
    )
    check: int = _key(
        "geometries between the nodes that are solved to measure the interpolation error, each in "
        "a cell of its own (so never more than the grid has cells); 0 switches it off",
        default=3,
        ge=0,
    )
    max_holes: int = _key(
        "points (De, sp, sf) that may be missing from the table before the table step fails",
        default=0,
        ge=0,
    )


class TransientConfig(_Section):
    """Start-up from fluid at rest, with spheres that move."""

    duration: float = _key(
        "time after which the start-up is over", unit="lambda_1", default=10.0, gt=0
    )
    first_step: float = _key("first time step", unit="lambda_1", default=1e-3, gt=0, le=1)
    common_tolerance: float = _key(
        "error of one time step in the velocity that all spheres share",
        unit="Ubar",
        default=2e-4,
        gt=0,
    )
    relative_tolerance: float = _key(
        "error of one time step in relative velocities", unit="Ubar", default=2e-5, gt=0
    )
    distance_tolerance: float = _key(
        "error of one time step in the distances of neighbours", unit="d", default=1e-5, gt=0
    )
    max_stretch: float = _key(
        "factor by which a gap may change, either way, before it is meshed anew",
        unit="1",
        default=1.5,
        gt=1,
    )
    max_iterations: int = _key(
        "iterations of one time step before a shorter one is tried", default=12, ge=1
    )


class DnsConfig(_Section):
    """Resolution and solution of the flow around one triplet."""

    method: Literal["quasi_steady", "transient"] = _key(
        "quasi_steady: velocities at distances that are held, all De in one job; transient: those "
        "after the start-up from rest, one job per De, as the original study did",
        default="quasi_steady",
    )
    transient: TransientConfig = TransientConfig()
    velocity_order: int = _key(
        "lowest polynomial order of the velocity that results are taken from; pressure and "
        "conformation are one order below. De = 0 is solved in order 6",
        default=4,
        ge=3,
        le=6,
    )
    sphere_elements: int = _key("elements along the half circle of a sphere", default=10, ge=4)
    axis_size: float = _key("size of the elements on the axis", unit="D", default=0.1, gt=0, le=0.5)
    gap_elements: int = _key("elements across the gap between two spheres", default=3, ge=3)
    wall_size: float = _key(
        "size of the elements far from the spheres", unit="D", default=0.2, gt=0, le=0.5
    )
    margin: float = _key(
        "distance of the outer spheres' centres to the periodic ends",
        unit="D",
        default=2.0,
        ge=1,
    )
    accuracy: float = _key(
        "estimated error of relative velocities, of the velocity itself for a single sphere, down "
        "to which meshes are refined",
        unit="Ubar",
        default=1e-5,
        gt=0,
    )
    relative_accuracy: float = _key(
        "the same as a share of the largest relative velocity; the larger one of both counts",
        unit="1",
        default=0.02,
        ge=0,
        lt=1,
    )
    max_velocity_order: int = _key(
        "highest order that the accuracy may raise it to; without effect below dns.velocity_order",
        default=7,
        ge=3,
        le=8,
    )
    max_unknowns: int = _key(
        "unknowns that a simulation may have, about, in the order and on the mesh it ends with",
        default=100_000,
        ge=1,
    )
    tolerance: float = _key(
        "update, rms over the unknowns, at which an iteration has converged",
        default=1e-7,
        gt=0,
        le=1e-4,
    )
    max_iterations: int = _key("iterations of one De step before it is given up", default=40, ge=1)
    deborah_step: float = _key(
        "largest ratio of successive De in the continuation", default=3.0, gt=1
    )
    save_fields: bool = _key(
        "also write velocity, pressure and stress of every point as VTU", default=False
    )


class TrainsConfig(_Section):
    """The simulated particle trains: one per (De, volume fraction)."""

    deborah: ListOf[DeborahNumber] = _key(
        "Deborah numbers of the trains",
        symbol="De",
        unit="1",
        min_length=1,
        rule="each one of deborah.values, none twice",
    )
    volume_fraction: ListOf[VolumeFraction] = _key(
        "volume fractions of the injected spheres; the mean spacing (2/3) (d/D)^2/phi "
        "must exceed contact, 1",
        symbol="phi",
        unit="1",
        min_length=1,
        rule="none twice",
    )
    stations: ListOf[Station] = _key(
        "positions along the channel at which spacings are recorded",
        symbol="z",
        unit="D",
        min_length=1,
        rule="ascending, none beyond channel.length",
    )
    repeats: int = _key(
        "independent trains per (De, volume fraction), for statistics", default=20, ge=1
    )
    seed: int = _key("seed of the random injection", default=1, ge=0)
    passages: int = _key(
        "spheres recorded per repeat, after the statistically steady state is reached",
        default=1000,
        ge=1,
    )


class GeometryConfig(_Section):
    """A triplet."""

    sp: Distance = _key("distance to the trailing sphere", symbol="sp", unit="d")
    sf: Distance = _key("distance to the leading sphere", symbol="sf", unit="d")


class PointConfig(GeometryConfig):
    """A triplet, with these distances at first, at one Deborah number."""

    deborah: Annotated[float, Field(gt=0)] = _key("Deborah number", symbol="De", unit="1")


class ClosureConfig(_Section):
    """A short train simulated directly, against the train model fed by the table."""

    distances: ListOf[FiniteDistance] = _key(
        "initial distances of successive spheres, trailing first; one less than spheres",
        symbol="s",
        unit="d",
        default=(1.5, 2.2, 1.3, 3.0, 1.8),
        min_length=3,
    )
    deborah: ListOf[DeborahNumber] = _key(
        "Deborah numbers of these trains",
        symbol="De",
        unit="1",
        default=(),
        rule="each one of deborah.values, none twice",
    )
    duration: float = _key("time that is simulated", unit="D/Ubar", default=100.0, gt=0)
    gaps: ListOf[Gap] = _key(
        "gaps between equally spaced spheres at which the model is compared",
        unit="d",
        default=(0.3, 0.5, 1.0, 2.0, 4.0),
        rule="ascending",
    )


class ConvergenceConfig(_Section):
    """Studies of mesh, order, box length and time step."""

    geometries: ListOf[GeometryConfig] = _key(
        "triplets whose relative velocities are computed with other settings, at all De",
        default=(),
    )


class VerificationConfig(_Section):
    """What `snakemake verification` computes on top of the study."""

    transient: ListOf[PointConfig] = _key(
        "points at which the quasi-steady velocities are compared with those after a start-up",
        default=(),
    )
    closure: ClosureConfig = ClosureConfig()
    convergence: ConvergenceConfig = ConvergenceConfig()


class FieldConfig(_Section):
    """The point of the table whose mesh and stress field are drawn."""

    sp: Distance = _key("distance to the trailing sphere, one of table.sp", symbol="sp", unit="d")
    sf: Distance = _key("distance to the leading sphere, one of table.sf", symbol="sf", unit="d")
    deborah: DeborahNumber = _key("Deborah number, one of deborah.values", symbol="De", unit="1")


class FiguresConfig(_Section):
    """Choices of the figures."""

    field: FieldConfig | None = _key(
        "point of the table whose mesh and stress field are drawn; "
        "null = the closest triplet at the largest De up to 5",
        default=None,
    )


class MoviesConfig(_Section):
    """Movies of the trains, as cameras at `trains.stations` and one that moves along see them."""

    deborah: ListOf[DeborahNumber] | None = _key(
        "Deborah numbers of the movies; null = trains.deborah; [] = no movies",
        symbol="De",
        unit="1",
        rule="each one of trains.deborah, none twice",
        default=None,
    )
    volume_fraction: ListOf[VolumeFraction] | None = _key(
        "volume fractions of the movies; null = trains.volume_fraction",
        symbol="phi",
        unit="1",
        rule="each one of trains.volume_fraction, none twice",
        default=None,
    )
    field_of_view: float | None = _key(
        "length of the channel that a camera sees, at most channel.length; "
        "null = 10, or the whole of a shorter channel",
        unit="D",
        default=None,
        gt=0,
    )
    interval: float = _key(
        "time of the flow between two frames of a camera at a station; spheres move by about "
        "1.7 D in a unit of it",
        unit="D/Ubar",
        default=0.05,
        gt=0,
    )
    frames: int = _key("frames of a movie", default=200, ge=2)
    frame_rate: float = _key(
        "frames per second at which movies are played", unit="1/s", default=25.0, gt=0, le=120
    )
    width: int = _key(
        "width of a movie in pixels", default=1280, ge=480, le=3840, multiple_of=2, rule="even"
    )


class DesignMapConfig(_Section):
    """Trains over a range of conditions: spacing law and design map."""

    deborah: ListOf[DeborahNumber] | None = _key(
        "Deborah numbers of the map; null = deborah.values but 0; [] = no map",
        symbol="De",
        unit="1",
        rule="each one of deborah.values, ascending",
        default=None,
    )
    volume_fraction: ListOf[VolumeFraction] | None = _key(
        "volume fractions of the map; null = 0.002, 0.004, 0.006 and 0.01, as far as their mean "
        "spacing is at least 2 d and the channel holds a train",
        symbol="phi",
        unit="1",
        rule="ascending",
        default=None,
    )
    stations: int = _key(
        "positions at which spacings are recorded, evenly from inlet to outlet", default=41, ge=2
    )
    repeats: int = _key("independent trains per condition", default=4, ge=1)
    passages: int = _key("spheres recorded per repeat", default=500, ge=2)
    ordered_variation: float = _key(
        "coefficient of variation of the spacing below which a train counts as ordered",
        default=0.25,
        gt=0,
    )


class Study(_Section):
    """A whole config, valid in itself; `load_study` and `parse_study` make one."""

    study: str = _key(
        "name of the study; results go to `results/<study>/`",
        pattern="^[A-Za-z0-9][A-Za-z0-9_-]*$",
        max_length=64,
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
    verification: VerificationConfig = VerificationConfig()

    @model_validator(mode="after")
    def _agree(self) -> Self:
        problems = disagreements(Readable(self.model_dump()))
        if problems:
            raise ConfigError("config", [str(problem) for problem in problems])
        return self

    @property
    def confinement(self) -> float:
        """Sphere diameter over channel diameter, beta = d/D."""
        return self.particle.diameter / self.channel.diameter

    @property
    def physical_fluid(self) -> Fluid:
        """The fluid in physical units.

        Raises:
            FluidError: The fluid is not fitted yet.
        """
        if self.fluid.modes is None:
            raise FluidError("the fluid is not fitted yet; `fluid_fit` and `with_fluid` do it")
        modes = (Mode(**mode.model_dump()) for mode in self.fluid.modes)
        return Fluid(self.fluid.solvent_viscosity, tuple(modes))

    @property
    def dimensionless_fluid(self) -> DimensionlessFluid:
        """The fluid in units of its zero-shear viscosity and longest relaxation time.

        Raises:
            FluidError: The fluid is not fitted yet.
        """
        fluid = self.physical_fluid
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

    def scales(self, deborah: float) -> Scales:
        """Physical factors at a De in the config's definition."""
        return Scales.at(
            self.deborah_longest_mode(deborah),
            self.dimensionless_fluid,
            zero_shear_viscosity=self.physical_fluid.zero_shear_viscosity,
            longest_relaxation_time=self.physical_fluid.longest_relaxation_time,
            channel_diameter=self.channel.diameter,
            particle_diameter=self.particle.diameter,
        )

    def with_fluid(self, fluid: FluidConfig) -> Self:
        """The same study with another fluid, as one that was fitted.

        Raises:
            ConfigError: The study cannot be made with this fluid.
        """
        return parse_study(
            self.model_dump() | {"fluid": fluid.model_dump()}, source=f"study {self.study}"
        )

    def mean_spacing(self, volume_fraction: float) -> float:
        """s* of an equally spaced train, in d."""
        return mean_spacing(self.confinement, volume_fraction)

    def dns_settings(self) -> dict[str, Any]:
        """What the result of one geometry depends on, as plain data."""
        used = {"fluid": True, "channel": {"diameter"}, "particle": True}
        included = used | {"deborah": True, "dns": True}
        quasi_steady = {"dns": {"method", "transient"}}
        return self.model_dump(mode="json", include=included, exclude=quasi_steady)

    def transient_settings(self) -> dict[str, Any]:
        """What the start-up of one geometry depends on, as plain data."""
        return self.dns_settings() | {"transient": self.dns.transient.model_dump()}

    def rheology_settings(self) -> dict[str, Any]:
        """What the figure of the fluid depends on, as plain data."""
        return self.model_dump(mode="json", include={"fluid": True, "deborah": True})

    def shear_rates(self) -> dict[float, float]:
        """Mean velocity over channel diameter, in 1/s, by De of the config, without De = 0."""
        return {
            De: self.deborah_longest_mode(De) / self.physical_fluid.longest_relaxation_time
            for De in self.deborah.values
            if De > 0
        }

    def trains_settings(self) -> dict[str, Any]:
        """What one train depends on, given the table, as plain data."""
        used = {"stations", "repeats", "seed", "passages"}
        return self.trains.model_dump(include=used) | {"length": self.channel.length}

    def schematic_settings(self) -> dict[str, Any]:
        """What the schematic depends on, as plain data."""
        used = {"channel": True, "particle": True, "table": {"sp", "sf"}, "dns": {"margin"}}
        settings = self.model_dump(mode="json", include=used)
        return settings | {"volume_fraction": self.trains.volume_fraction[0]}

    def movie_conditions(self) -> tuple[tuple[float, float], ...]:
        """(De, volume fraction) of the trains that are filmed."""
        deborah, phi = self.movies.deborah, self.movies.volume_fraction
        return tuple(
            itertools.product(
                self.trains.deborah if deborah is None else deborah,
                self.trains.volume_fraction if phi is None else phi,
            )
        )

    def movie_field_of_view(self) -> float:
        """Length of a camera's window in D: as configured, else chosen."""
        chosen = min(FIELD_OF_VIEW, self.channel.length)
        return chosen if self.movies.field_of_view is None else self.movies.field_of_view

    def film_settings(self) -> dict[str, Any]:
        """What the positions in the movies depend on, given table and train, as plain data."""
        used = {"interval", "frames"}
        return self.movies.model_dump(include=used) | {"field_of_view": self.movie_field_of_view()}

    def map_conditions(self) -> tuple[tuple[float, float], ...]:
        """(De, volume fraction) of the design map, the volume fraction running fastest."""
        deborah, phi = self.design_map.deborah, self.design_map.volume_fraction
        if deborah is None:
            deborah = [De for De in self.deborah.values if De > 0] or self.deborah.values
        if phi is None:
            phi = [phi for phi in MAP_VOLUME_FRACTIONS if self._suits_map(phi)]
        return tuple(itertools.product(deborah, phi or sorted(self.trains.volume_fraction)))

    def _suits_map(self, volume_fraction: float) -> bool:
        spacing = self.mean_spacing(volume_fraction)
        fits = self.channel.length >= FEWEST_TRAIN_SPHERES * spacing * self.confinement
        return fits and spacing >= CLOSEST_MAP_SPACING

    def map_settings(self) -> dict[str, Any]:
        """What one train of the design map depends on, given the table, as plain data."""
        length, intervals = self.channel.length, self.design_map.stations - 1
        return self.design_map.model_dump(include={"repeats", "passages"}) | {
            "stations": [length * n / intervals for n in range(intervals + 1)],
            "seed": self.trains.seed,
            "length": length,
        }

    def field_point(self) -> FieldConfig:
        """The point of the table whose field is drawn: as configured, else chosen."""
        if self.figures.field is not None:
            return self.figures.field
        moderate = [
            deborah
            for deborah in self.deborah.values
            if self.deborah_longest_mode(deborah) <= LARGEST_DRAWN_DEBORAH
        ]
        return FieldConfig(
            sp=self.table.sp[0],
            sf=self.table.sf[0],
            deborah=moderate[-1] if moderate else self.deborah.values[0],
        )

    def resolved_yaml(self) -> str:
        """The config with every default written out, as YAML text that loads to the same study."""
        return yaml.safe_dump(self.model_dump(), sort_keys=False, default_flow_style=None, width=99)


# -------------------------------------------------------------------------------- names, points


def number_name(value: float) -> str:
    """The shortest text that reads back as `value`, for file names: 5, 1.1, inf.

    Different numbers have different names.
    """
    return repr(float(value) + 0.0).removesuffix(".0")


def geometry_name(sp: float, sf: float) -> str:
    """File name of a geometry: sp1.1_sfinf."""
    return f"sp{number_name(sp)}_sf{number_name(sf)}"


def point_name(sp: float, sf: float, deborah: float) -> str:
    """File name of a geometry at one Deborah number: sp1.1_sfinf_De5."""
    return f"{geometry_name(sp, sf)}_De{number_name(deborah)}"


def train_name(deborah: float, volume_fraction: float) -> str:
    """File name of a train: De5_phi0.004."""
    return f"De{number_name(deborah)}_phi{number_name(volume_fraction)}"


def parse_distance(name: str) -> float:
    """The distance in a file name, the inverse of `number_name`."""
    return float(name)


def check_geometries(study: Study) -> tuple[tuple[float, float], ...]:
    """The `table.check` geometries between the nodes, where interpolation is compared with DNS.

    Each lies in the middle, in 1/s, of a cell of its own. The first cell is the one next to
    contact; the others follow a low-discrepancy sequence (R2, M. Roberts 2018), so a larger number
    keeps the earlier points. Cells that reach to infinity count only where an axis has no other.
    """
    cells_sp, cells_sf = _cell_middles(study.table.sp), _cell_middles(study.table.sf)
    wanted = min(study.table.check, len(cells_sp) * len(cells_sf))
    plastic = 1.324717957244746  # root of x^3 = x + 1, from which R2 takes its two steps
    chosen: dict[tuple[float, float], None] = {}
    for k in itertools.count():
        if len(chosen) == wanted:
            return tuple(chosen)
        sp = cells_sp[int(k / plastic % 1 * len(cells_sp))]
        sf = cells_sf[int(k / plastic**2 % 1 * len(cells_sf))]
        chosen[sp, sf] = None


def simulated(study: Study) -> dict[Triplet, tuple[float, ...]]:
    """Geometries (sp, sf) that are simulated, grid and check, each at its Deborah numbers.

    Flows that are the same are simulated once, see `triplets`.
    """
    deborahs = study.deborah.values
    checks = simulations(check_geometries(study), deborahs)
    return simulations(study.geometries, deborahs) | checks


def simulated_deborahs(study: Study, sp: float, sf: float) -> tuple[float, ...]:
    """Deborah numbers at which a geometry is simulated; all of them for one of no table."""
    return simulated(study).get((sp, sf), study.deborah.values)


def _cell_middles(nodes: Sequence[float]) -> list[float]:
    """Middles in 1/s, to four digits, of the cells between finite nodes."""
    finite = [s for s in nodes if math.isfinite(s)]
    nodes = finite if len(finite) > 1 else [*finite, INFINITY]
    middles = []
    for low, high in itertools.pairwise(nodes):
        middle = 2 / (1 / low + 1 / high)
        rounded = float(f"{middle:.4g}")
        middles.append(rounded if low < rounded < high else middle)
    return middles


# ------------------------------------------------------------------------------------- reading


@cache
def schema() -> dict[str, Any]:
    """JSON schema of the config, from the models."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **Study.model_json_schema(),
        "title": "viscotrain study",
        "description": "Config of a viscotrain study.",
    }


def load_study(path: str | Path) -> Study:
    """Read and check a YAML file.

    Raises:
        ConfigError: The file or its content is wrong; one message lists every problem.
    """
    data, repeated = read_yaml(path)
    return parse_study(data, source=str(path), known_problems=repeated)


def parse_study(data: Any, source: str = "config", known_problems: Sequence[str] = ()) -> Study:
    """Check a config that has been read already, as Snakemake does.

    Args:
        data: The mapping of keys to values.
        source: What the error message calls the config.
        known_problems: Lines to put before the problems found here, as `read_yaml` returns them.

    Raises:
        ConfigError: One message lists every problem by key: what was found, what is allowed.
    """
    study, problems = None, []
    try:
        study = Study.model_validate(data)
    except ValidationError as error:
        # The one value error is `Study._agree`, whose checks are repeated here in any case.
        wrong = [e for e in error.errors(include_url=False) if e["type"] != "value_error"]
        words = inlined(schema())
        problems = [problem_of_key(e, words) for e in wrong]
        problems += disagreements(Readable(data, wrong={e["loc"] for e in wrong}))
        problems.sort(key=order_of_sections(words))
    lines = [*known_problems, *map(str, problems)]
    if study is None or lines:
        raise ConfigError(source, lines)
    return study


def fitted_fluid_file(study: Study) -> str | None:
    """Where the workflow puts the fitted fluid; None for a study whose config writes its fluid."""
    return None if study.fluid.data is None else f"results/{study.study}/fluid_fit/fluid.yaml"


def with_fitted_fluid(study: Study, folder: str | Path = ".") -> Study:
    """The study as it is computed: with the fluid that the workflow has fitted, if it names data.

    Args:
        study: Of a config.
        folder: The one in which the workflow runs, which holds `results/`.

    Raises:
        ConfigError: The fluid is not fitted yet, or the study cannot be made with it.
    """
    file = fitted_fluid_file(study)
    if file is None:
        return study
    if not (Path(folder) / file).exists():
        raise ConfigError(
            f"study {study.study}",
            [f"fluid.data: not fitted yet; make {file} with Snakemake before"],
        )
    fluid, _ = read_yaml(Path(folder) / file)
    return study.with_fluid(FluidConfig.model_validate(fluid["fluid"]))


def data_files(study: Study, config_file: str | Path) -> list[str]:
    """Paths of the measured data of a config file.

    Raises:
        ConfigError: A file does not exist.
    """
    names = study.fluid.data or ()
    paths = [Path(os.path.relpath(Path(config_file).parent / name)).as_posix() for name in names]
    missing = [
        f"fluid.data[{n}]: there is no file {path}; allowed: path relative to the config file"
        for n, path in enumerate(paths)
        if not Path(path).is_file()
    ]
    if missing:
        raise ConfigError(str(config_file), missing)
    return paths


def read_yaml(path: str | Path) -> tuple[Any, list[str]]:
    """Content of a YAML file, and a line of text for every key that stands there twice.

    Raises:
        ConfigError: There is no such file, or it is not YAML.
    """
    try:
        text = Path(path).read_bytes()
    except OSError as error:
        raise ConfigError(str(path), [f"cannot be read: {error.strerror}"]) from error
    try:
        return yaml.safe_load(text), list(_repeated_keys(yaml.compose(text, yaml.SafeLoader)))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        raise ConfigError(str(path), [f"not YAML: {where}{error.problem}"]) from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError(str(path), [f"not YAML: {reason}"]) from error


def _repeated_keys(node: yaml.Node | None, path: tuple = ()) -> Iterator[str]:
    """Keys that occur twice in a mapping; the YAML reader itself keeps the last, silently."""
    if isinstance(node, yaml.MappingNode):
        first_line: dict[str, int] = {}
        for key, value in node.value:
            name, line = str(key.value), key.start_mark.line + 1
            if name in first_line:
                lines = f"lines {first_line[name]} and {line}"
                yield f"{dotted((*path, name))}: found twice, in {lines}; allowed: once"
            first_line.setdefault(name, line)
            yield from _repeated_keys(value, (*path, name))
    elif isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            yield from _repeated_keys(item, (*path, index))
