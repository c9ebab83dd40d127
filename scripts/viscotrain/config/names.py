"""Names of files: numbers, geometries, points and trains, such as sp1.1_sfinf_De5."""

import math

FEED = "_feed"  # before a volume fraction that is poured in


def number_name(value: float) -> str:
    """The shortest text that reads back as `value`, for file names: 5, 1.1, inf.

    Different numbers have different names.
    """
    return repr(float(value) + 0.0).removesuffix(".0")


def geometry_name(sp: float, sf: float) -> str:
    """File name of a geometry: sp1.1_sfinf."""
    return f"sp{number_name(sp)}_sf{number_name(sf)}"


def sphere_name(diameter_ratio: float) -> str:
    """File name of a single sphere of another diameter, over that of the study."""
    return f"{geometry_name(math.inf, math.inf)}_d{number_name(diameter_ratio)}"


def point_name(sp: float, sf: float, deborah: float) -> str:
    """File name of a geometry at one Deborah number: sp1.1_sfinf_De5."""
    return f"{geometry_name(sp, sf)}_De{number_name(deborah)}"


def fraction_name(volume_fraction: float, feed: bool = False) -> str:
    """A volume fraction in file names, after phi: 0.004 in the channel, _feed0.0066 poured in."""
    return f"{FEED * feed}{number_name(volume_fraction)}"


def parse_fraction(name: str) -> float:
    """The volume fraction in a file name, of either kind, the inverse of `fraction_name`."""
    return float(name.removeprefix(FEED))


def train_name(deborah: float, volume_fraction: float, feed: bool = False) -> str:
    """File name of a train: De5_phi0.004, or De5_phi_feed0.0066, as the study gives it."""
    return f"De{number_name(deborah)}_phi{fraction_name(volume_fraction, feed)}"


def parse_distance(name: str) -> float:
    """The distance in a file name, the inverse of `number_name`."""
    return float(name)


def parse_geometry(name: str) -> tuple[str, str]:
    """Names of the distances sp and sf in the name of a geometry, or of a single sphere."""
    sp, sf = name.removeprefix("sp").split("_sf")
    return sp, sf.partition("_d")[0]
