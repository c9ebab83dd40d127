r"""Statistics of the spacings in trains, with their confidence over repeats.

Distances are in d. Measures are computed for each repeat; what is stored is their mean over repeats
and half the width of its 95 % confidence interval. The mode is that of all repeats together; its
interval is found by drawing repeats again (`distribution`). What the model may be wrong by is
another error, `model_error`.

**Strings.** Spheres closer than `TOUCHING` to a neighbour belong to a string with it (of spheres
that are not equal, those whose gap is as small as that of equal ones then is): a singlet, a
doublet, a triplet, .... Shares are those of spheres. Singlets and touching spheres are all; a share
of touching gaps would be about half of that of touching spheres.

**Even spacings** are within 20 % of the mean of all at the station.

**Injected.** What the injection law itself makes, if spheres keep the distances with which they
enter, s = U_p t/beta, in equations: gaps are independent, so of a share p of gaps below `TOUCHING`

    n (1 - p)^2 p^(n - 1)

is the share of spheres in strings of n.
"""

import math
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import stdtrit

from viscotrain.trains import distribution
from viscotrain.trains.distribution import BIN_WIDTH, CONFIDENCE
from viscotrain.trains.injection import InjectionLaw
from viscotrain.trains.variables import described
from viscotrain.words import CONTACT

TOUCHING = 1.1  # distance in d below which two spheres count as touching
EVEN = 0.2  # how far from the mean, as a share of it, a spacing counts as even
LONGEST_STRING = 5  # spheres; those of longer ones count with it

SPACING_BIN, STRING_LENGTH = "spacing_bin", "string_length"
MODE = "spacing_mode"


class Measure(NamedTuple):
    """What a measure means, and the dimension it has besides the station."""

    long_name: str
    dims: tuple[str, ...] = ()


MEASURES = {
    "spacing_density": Measure("probability density of the spacing", (SPACING_BIN,)),
    "pair_correlation": Measure(
        "pair correlation g: spheres at a distance ahead over those without order", (SPACING_BIN,)
    ),
    "mean_spacing": Measure("mean of the spacing"),
    "spacing_variation": Measure("coefficient of variation of the spacing"),
    "even_share": Measure(f"share of spacings within {100 * EVEN:g} % of their mean"),
    "touching_share": Measure(f"share of spheres closer than {TOUCHING} d to a neighbour"),
    "string_share": Measure(
        f"share of spheres in strings of so many closer than {TOUCHING} d", (STRING_LENGTH,)
    ),
}
MODE_WORDS = "most frequent spacing of all repeats, centre of the highest bin"
FLAT = "NaN: the distribution is flat within its band"


def confidence(values: NDArray) -> tuple[NDArray, NDArray]:
    """Mean over the first axis (repeats), and half the width of its 95 % confidence interval.

    Student's t over independent repeats; with a single repeat the half width is NaN.
    """
    count = len(values)
    mean = np.mean(values, axis=0)
    if count < 2:
        return mean, np.full_like(mean, np.nan)
    quantile = stdtrit(count - 1, (1 + CONFIDENCE) / 2)
    return mean, quantile * np.std(values, axis=0, ddof=1) / math.sqrt(count)


def measures(
    spacing: NDArray, mean_spacing: float, contact: NDArray | float = CONTACT
) -> dict[str, NDArray]:
    """The `MEASURES` of each repeat.

    Args:
        spacing: s* in d, shape (repeat, station, passage).
        mean_spacing: That of an equally spaced train, which sets the range of the bins.
        contact: Distances in d at which these spheres touch, of a shape that fits.

    Returns:
        Shapes (repeat, station), or (repeat, station, bin or string length).
    """
    edges = distribution.bin_edges(mean_spacing)
    mean = np.nanmean(spacing, axis=-1)
    strings = string_shares(spacing - (contact - CONTACT))
    return {
        "spacing_density": distribution.density(spacing, edges),
        "pair_correlation": distribution.pair_correlation(spacing, edges),
        "mean_spacing": mean,
        "spacing_variation": np.nanstd(spacing, axis=-1) / mean,
        "even_share": _share(np.abs(spacing / mean[..., None] - 1) <= EVEN, spacing),
        "touching_share": 1 - strings[..., 0],
        "string_share": strings,
    }


def statistics(
    spacing: xr.DataArray, mean_spacing: float, contact: xr.DataArray | None = None
) -> xr.Dataset:
    """Measures of the spacings at each station, over repeats, and their mode.

    Args:
        spacing: s* in d, dims (repeat, station, passage).
        mean_spacing: That of an equally spaced train, which sets the range of the bins.
        contact: Distances in d at which these spheres touch, dims (repeat, passage); None: 1.

    Returns:
        The `MEASURES` and spacing_mode over the station, and spacing_bin or string_length, each
        with its `_halfwidth` of 95 % confidence. spacing_mode is NaN where there is none.
    """
    s = spacing.transpose("repeat", "station", "passage").values
    variables: dict[str, xr.Variable] = {}
    touch: NDArray | float = CONTACT
    if contact is not None:
        touch = contact.transpose("repeat", "passage").values[:, None]
    found = measures(s, mean_spacing, touch)
    for name, values in found.items():
        average, halfwidth = confidence(values)
        variables |= _with_halfwidth(name, average, halfwidth, ", mean over repeats")
    edges, density = distribution.bin_edges(mean_spacing), found["spacing_density"]
    there = np.where(distribution.is_flat(density, s.shape[-1]), math.nan, 1.0)
    mode = there * distribution.mode(density.mean(axis=0), edges)
    halfwidth = there * distribution.mode_halfwidth(density, edges)
    variables |= _with_halfwidth(MODE, mode, halfwidth, "")
    for name in (MODE, f"{MODE}_halfwidth"):
        variables[name].attrs["comment"] = FLAT
    return xr.Dataset(variables, coords=_coordinates(edges) | {"station": spacing["station"]})


def _with_halfwidth(
    name: str, value: NDArray, halfwidth: NDArray, how: str
) -> dict[str, xr.Variable]:
    """A measure and its sampling error as variables."""
    words, dims = MEASURES.get(name, Measure(MODE_WORDS))
    return {
        name: described(value, ["station", *dims], words + how),
        f"{name}_halfwidth": described(
            halfwidth,
            ["station", *dims],
            f"sampling error, half width of the 95 % confidence interval, of the {words}",
        ),
    }


def _coordinates(edges: NDArray) -> dict[str, xr.Variable]:
    centres = edges[:-1] + BIN_WIDTH / 2
    words = f"spheres in the string; the last one: {LONGEST_STRING} or more"
    return {
        SPACING_BIN: described(
            centres, [SPACING_BIN], "distance at the centre of the bin", bin_width=BIN_WIDTH
        ),
        STRING_LENGTH: described(np.arange(1, LONGEST_STRING + 1), [STRING_LENGTH], words),
    }


def injected(
    law: InjectionLaw, *, confinement: float, velocity: float, mean_spacing: float
) -> xr.Dataset:
    """The measures of spheres that keep the distances with which they enter: a baseline.

    Args:
        law: Of the intervals.
        confinement: beta = d/D.
        velocity: U_p, of a single sphere, in Ubar.
        mean_spacing: That of an equally spaced train, which sets the range of the bins.

    Returns:
        spacing_density, spacing_variation, even_share, touching_share and string_share, each with
        `_injected` behind its name, without a station.
    """
    edges = distribution.bin_edges(mean_spacing)

    def below(distance):
        return law.share_below(np.asarray(distance) * confinement / velocity)

    p, n = below(TOUCHING), np.arange(1, LONGEST_STRING + 1)
    strings = n * (1 - p) ** 2 * p ** (n - 1)
    strings[-1] += 1 - strings.sum()
    mean = law.mean * velocity / confinement
    values = {
        "spacing_density": np.diff(below(edges)) / BIN_WIDTH,
        "spacing_variation": law.variation,
        "even_share": below((1 + EVEN) * mean) - below((1 - EVEN) * mean),
        "touching_share": 1 - strings[0],
        "string_share": strings,
    }
    variables = {
        f"{name}_injected": described(
            value, MEASURES[name].dims, f"{MEASURES[name].long_name}, as the injection law makes it"
        )
        for name, value in values.items()
    }
    return xr.Dataset(variables, coords=_coordinates(edges))


def string_shares(spacing: NDArray) -> NDArray:
    """Share of spheres in strings of 1, 2, ... and `LONGEST_STRING` or more.

    Args:
        spacing: Distances of successive spheres in d, shape (..., n): of n + 1 spheres.

    Returns:
        Shape (..., LONGEST_STRING).
    """
    return np.apply_along_axis(_string_shares, -1, spacing < TOUCHING)


def _string_shares(touches: NDArray) -> NDArray:
    last = np.flatnonzero(np.append(~touches, True))  # sphere of each string
    length = np.diff(last, prepend=-1)
    kind = np.minimum(length, LONGEST_STRING) - 1
    return np.bincount(kind, length, minlength=LONGEST_STRING) / length.sum()


def _share(condition: NDArray, spacing: NDArray) -> NDArray:
    """Share of the known spacings that meet a condition, over passages."""
    return condition.sum(axis=-1) / np.isfinite(spacing).sum(axis=-1)


def touching(z: NDArray, confinement: float, contact: NDArray | float = CONTACT) -> NDArray:
    """Which of the spheres at z (in D, ascending) are closer than `TOUCHING` to a neighbour.

    Args:
        z: Positions in D, ascending, shape (N,).
        confinement: d/D.
        contact: Distances of neighbours in contact, in d, shape (N - 1,).
    """
    near = np.diff(z) < (TOUCHING + (contact - CONTACT)) * confinement
    return np.concatenate([[False], near]) | np.concatenate([near, [False]])
