"""What channel and spheres must agree on: shape and sides, and that spheres fit."""

from collections.abc import Iterator, Mapping

from viscotrain.config.device_models import SIDES
from viscotrain.config.readable import Readable, Unreadable, conflict
from viscotrain.config.wording import Problem, shown
from viscotrain.fluid.channel import RECTANGLE, CrossSection

RANGE = "number in [1.0e-06, 1]"  # of a side in m, as its key says
SMALLEST_CONFINEMENT = 0.01  # d/D: smaller spheres do not feel the channel, and mesh does not end


def sides_suit_the_shape(config: Readable) -> Iterator[Problem]:
    """The sides of its shape are given, and no others."""
    channel, shape = config.value("channel"), _shape(config)
    if not isinstance(channel, Mapping):
        return
    given = {name for names in SIDES.values() for name in names if channel.get(name) is not None}
    for name in SIDES[shape]:
        if name not in given:
            yield Problem(("channel", name), f"missing; allowed: {RANGE}, with shape {shape}")
    for name in sorted(given - set(SIDES[shape])):
        (other,) = (shape for shape, names in SIDES.items() if name in names)
        text = f"found with shape {shape}; allowed: with channel.shape: {other} only"
        yield Problem(("channel", name), text)


def _shape(config: Readable) -> str:
    """Shape of the channel, which is a tube if nothing is said."""
    channel = config.value("channel")
    return config.value("channel.shape") if "shape" in channel else "tube"


def section_of(config: Readable) -> tuple[str, float, CrossSection]:
    """Key and value of the smaller side of the channel, D, and its section."""
    shape = _shape(config)
    sides = {f"channel.{name}": config.value(f"channel.{name}") for name in SIDES[shape]}
    if None in sides.values():
        raise Unreadable("channel")
    key = min(sides, key=lambda name: sides[name])
    duct = CrossSection(RECTANGLE, max(sides.values()) / sides[key])
    return key, sides[key], CrossSection() if shape == "tube" else duct


def sphere_fits_channel(config: Readable) -> Iterator[Problem]:
    """Spheres are smaller than the channel, and not lost in it."""
    d, (key, D, _) = config.value("particle.diameter"), section_of(config)
    if d >= D:
        yield conflict(("particle", "diameter"), d, f"less than {key}, {shown(D)}")
    elif d < SMALLEST_CONFINEMENT * D:
        allowed = f"at least a hundredth of {key}, {shown(D)}"
        yield conflict(("particle", "diameter"), d, allowed)
