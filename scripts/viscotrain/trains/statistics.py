"""Statistics of the spacings in trains, with their confidence over repeats.

Distances are in d. Measures are computed for each repeat; what is stored is their mean over repeats
and half the width of its 95 % confidence interval.
"""

import math

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import stdtrit

from viscotrain.trains.variables import described
from viscotrain.words import CONTACT

TOUCHING = 1.1  # distance in d below which two spheres count as touching
BIN_WIDTH = 0.25  # of the distribution of spacings, in d
WIDEST_BIN = 3.0  # the last bin ends at this multiple of the mean spacing
CONFIDENCE = 0.95


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


def statistics(spacing: xr.DataArray, mean_spacing: float) -> xr.Dataset:
    """Distribution of spacings at each station and its measures, over repeats.

    Args:
        spacing: s* in d, dims (repeat, station, passage).
        mean_spacing: That of an equally spaced train, which sets the range of the bins.

    Returns:
        spacing_density (station, spacing_bin), mean_spacing, spacing_mode, spacing_variation and
        touching_share (station), each with its `_halfwidth` of 95 % confidence.
    """
    s = spacing.transpose("repeat", "station", "passage").values
    bins = max(1, math.ceil((WIDEST_BIN * mean_spacing - CONTACT) / BIN_WIDTH))
    edges = CONTACT + BIN_WIDTH * np.arange(bins + 1)
    centres = (edges[1:] + edges[:-1]) / 2
    density = _density(s, edges)
    mean = np.nanmean(s, axis=-1)
    measures = {
        "spacing_density": (density, "probability density of the spacing"),
        "mean_spacing": (mean, "mean of the spacing"),
        "spacing_mode": (
            centres[density.argmax(axis=-1)],
            "most frequent spacing, centre of the highest bin",
        ),
        "spacing_variation": (
            np.nanstd(s, axis=-1) / mean,
            "coefficient of variation of the spacing",
        ),
        "touching_share": (
            _share(s < TOUCHING, s),
            f"share of spacings below {TOUCHING} sphere diameters",
        ),
    }
    variables = {}
    for name, (values, long_name) in measures.items():
        dims = ["station", "spacing_bin"] if values.ndim == 3 else ["station"]
        average, halfwidth = confidence(values)
        variables[name] = described(average, dims, f"{long_name}, mean over repeats")
        variables[f"{name}_halfwidth"] = described(
            halfwidth, dims, f"half width of the 95 % confidence interval of the {long_name}"
        )
    bin_centres = described(
        centres, ["spacing_bin"], "spacing at the centre of the bin", bin_width=BIN_WIDTH
    )
    return xr.Dataset(variables, coords={"spacing_bin": bin_centres, "station": spacing["station"]})


def _density(spacing: NDArray, edges: NDArray) -> NDArray:
    """Density in bins, shape (repeat, station, bin); its integral lacks what is beyond the bins."""
    bins = len(edges) - 1
    bin_of = np.floor((np.maximum(spacing, CONTACT) - edges[0]) / BIN_WIDTH)
    inside = np.stack([_share(bin_of == n, spacing) for n in range(bins)], axis=-1)
    return inside / BIN_WIDTH


def _share(condition: NDArray, spacing: NDArray) -> NDArray:
    """Share of the known spacings that meet a condition, over passages."""
    return condition.sum(axis=-1) / np.isfinite(spacing).sum(axis=-1)


def touching(z: NDArray, confinement: float) -> NDArray:
    """Which of the spheres at z (in D, ascending) are closer than `TOUCHING` to a neighbour."""
    near = np.diff(z) < TOUCHING * confinement
    return np.concatenate([[False], near]) | np.concatenate([near, [False]])
