"""What a config may say about the device: channel and spheres."""

from typing import Annotated, Any, Literal

from pydantic import Field, WithJsonSchema, model_serializer

from viscotrain.config.keys import Section, key
from viscotrain.fluid.channel import RECTANGLE, CrossSection

SIDES = {"tube": ("diameter",), "square": ("side",), "rectangle": ("width", "height")}  # by shape


class ChannelConfig(Section):
    """The straight channel: a tube, or a duct. D of a duct is its smaller side."""

    shape: Literal["tube", "square", "rectangle"] = key(
        "section of the channel. Spheres in a duct act on each other as in the inscribed tube, "
        "whose diameter D is the smaller side; flow rate, pressure, spacing and velocity are the "
        "duct's",
        default="tube",
    )
    diameter: float | None = key(
        "inner diameter of a tube",
        symbol="D",
        unit="m",
        default=None,
        ge=1e-6,
        le=1,
        rule="required for a tube",
    )
    side: float | None = key(
        "side of a square, D", unit="m", default=None, ge=1e-6, le=1, rule="required for a square"
    )
    width: float | None = key(
        "one side of a rectangle",
        unit="m",
        default=None,
        ge=1e-6,
        le=1,
        rule="required for a rectangle",
    )
    height: float | None = key(
        "the other side of a rectangle, either may be the smaller one, D",
        unit="m",
        default=None,
        ge=1e-6,
        le=1,
        rule="required for a rectangle",
    )
    length: float = key("length of the channel", symbol="L", unit="D", gt=0, le=100_000)

    @model_serializer(mode="wrap")
    def _as_written(self, serialize) -> dict[str, Any]:
        """Without the sides of other shapes."""
        unused = {name for name, value in self if value is None}
        return {name: value for name, value in serialize(self).items() if name not in unused}

    @property
    def sides(self) -> tuple[float, ...]:
        """Diameter or sides in m."""
        return tuple(getattr(self, name) for name in SIDES[self.shape])

    @property
    def inscribed_diameter(self) -> float:
        """D, in m."""
        return min(self.sides)

    @property
    def section(self) -> CrossSection:
        """The section in D."""
        if self.shape == "tube":
            return CrossSection()
        return CrossSection(RECTANGLE, max(self.sides) / min(self.sides))


_DIAMETER = {"type": "number", "minimum": 1e-8, "maximum": 1}
# One number here; a config with several of them is several studies, see `sweep`.
Diameter = Annotated[
    float,
    Field(ge=1e-8, le=1),
    WithJsonSchema(_DIAMETER | {"type": ["number", "array"], "items": _DIAMETER, "minItems": 2}),
]


class ParticleConfig(Section):
    """The spheres: all equal, or of diameters that vary about a mean."""

    diameter: Diameter = key(
        "mean diameter of the spheres, less than channel.diameter, or the smaller side, and at "
        "least a hundredth of it; of several, everything is made "
        "for each in `results/<study>/beta<d/D>/`, and compared",
        symbol="d",
        unit="m",
        allowed="number in [1.0e-08, 1], or list of at least 2 of them, ascending",
    )
    diameter_variation: float = key(
        "coefficient of variation of the diameters in trains: normally distributed, cut at three "
        "standard deviations. A sphere's velocity follows its diameter to first order; 0 = all "
        "equal",
        unit="1",
        default=0.0,
        ge=0,
        le=0.1,
    )
    density: float | None = key(
        "density of the spheres; with it the summary says how far they settle",
        symbol="rho_p",
        unit="kg/m^3",
        default=None,
        gt=0,
    )
