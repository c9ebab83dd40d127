"""Statistics of spacings that are known, and of distributions with and without a mode."""

import numpy as np
import pytest
import xarray as xr
from scipy.stats import t as student

from viscotrain.trains import distribution
from viscotrain.trains.statistics import (
    LONGEST_STRING,
    MEASURES,
    confidence,
    statistics,
    string_shares,
    touching,
)
from viscotrain.trains.variables import rate_in_words, with_errors


def array(*repeats):
    """Spacings at one station."""
    return xr.DataArray(
        np.stack([[s] for s in repeats]),
        dims=["repeat", "station", "passage"],
        coords={"station": [0.0]},
    )


def test_confidence_is_students():
    values = np.random.default_rng(0).normal(size=(12, 4))
    mean, halfwidth = confidence(values)
    for n in range(4):
        low, high = student.interval(
            0.95, 11, loc=values[:, n].mean(), scale=values[:, n].std(ddof=1) / np.sqrt(12)
        )
        assert mean[n] - halfwidth[n] == pytest.approx(low)
        assert mean[n] + halfwidth[n] == pytest.approx(high)
    assert np.isnan(confidence(values[:1])[1]).all()


def test_statistics_of_known_spacings():
    s = np.array([1.05, 1.05, 2.1, 2.2, 2.2, 2.2, 3.0, np.nan])
    found = statistics(array(s, s), mean_spacing=2.0)
    assert found["mean_spacing"] == pytest.approx(np.nanmean(s))
    assert found["spacing_variation"] == pytest.approx(np.nanstd(s) / np.nanmean(s))
    assert found["spacing_density"].sel(spacing_bin=2.125) == pytest.approx(4 / 7 / 0.25)
    assert found["spacing_density"].sum() * 0.25 == pytest.approx(1.0)
    assert found["even_share"] == pytest.approx(4 / 7)  # 1.98 -+ 20 %: 1.58 to 2.37
    assert found["mean_spacing_halfwidth"] == 0.0  # two equal repeats
    for name in (*MEASURES, "spacing_mode"):
        assert f"{name}_halfwidth" in found


def test_touching_spheres_are_counted_and_not_gaps():
    """Two gaps below 1.1 in a row join three of nine spheres, and are two of eight gaps."""
    s = np.array([1.05, 1.05, 2.1, 2.2, 2.2, 2.2, 3.0, np.nan])
    found = statistics(array(s, s), mean_spacing=2.0)
    assert found["touching_share"] == pytest.approx(3 / 9)
    np.testing.assert_allclose(found["string_share"][0], [6 / 9, 0, 3 / 9, 0, 0])


@pytest.mark.parametrize(
    ("gaps", "lengths"),
    [
        ([2, 2, 2], [1, 1, 1, 1]),
        ([1.05, 2, 2], [2, 1, 1]),  # at the end of the record
        ([2, 2, 1.05], [1, 1, 2]),
        ([1.05, 1.05, 2, 1.05], [3, 2]),
        ([1.05] * 4, [5]),
        ([1.05] * 6 + [2], [7, 1]),  # longer ones count as the longest
    ],
)
def test_strings_by_hand(gaps, lengths):
    expected = np.zeros(LONGEST_STRING)
    for length in lengths:
        expected[min(length, LONGEST_STRING) - 1] += length / sum(lengths)
    np.testing.assert_allclose(string_shares(np.array(gaps)), expected)
    z = np.cumsum([0.0, *gaps])
    assert touching(z, 1.0).mean() == pytest.approx(1 - expected[0])  # as films colour spheres


def test_pair_correlation_of_an_even_train():
    """Peaks at multiples of the spacing, each one sphere: g = <s>/width there."""
    s = np.full((1, 400), 2.1)
    edges = distribution.bin_edges(2.1)
    g = distribution.pair_correlation(s, edges)[0]
    assert edges[-1] > 6.0
    peaks = [int((n * 2.1 - 1) // 0.25) for n in (1, 2, 3)]
    np.testing.assert_allclose(g[peaks], 2.1 / 0.25)
    assert np.delete(g, peaks).max() == 0.0


def test_pair_correlation_of_hard_rods_without_order():
    """Exponential gaps behind contact: g = sum_k of gamma densities, 1 far away (Tonks)."""
    rng, free = np.random.default_rng(3), 2.0
    s = 1 + rng.exponential(free, size=(1, 400_000))
    edges = distribution.bin_edges(3.0)
    g = distribution.pair_correlation(s, edges)[0]
    centre = edges[:-1] + 0.125
    x = centre - 1
    first = np.exp(-x / free) / free
    second = np.where(x > 1, (x - 1) / free**2 * np.exp(-(x - 1) / free), 0)
    near = centre < 3  # third neighbours are farther
    # bins of 2e4 spheres: 0.7 %, four times; curvature within a bin 0.1 %
    np.testing.assert_allclose(g[near], 3 * (first + second)[near], rtol=0.03)
    np.testing.assert_allclose(g[centre > 7], 1.0, atol=0.03)


# ------------------------------------------------------------------------------------------- mode


def modes(spacings, mean_spacing):
    found = statistics(array(*spacings), mean_spacing)
    return float(found["spacing_mode"][0]), float(found["spacing_mode_halfwidth"][0])


def test_the_mode_is_that_of_all_repeats_together():
    """Repeats whose own modes differ agree on the spacing that is second in both."""
    first = np.repeat([2.1, 4.1, 3.1], [40, 25, 35])
    second = np.repeat([2.1, 4.1, 3.1], [25, 40, 35])
    edges = distribution.bin_edges(4.44)
    density = distribution.density(np.stack([first, second]), edges).mean(axis=0)
    assert distribution.mode(density, edges) == 3.125  # centre of the bin from 3 to 3.25


@pytest.mark.parametrize("repeats", [1, 4, 20])
def test_a_flat_distribution_has_no_mode(repeats):
    """The uniform injection: one of 20 has one by chance; of 40 at most six, at 0.3 %."""
    rng = np.random.default_rng(repeats)
    edges = distribution.bin_edges(6.5)
    spacings = rng.uniform(1, 12, size=(repeats, 40, 1000))
    flat = distribution.is_flat(distribution.density(spacings, edges), 1000)
    assert flat.sum() >= 34
    found = modes(spacings[:, int(flat.argmax())], 6.5)
    assert np.isnan(found).all()


@pytest.mark.parametrize("repeats", [1, 4, 20])
def test_a_peak_has_a_mode(repeats):
    """Where 12 % of the spacings are in a peak of 0.2 d on the same level."""
    rng = np.random.default_rng(repeats)
    level = rng.uniform(1, 12, size=(repeats, 880))
    peak = rng.normal(4.6, 0.1, size=(repeats, 120))
    mode, halfwidth = modes(np.concatenate([level, peak], axis=1), 6.5)
    assert mode == pytest.approx(4.6, abs=0.15)
    if repeats == 1:
        assert np.isnan(halfwidth)
    else:
        assert 0.125 <= halfwidth < 0.3  # at least half a bin


def test_the_error_of_a_mode_is_large_where_two_peaks_compete():
    rng = np.random.default_rng(5)
    peaks = [
        rng.permutation(np.r_[rng.normal(3, 0.1, n), rng.normal(6, 0.1, 300 - n)])
        for n in (160, 140, 155, 145, 150, 150)
    ]
    assert modes(peaks, 5.0)[1] > 1.0


@pytest.mark.parametrize(
    ("rate", "words"),
    [(1396.2, "1400"), (1738.0, "1740"), (82.43, "82.4"), (1.5, "1.5"), (99.96, "100")],
)
def test_rates_in_words_have_three_digits_and_no_powers(rate, words):
    assert rate_in_words(rate) == words


@pytest.mark.parametrize(
    ("halfwidth", "model", "words"),
    [
        (0.004, 0.0, "0.460 +- 0.004 +- <0.001"),
        (0.0004, 0.0006, "0.460 +- <0.001 +- 0.001"),
        (0.04, np.nan, "0.460 +- 0.040"),
        (0.159, 0.007, "0.46 +- 0.16 +- 0.01"),
        (17.0, np.nan, "0 +- 17"),
    ],
)
def test_errors_that_are_not_zero_are_not_written_as_zero(halfwidth, model, words):
    values = {"x": 0.46, "x_halfwidth": halfwidth, "x_model_error": model}
    assert (
        with_errors(xr.Dataset({name: ((), value) for name, value in values.items()}), "x", 3)
        == words
    )
