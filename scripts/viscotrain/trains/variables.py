"""Variables of datasets: dimensionless, described, and in words with their errors."""

import math
from collections.abc import Sequence

import xarray as xr

SPHERE_RATE = "spheres that enter in a second"


def described(values, dims: Sequence[str], long_name: str, **attributes) -> xr.Variable:
    """A dimensionless variable."""
    return xr.Variable(dims, values, {"long_name": long_name, "units": "1", **attributes})


def in_digits(value: float, digits: int = 2) -> str:
    """A number with so many significant digits, and never as a power of ten."""
    return f"{float(f'{value:.{digits}g}'):.12g}"


def rate_in_words(rate: float) -> str:
    """Spheres per second to three digits."""
    return in_digits(rate, 3)


def amounts_in_words(data: xr.Dataset) -> tuple[str, str]:
    """The volume fractions in the channel and in the feed, in per cent.

    The one that the study gives has its digits, the one that follows has two: it depends on a
    velocity, and is what a pump and a balance can tell.
    """
    names = "volume_fraction", "feed_volume_fraction"
    channel, feed = (
        f"{100 * float(data[name]):.{3 if name == data.attrs['given'] else 2}g}" for name in names
    )
    return channel, feed


def unequal(data: xr.Dataset) -> str:
    """How much the diameters of a train's spheres vary, after a comma; empty if they do not."""
    variation = 100 * float(data["diameter_variation"])
    return f", diameters vary by {variation:.3g} %" if variation > 0 else ""


def with_errors(
    dataset: xr.Dataset, name: str, decimals: int, factor: float = 1.0, between: str = " +- "
) -> str:
    """A statistic with its sampling error and its model error, those that are known, in words.

    Args:
        dataset: Holds the statistic, as a single number, and what is known of its `_halfwidth`
            and `_model_error`.
        name: Of the statistic.
        decimals: Of the number and of its errors, fewer where an error has more than two digits;
            one that rounds to 0 is "<0.001".
        factor: 100 for per cent.
        between: What stands between them.

    Returns:
        "6.61 +- 0.05 +- <0.01"; "flat" where there is no mode, "-" no other number.
    """
    value = factor * float(dataset[name])
    if not math.isfinite(value):
        return "flat" if name.endswith("mode") else "-"
    ends = [name + end for end in ("_halfwidth", "_model_error") if name + end in dataset]
    errors = [error for end in ends if math.isfinite(error := factor * float(dataset[end]))]
    if (largest := max(errors, default=0.0)) > 0:
        decimals = max(min(decimals, 1 - math.floor(math.log10(largest))), 0)
    smallest = 10.0**-decimals
    words = [f"{error:.{decimals}f}" for error in errors]
    words = [text if float(text) > 0 else f"<{smallest:.{decimals}f}" for text in words]
    return between.join([f"{value:.{decimals}f}", *words])
