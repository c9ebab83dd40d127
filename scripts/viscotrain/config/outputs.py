"""What a config may say about what is made of the velocities: trains, pictures, verification."""

from typing import Annotated, Literal

from pydantic import Field

from viscotrain.config.keys import (
    LARGEST_DEBORAH,
    DeborahNumber,
    Distance,
    FiniteDistance,
    Gap,
    ListOf,
    PathText,
    Section,
    Station,
    VolumeFraction,
    key,
)
from viscotrain.words import ORDERED_VARIATION


class TrainsConfig(Section):
    """The simulated particle trains: one per (De, volume fraction)."""

    deborah: ListOf[DeborahNumber] | None = key(
        "Deborah numbers of the trains; null = deborah.values but 0",
        symbol="De",
        unit="1",
        default=None,
        min_length=1,
        rule="each one of deborah.values, none twice",
    )
    volume_fraction: ListOf[VolumeFraction] | None = key(
        "volume fractions of the spheres in the channel; the mean spacing, (2/3) (d/D)^2/phi "
        "in a tube, must exceed contact, 1",
        symbol="phi",
        unit="1",
        default=None,
        min_length=1,
        rule="at least 1, none twice; this one or trains.feed_volume_fraction",
    )
    feed_volume_fraction: ListOf[VolumeFraction] | None = key(
        "the other way to say how much: volume fractions of what is poured in, larger by the "
        "velocity of a single sphere in Ubar, 1.65 (De = 5) to 1.95 (De = 0) at d/D = 0.2",
        symbol="phi_feed",
        unit="1",
        default=None,
        min_length=1,
        rule="at least 1, none twice; this one or trains.volume_fraction",
    )
    injection: Literal["uniform", "poisson", "even"] = key(
        "law of the intervals at which spheres enter. uniform: between contact and as much above "
        "the mean, as in the original study; poisson: as in a real suspension, at random but "
        "without overlap; even: all equal, as behind a device that spaces them. It sets how even "
        "a train is from the start on",
        default="uniform",
    )
    closure: Literal["every_sphere", "nearest"] = key(
        "every_sphere: each sphere feels all others that are near enough to matter; nearest: its "
        "two neighbours only, as in the original study",
        default="every_sphere",
    )
    memory: float = key(
        "coefficient c of memory: pairs move (1 + c M) times as fast as at distances that are held,"
        " with M the memory number: the diameters by which a gap changes in a relaxation time. 0 "
        "leaves it out; docs/memory.md says what was found for config/paper.yaml",
        symbol="c",
        default=0.0,
        ge=0,
        le=1,
    )
    stations: ListOf[Station] | None = key(
        "positions along the channel at which spacings are recorded; null = five, evenly from "
        "inlet to outlet",
        symbol="z",
        unit="D",
        default=None,
        min_length=1,
        rule="ascending, none beyond channel.length",
    )
    repeats: int = key(
        "independent trains per (De, volume fraction), for statistics",
        default=20,
        ge=1,
        le=100_000,
    )
    seed: int = key("seed of the random injection", default=1, ge=0, le=2**63 - 1)
    passages: int = key(
        "spheres recorded per repeat, after the statistically steady state is reached",
        default=1000,
        ge=1,
        le=10_000_000,
    )
    measured: PathText | None = key(
        "CSV file of measured spacings, relative to the config file, that are compared with those "
        "of the trains; columns below",
        default=None,
        allowed="path without braces",
    )

    @property
    def fractions(self) -> tuple[float, ...]:
        """Those of the channel or of the feed, whichever are given."""
        return self.volume_fraction or self.feed_volume_fraction or ()

    @property
    def feed(self) -> bool:
        """Whether they are those of the feed."""
        return self.volume_fraction is None


class GeometryConfig(Section):
    """A triplet."""

    sp: Distance = key("distance to the trailing sphere", symbol="sp", unit="d")
    sf: Distance = key("distance to the leading sphere", symbol="sf", unit="d")


class PointConfig(GeometryConfig):
    """A triplet, with these distances at first, at one Deborah number."""

    deborah: Annotated[float, Field(gt=0, le=LARGEST_DEBORAH)] = key(
        "Deborah number", symbol="De", unit="1"
    )


class ClosureConfig(Section):
    """A short train simulated directly, against the train model fed by the table."""

    distances: ListOf[FiniteDistance] = key(
        "initial distances of successive spheres, trailing first; one less than spheres",
        symbol="s",
        unit="d",
        default=(1.5, 2.2, 1.3, 3.0, 1.8),
        min_length=3,
        max_length=20,
    )
    deborah: ListOf[DeborahNumber] | None = key(
        "Deborah numbers of these trains; null = deborah.values; [] = no such trains",
        symbol="De",
        unit="1",
        default=None,
        rule="each one of deborah.values, none twice",
    )
    duration: float = key("time that is simulated", unit="D/Ubar", default=100.0, gt=0, le=10_000)
    gaps: ListOf[Gap] = key(
        "gaps between equally spaced spheres at which the model is compared",
        unit="d",
        default=(0.3, 0.5, 1.0, 2.0, 4.0),
        rule="ascending",
    )


class ConvergenceConfig(Section):
    """Studies of mesh, order, box length and time step."""

    geometries: ListOf[GeometryConfig] = key(
        "triplets whose relative velocities are computed with other settings, at all De",
        default=(),
    )


class VerificationConfig(Section):
    """What `snakemake verification` computes on top of the study."""

    transient: ListOf[PointConfig] = key(
        "points at which the quasi-steady velocities are compared with those after a start-up",
        default=(),
    )
    closure: ClosureConfig = ClosureConfig()
    convergence: ConvergenceConfig = ConvergenceConfig()


class FieldConfig(Section):
    """The triplet of the table around which the stress field is drawn."""

    sp: Distance = key("distance to the trailing sphere, one of table.sp", symbol="sp", unit="d")
    sf: Distance = key("distance to the leading sphere, one of table.sf", symbol="sf", unit="d")
    deborah: ListOf[DeborahNumber] = key(
        "Deborah numbers, drawn under each other",
        symbol="De",
        unit="1",
        min_length=1,
        rule="each one of deborah.values, ascending",
    )


class FiguresConfig(Section):
    """Choices of the figures."""

    field: FieldConfig | None = key(
        "triplet of the table around which the stress field is drawn; "
        "null = the closest one at up to four De, evenly chosen, none above 31",
        default=None,
    )


class MoviesConfig(Section):
    """Movies of the trains, as cameras at `trains.stations` and one that moves along see them."""

    deborah: ListOf[DeborahNumber] | None = key(
        "Deborah numbers of the movies; null = trains.deborah; [] = no movies",
        symbol="De",
        unit="1",
        rule="each one of trains.deborah, none twice",
        default=None,
    )
    volume_fraction: ListOf[VolumeFraction] | None = key(
        "volume fractions of the movies, of the channel or of the feed as those of the trains; "
        "null = all",
        symbol="phi",
        unit="1",
        rule="each one of trains.volume_fraction or trains.feed_volume_fraction, none twice",
        default=None,
    )
    field_of_view: float | None = key(
        "length of the channel that a camera sees, at most channel.length; "
        "null = 10, or the whole of a shorter channel",
        unit="D",
        default=None,
        ge=0.5,
    )
    interval: float = key(
        "time of the flow between two frames of a camera at a station; spheres move by about "
        "1.7 D in a unit of it",
        unit="D/Ubar",
        default=0.05,
        ge=1e-6,
        le=10_000,
    )
    frames: int = key("frames of a movie", default=200, ge=2, le=1_000_000)
    frame_rate: float = key(
        "frames per second at which movies are played", unit="1/s", default=25.0, ge=0.1, le=120
    )
    width: int = key(
        "width of a movie in pixels", default=1280, ge=480, le=3840, multiple_of=2, rule="even"
    )


class EncapsulationConfig(Section):
    """Droplets that are made where the channel ends, with spheres, here beads, in them."""

    droplet_frequency: float | None = key(
        "droplets in a second; null = of each condition, the frequency with the most droplets of "
        "one bead",
        symbol="F",
        unit="1/s",
        default=None,
        ge=1e-6,
        le=10**9,
    )
    bead_rate: float | None = key(
        "beads that are wanted in a second, for which the feed at each flow rate is found; "
        "null = as many as encapsulation.droplet_frequency, if it is given",
        unit="1/s",
        default=None,
        ge=1e-6,
        le=10**9,
    )


class DesignConfig(Section):
    """What `snakemake design` tries: trains of every spacing at every De of the study but 0."""

    spacing: ListOf[FiniteDistance] = key(
        "mean spacings of the trains that are tried; that of encapsulation.bead_rate is tried too",
        symbol="s",
        unit="d",
        default=(3.0, 4.0, 5.5, 8.0),
        min_length=1,
        rule="ascending",
    )
    repeats: int = key("independent trains per condition", default=4, ge=1)
    passages: int = key("spheres recorded per repeat", default=300, ge=2)


class DesignMapConfig(Section):
    """Trains over a range of conditions: the design map, and the spacing law as a check."""

    deborah: ListOf[DeborahNumber] | None = key(
        "Deborah numbers of the map; null = deborah.values but 0; [] = no map",
        symbol="De",
        unit="1",
        rule="each one of deborah.values, ascending",
        default=None,
    )
    volume_fraction: ListOf[VolumeFraction] | None = key(
        "volume fractions of the map, in the channel; null = 0.002, 0.004, 0.006 and 0.01, as far "
        "as their mean spacing is at least 2 d and the channel holds a train",
        symbol="phi",
        unit="1",
        rule="ascending",
        default=None,
    )
    feed_volume_fraction: ListOf[VolumeFraction] | None = key(
        "the same, of what is poured in, in place of design_map.volume_fraction",
        symbol="phi_feed",
        unit="1",
        rule="ascending",
        default=None,
    )
    stations: int = key(
        "positions at which spacings are recorded, evenly from inlet to outlet",
        default=41,
        ge=2,
        le=10_001,
    )
    repeats: int = key("independent trains per condition", default=4, ge=1, le=100_000)
    passages: int = key("spheres recorded per repeat", default=500, ge=2, le=10_000_000)
    ordered_variation: float = key(
        "coefficient of variation of the spacing below which a train counts as ordered",
        default=ORDERED_VARIATION,
        ge=1e-6,
        le=10,
    )
