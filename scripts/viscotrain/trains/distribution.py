r"""Distributions of the distances in trains: of neighbours, and of all pairs.

Distances are in d, in bins of `BIN_WIDTH` from contact on.

**Density** p(s) of the distance to the sphere ahead.

**Pair correlation** g(s): how many spheres there are at a distance s ahead of one, over how many
there would be without order; with p_k, the density of the distance to the k-th sphere ahead,

    g(s) = <s> sum_k p_k(s).

At a station p_k is that of the sums of k successive distances. g is 0 within contact, and goes to 1
where spheres do not know of each other; a train with a spacing has peaks at its multiples.

**Mode.** The centre of the highest bin of all repeats together; repeats have as many spheres, so
this is the mean of their densities, whose mode scatters less than those of the repeats.

**Flat.** There is no mode while the highest bin may be so by chance: while it is not above the mean
density of the bulk, between the 10 % and 90 % quantiles, by more than the band that all bins would
keep to together in 95 % of cases if the bulk were level. The variance of a bin over repeats is in
proportion to its density, which all bins together tell better than the bin alone; with a single
repeat it is that of independent distances.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from viscotrain.words import CONTACT

BIN_WIDTH = 0.25  # d
WIDEST_BIN = 3.0  # the last bin ends at this multiple of the mean spacing
CONFIDENCE = 0.95
BULK = 0.1, 0.9  # quantiles
RESAMPLED = 400  # times, for the error of a mode: 2.5 % of them are ten


def bin_edges(mean_spacing: float) -> NDArray:
    """Edges of the bins in d, for a mean spacing in d."""
    bins = max(1, math.ceil((WIDEST_BIN * mean_spacing - CONTACT) / BIN_WIDTH))
    return CONTACT + BIN_WIDTH * np.arange(bins + 1)


def counts(distance: NDArray, edges: NDArray) -> NDArray:
    """How many distances, shape (..., n), are in each bin, shape (..., bin); NaN in none."""
    rows = distance.reshape(-1, distance.shape[-1])
    bins = len(edges) - 1
    where = np.floor((np.maximum(rows, CONTACT) - edges[0]) / BIN_WIDTH)
    row, column = np.nonzero(where < bins)  # not NaN
    cell = row * bins + where[row, column].astype(int)
    found = np.bincount(cell, minlength=len(rows) * bins)
    return found.reshape(*distance.shape[:-1], bins)


def density(distance: NDArray, edges: NDArray) -> NDArray:
    """Density in bins, shape (..., bin); its integral lacks what is beyond the bins."""
    known = np.isfinite(distance).sum(axis=-1, keepdims=True)
    return counts(distance, edges) / known / BIN_WIDTH


def pair_correlation(spacing: NDArray, edges: NDArray) -> NDArray:
    """The g in bins, shape (..., bin), from distances of successive spheres, shape (..., n)."""
    total, ahead = np.zeros(1), spacing
    while True:
        total = total + density(ahead, edges)
        ahead = ahead[..., 1:] + spacing[..., : ahead.shape[-1] - 1]
        if not (ahead < edges[-1]).any():
            return np.nanmean(spacing, axis=-1)[..., None] * total


def mode(mean_density: NDArray, edges: NDArray) -> NDArray:
    """Centre of the highest bin, in d, of densities of shape (..., bin)."""
    return (edges[:-1] + BIN_WIDTH / 2)[mean_density.argmax(axis=-1)]


def is_flat(densities: NDArray, passages: int) -> NDArray:
    """Whether the highest bin may be so by chance, of densities (repeat, ..., bin): shape (...).

    Args:
        densities: Of each repeat.
        passages: Distances in each.
    """
    p = densities.mean(axis=0)
    below = np.cumsum(p, axis=-1) / p.sum(axis=-1, keepdims=True)
    bulk = (below > BULK[0]) & (below - p / p.sum(axis=-1, keepdims=True) < BULK[1])
    level = np.sum(p * bulk, axis=-1) / bulk.sum(axis=-1)
    scatter = 1 / (BIN_WIDTH * passages)  # variance over density
    if len(densities) > 1:
        scatter = densities.var(axis=0, ddof=1).sum(axis=-1) / p.sum(axis=-1)
    chance = (1 - CONFIDENCE) / p.shape[-1]
    band = -ndtri(chance) * np.sqrt(scatter * level / len(densities))
    return p.max(axis=-1) <= level + band


def mode_halfwidth(densities: NDArray, edges: NDArray) -> NDArray:
    """Half the width of the 95 % range of the mode if repeats are drawn again, with replacement.

    At least half a bin; NaN for a single repeat.

    Args:
        densities: Of each repeat, shape (repeat, ..., bin).
        edges: Of the bins.

    Returns:
        In d, shape (...).
    """
    repeats = len(densities)
    if repeats < 2:
        return np.full(densities.shape[1:-1], np.nan)
    rng = np.random.default_rng(0)  # the same densities have the same band
    drawn = rng.multinomial(repeats, np.full(repeats, 1 / repeats), size=RESAMPLED)
    modes = mode(np.tensordot(drawn / repeats, densities, axes=1), edges)
    outside = (1 - CONFIDENCE) / 2
    low, high = np.quantile(modes, [outside, 1 - outside], axis=0)
    return np.maximum((high - low) / 2, BIN_WIDTH / 2)
