"""Variables of datasets: dimensionless, described, and in words with their errors."""

import math
from collections.abc import Sequence

import xarray as xr


def described(values, dims: Sequence[str], long_name: str, **attributes) -> xr.Variable:
    """A dimensionless variable."""
    return xr.Variable(dims, values, {"long_name": long_name, "units": "1", **attributes})


def rate_in_words(rate: float) -> str:
    """Spheres per second to three digits, and never as a power of ten."""
    return f"{rate:.0f}" if rate >= 100 else f"{rate:.3g}"


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
        decimals: Of the number; errors that would round to 0 have up to two more.
        factor: 100 for per cent.
        between: What stands between them.

    Returns:
        "6.61 +- 0.05 +- 0.002"; "flat" where there is no mode, "-" no other number.
    """
    value = factor * float(dataset[name])
    if not math.isfinite(value):
        return "flat" if name.endswith("mode") else "-"
    words = [f"{value:.{decimals}f}"]
    for end in ("_halfwidth", "_model_error"):
        error = factor * float(dataset[name + end]) if name + end in dataset else math.nan
        if math.isfinite(error):
            shown = (f"{error:.{decimals + more}f}" for more in range(3))
            words.append(next((text for text in shown if float(text) > 0), "0"))
    return between.join(words)
