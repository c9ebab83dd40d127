r"""Measured spacings beside those of trains: their distribution, and how far both are apart.

At each station the Kolmogorov-Smirnov distance is the largest difference between the shares of
spacings below any distance, measured F_m and simulated F_n, all repeats together,

    KS = max over s of |F_m(s) - F_n(s)|,

and its p-value the probability that two samples of these sizes from one distribution are at least
as far apart. There are many simulated spacings: it is the number of measured ones that decides.

**What p assumes**: that spacings are independent, measured and simulated ones. Neighbours in a
train are not quite. How much this matters, runs of successive simulated spacings tell, compared
with the other repeats: in the demo's trains at 800 D, where neighbours are correlated by 0.09,
6.5 % of the runs of 100 have p below 0.05. Errors of the model, and of the measurement, are not in
it: a small p says that both differ, and KS by how much.

Measured densities are in bins `COARSER` times as wide as those of the trains, with the root of the
number in a bin as their error.
"""

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from viscotrain.trains import distribution
from viscotrain.trains.distribution import BIN_WIDTH
from viscotrain.trains.spacings_file import Spacing
from viscotrain.trains.variables import described
from viscotrain.words import CONTACT

WORDS = {  # by name, over the station: meaning
    "measured_count": "number of measured spacings",
    "measured_mean_spacing": "mean of the measured spacings",
    "measured_spacing_variation": "coefficient of variation of the measured spacings",
    "ks_distance": "Kolmogorov-Smirnov distance of measured and simulated spacings",
    "ks_p_value": "probability of such a distance, or a larger one, of spacings from one "
    "distribution, if all are independent",
}
DENSITIES = {  # over the station and the bin
    "measured_density": "probability density of the measured spacings",
    "measured_density_error": "error of counting of the density, of the root of the number",
}
EXACT = 10_000  # pairs of a measured and a simulated spacing up to which p is found by counting
COARSER = 4  # bins of measured spacings, which are fewer


def of_condition(rows: Sequence[Spacing], deborah: float, volume_fraction: float) -> list[Spacing]:
    """Those that were measured at this Deborah number and volume fraction, or at all."""
    return [
        row
        for row in rows
        if row.deborah in (None, deborah) and row.volume_fraction in (None, volume_fraction)
    ]


def compare(trains: xr.Dataset, rows: Sequence[Spacing]) -> xr.Dataset:
    """Measured spacings at the stations of trains, their density, and the distance of both.

    Args:
        trains: Result of `repeats.run_repeats`.
        rows: Measured at its stations.

    Returns:
        Variables of `WORDS` over the station, NaN where nothing is measured; those of `DENSITIES`
        over (station, measured_bin); each measured spacing with its station over `measurement`.
    """
    bins, width = math.ceil(trains.sizes["spacing_bin"] / COARSER), COARSER * BIN_WIDTH
    simulated = trains["spacing"].transpose("station", ...).values
    found: dict[str, list] = {name: [] for name in (*WORDS, *DENSITIES)}
    for station, of_trains in zip(trains["station"].values, simulated, strict=True):
        spacing = np.array([row.spacing for row in rows if row.station == station])
        values = _of_station(spacing, of_trains[np.isfinite(of_trains)])
        values |= dict(zip(DENSITIES, _densities(spacing, bins), strict=True))
        for name in found:
            found[name].append(values[name])
    return xr.Dataset(
        {name: described(np.array(found[name]), ["station"], text) for name, text in WORDS.items()}
        | {
            name: described(np.array(found[name]), ["station", "measured_bin"], text)
            for name, text in DENSITIES.items()
        }
        | {
            "measured_spacing": described(
                np.array([row.spacing for row in rows]),
                ["measurement"],
                "measured distance to the sphere ahead over diameter",
            ),
            "measured_station": described(
                np.array([row.station for row in rows]),
                ["measurement"],
                "where it was measured, position over channel diameter",
            ),
        },
        coords={
            "station": trains["station"],
            "measured_bin": described(
                CONTACT + width * (np.arange(bins) + 0.5),
                ["measured_bin"],
                "distance at the centre of the bin",
                bin_width=width,
            ),
        },
    )


def _densities(spacing: NDArray, bins: int) -> tuple[NDArray, NDArray]:
    """Density in so many coarse bins, and its error; NaN without spacings."""
    if not spacing.size:
        return np.full(bins, math.nan), np.full(bins, math.nan)
    edges = CONTACT + BIN_WIDTH * np.arange(COARSER * bins + 1)
    counts = distribution.counts(spacing, edges).reshape(bins, COARSER).sum(axis=-1)
    one = 1 / (spacing.size * COARSER * BIN_WIDTH)
    return one * counts, one * np.sqrt(counts)


def _of_station(measured: NDArray, simulated: NDArray) -> dict:
    """The variables of `WORDS` at one station."""
    if not measured.size or not simulated.size:
        return dict.fromkeys(WORDS, math.nan) | {"measured_count": measured.size}
    from scipy.stats import ks_2samp  # takes long to import, for figures that measure nothing

    # beyond, by the distribution for one sample of the size m n/(m + n), which is close to m
    method = "exact" if measured.size * simulated.size <= EXACT else "asymp"
    test = ks_2samp(measured, simulated, method=method)
    mean = measured.mean()
    values = (measured.size, mean, measured.std() / mean, test.statistic, test.pvalue)
    return dict(zip(WORDS, values, strict=True))


def probability(p: float) -> str:
    """A p-value in words."""
    return f"p = {p:.2g}" if p >= 1e-4 else "p < 0.0001"


def headline(found: xr.Dataset) -> list[str]:
    """A line for each station where something is measured.

    Args:
        found: Result of `compare`.
    """
    lines = []
    for station in found["station"].values:
        own = found.sel(station=station)
        if int(own["measured_count"]) == 0:
            continue
        p = probability(float(own["ks_p_value"]))
        lines.append(
            f"at z = {station:g} D: {int(own['measured_count'])} measured spacings, mean "
            f"{float(own['measured_mean_spacing']):.2f} d, CV "
            f"{float(own['measured_spacing_variation']):.3f}; Kolmogorov-Smirnov distance "
            f"{float(own['ks_distance']):.3f}, {p} (if independent)"
        )
    return lines or ["nothing measured at this condition"]
