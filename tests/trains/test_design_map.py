"""Design map: measures of hand-made trains, physical units by hand, and what the figures show."""

import math

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from harness import CONFIG, output, run_script
from matplotlib.patches import Rectangle
from matplotlib.text import Text
from synthetic import triplet

from viscotrain.drawing import design_figures, figures
from viscotrain.fluid.parameters import NEWTONIAN, DimensionlessFluid, Fluid, Mode
from viscotrain.fluid.units import physical_units
from viscotrain.trains import design_map, statistics
from viscotrain.trains.repeats import run_repeats

STATIONS = np.array([0.0, 100.0, 200.0])
D, d, ETA_0, LAMBDA_1 = 100e-6, 20e-6, 0.562, 0.0752  # m, m, Pa s, s


def alternating(low, high):
    """Spacings of 50 pairs: mean (low + high)/2, CV (high - low)/(high + low)."""
    return np.tile([low, high], 50)


UNITS = physical_units(
    Fluid(0.051, (Mode(0.257, LAMBDA_1), Mode(0.254, 0.00848))),
    {De: De for De in (0.5, 1.0, 5.0)},
    channel_diameter=D,
    particle_diameter=d,
)


def point(deborah, volume_fraction, stations, memory=(0.0, 0.0)):
    """A result of `trains.run` whose spacings, one row per station, are known; two repeats."""
    spacing = xr.DataArray(
        np.stack([stations, stations]),
        dims=["repeat", "station", "passage"],
        coords={"station": STATIONS},
    )
    law = 2 / 3 * 0.2**2 / volume_fraction
    dataset = statistics.statistics(spacing, law)
    dataset = dataset.assign(deborah=deborah, volume_fraction=volume_fraction, confinement=0.2)
    return dataset.assign(memory_number=("repeat", list(memory)))


@pytest.fixture(scope="module")
def hand_made():
    """De 1: CV 0.5, 0.25, 0.1 along the channel. De 5: order is lost again. phi 1 %: De 5 only."""
    ordering = [alternating(2, 6), alternating(3, 5), alternating(3.6, 4.4)]
    lost = [alternating(3.6, 4.4), alternating(3.6, 4.4), alternating(1.0, 7.0)]
    return design_map.combine(
        [
            point(5.0, 0.01, lost, memory=(0.09, 0.11)),
            point(1.0, 0.006, ordering, memory=(0.02, 0.01)),
            point(5.0, 0.006, lost, memory=(0.09, 0.1)),
        ],
        units=UNITS,
        fluid=NEWTONIAN,
        ordered_variation=0.3,
    )


# -------------------------------------------------------------------------------- ordering length


@pytest.mark.parametrize(
    ("variation", "expected"),
    [
        ([0.5, 0.4, 0.2], 150.0),  # half-way between the last above and the first below
        ([0.5, 0.1, 0.1], 50.0),
        ([0.2, 0.2, 0.2], 0.0),
        ([0.3, 0.3, 0.3], 0.0),  # the threshold itself is ordered
        ([0.2, 0.4, 0.2], 150.0),  # counts from where it stays
        ([0.5, 0.2, 0.4], math.inf),
        ([0.5, 0.5, 0.5], math.inf),
        ([0.2, math.nan, 0.2], 200.0),  # unknown is not ordered
    ],
)
def test_ordering_length(variation, expected):
    assert design_map.ordering_length(STATIONS, variation, 0.3) == pytest.approx(expected)


# ------------------------------------------------------------------------------------ hand-made map


def test_measures_of_hand_made_trains(hand_made):
    own = hand_made.sel(deborah=1.0, volume_fraction=0.006)
    np.testing.assert_allclose(own["mean_spacing"], 4.0)
    np.testing.assert_allclose(own["spacing_variation"], [0.5, 0.25, 0.1])
    assert float(own["ordering_length"]) == pytest.approx(80.0)  # 0.5 to 0.25 crosses 0.3 at 4/5
    lost = hand_made.sel(deborah=5.0, volume_fraction=0.01)
    np.testing.assert_allclose(lost["touching_share"], [0, 0, 0.5])
    assert math.isinf(lost["ordering_length"])
    assert np.isnan(hand_made["mean_spacing"].sel(deborah=1.0, volume_fraction=0.01)).all()


def test_conditions_whose_gaps_change_too_fast_are_named(hand_made):
    """The largest of all repeats counts; the limit of 0.1 itself is within the range."""
    expected = [[0.02, np.nan], [0.1, 0.11]]
    np.testing.assert_allclose(hand_made["memory_number"], expected)
    assert design_map.headline(hand_made).endswith("; beyond the quasi-steady range: De 5")
    rows = design_map.table(hand_made).set_index(["deborah", "volume_fraction_percent"])
    assert set(rows.loc[(5.0, 1.0), "memory_number"]) == {0.11}
    slow = hand_made.assign(memory_number=hand_made["memory_number"] / 2)
    assert "quasi-steady" not in design_map.headline(slow)
    for draw in (figures.spacing_law, figures.draw_design_map):
        words = every_word(draw(hand_made).figure)
        assert "De = 5 \N{DAGGER}" in words and "De = 1 \N{DAGGER}" not in words
        assert "\N{DAGGER} beyond the quasi-steady range" in words
        assert "\N{DAGGER}" not in every_word(draw(slow).figure)


def test_the_mode_is_that_of_all_repeats_together():
    """Repeats whose own modes differ agree on the spacing that is second in both."""
    first = np.repeat([2.1, 4.1, 3.1], [40, 25, 35])
    second = np.repeat([2.1, 4.1, 3.1], [25, 40, 35])
    spacing = xr.DataArray(
        np.stack([[first] * 3, [second] * 3]),
        dims=["repeat", "station", "passage"],
        coords={"station": STATIONS},
    )
    mode = design_map.pooled_mode(statistics.statistics(spacing, 4.44))
    np.testing.assert_allclose(mode, 3.125)  # centre of the bin from 3 to 3.25


def test_physical_units_by_hand(hand_made):
    """Poiseuille: Ubar = De D/lambda_1, Q = pi D^2 Ubar/4, dp = 32 eta_0 Ubar L/D^2."""
    np.testing.assert_allclose(hand_made["length"], [0, 1, 2])  # cm, 100 D of 100 um each
    Q = 5 * D / LAMBDA_1 * math.pi * D**2 / 4 * 1e9 * 60
    assert abs(Q - 3.13) < 0.01
    assert float(hand_made["flow_rate"].sel(deborah=5.0)) == pytest.approx(Q)
    drop = 32 * ETA_0 * (5 * D / LAMBDA_1) * 0.02 / D**2 / 1e5
    assert abs(drop - 2.39) < 0.01
    found = hand_made["pressure_drop"].sel(deborah=5.0).values
    np.testing.assert_allclose(found, [0, drop / 2, drop], rtol=1e-9)
    assert hand_made["pressure_drop"].attrs["units"] == "bar"
    assert hand_made["length"].attrs["units"] == "cm"


def test_shear_thinning_lowers_the_pressure_drop():
    fluid = DimensionlessFluid(0.1, (Mode(0.9, 1.0, 0.3),))
    points = [point(De, 0.006, [alternating(3, 5)] * 3) for De in (1.0, 5.0)]
    thinning = design_map.combine(points, units=UNITS, fluid=fluid, ordered_variation=0.3)
    newtonian = design_map.combine(points, units=UNITS, fluid=NEWTONIAN, ordered_variation=0.3)
    share = (thinning["pressure_drop"] / newtonian["pressure_drop"]).isel(station=-1).values
    assert 0.1 < share[1] < share[0] < 1  # 0.1 is that of the solvent alone


def test_table_has_a_row_per_condition_and_length_in_units_of_the_bench(hand_made):
    rows = design_map.table(hand_made)
    assert len(rows) == 3 * STATIONS.size  # the condition that was not simulated is not there
    (row,) = rows[
        (rows["deborah"] == 1)
        & (rows["volume_fraction_percent"].round(6) == 0.6)
        & (rows["channel_length_cm"].round(6) == 2)
    ].to_dict("records")
    assert row["mean_spacing_um"] == pytest.approx(80)
    assert row["ordering_length_cm"] == pytest.approx(0.8)
    assert row["touching_share_percent"] == 0
    assert row["spacing_mode_um"] == pytest.approx(20 * row["spacing_mode_d"])
    lost = rows[(rows["deborah"] == 5) & (rows["channel_length_D"] == 200)]
    assert lost["touching_share_percent"].tolist() == [50, 50]
    assert np.isinf(lost["ordering_length_cm"]).all()


def test_headline_names_the_most_even_train(hand_made):
    words = design_map.headline(hand_made)
    assert "at 1 of 3 conditions" in words
    assert "0.10, at De = 1, phi = 0.6 %" in words


# ---------------------------------------------------------------------------------------- figures


def every_word(figure):
    return " ".join(item.get_text() for item in figure.findobj(Text))


def words_of(figure):
    found = []
    for part in (figure, *figure.subfigs):
        found += [text.get_text() for text in part.texts]
        found += [part._suptitle.get_text()] if part._suptitle else []
        found += [text.get_text() for legend in part.legends for text in legend.get_texts()]
    for axes in figure.axes:
        found += [text.get_text() for text in axes.texts]
        found += [axes.get_title("left"), axes.get_xlabel(), axes.get_ylabel()]
        found += [label.get_text() for label in (*axes.get_xticklabels(), *axes.get_yticklabels())]
    return found


def test_design_map_draws_only_conditions_that_were_simulated(hand_made):
    figure, data = figures.draw("design_map", hand_made, 0.2)
    pd.testing.assert_frame_equal(data, design_map.table(hand_made))
    words = words_of(figure)
    variation = figure.axes[0]
    cells = {text.get_position(): text.get_text() for text in variation.texts}
    assert cells[0, 0].startswith("0.100") and cells[0, 1].startswith("0.750")
    assert (1, 0) not in cells  # De = 1, phi = 1 %: not simulated
    assert len([patch for patch in variation.patches if isinstance(patch, Rectangle)]) == 3
    order = [text.get_text() for text in figure.axes[3].texts]
    assert order == ["0.8", "not\nreached", "not\nreached"]
    for word in ("De = 5 \N{DAGGER}\n3.13 \N{MICRO SIGN}L/min, 2.4 bar", "0.6", "ordered below"):
        assert word in words
    assert any("[cm]" in word for word in words) and any("[%]" in word for word in words)


def test_spacing_law_of_both_channels(hand_made):
    figure, data = figures.draw("spacing_law", hand_made, 0.2)
    own = data[data["volume_fraction_percent"].round(6) == 0.6].iloc[0]
    assert own["tube_d"] == pytest.approx(2 / 3 * 0.04 / 0.006)
    assert own["square_channel_d"] == pytest.approx(math.pi / 6 * 0.04 / 0.006)
    assert own["mean_spacing_d"] == pytest.approx(4.0)
    left, right = figure.axes[:2]
    for line, share in zip(left.lines[:2], (2 / 3, math.pi / 6), strict=True):
        phi, spacing = line.get_data()
        np.testing.assert_allclose(np.array(spacing) * phi / 100, share * 0.04)
    constants = [set(np.round(line.get_ydata(), 12)) for line in right.lines[:2]]
    assert constants == [{round(2 / 3, 12)}, {round(math.pi / 6, 12)}]
    words = " ".join(words_of(figure))
    assert "square channel" in words and "tube" in words and "De = 5" in words


def test_simulated_trains_follow_the_law_of_the_tube():
    """With as many spheres as here, within five standard errors; pi/6 is twenty away."""
    result = run_repeats(
        triplet(),
        confinement=0.2,
        volume_fraction=0.008,
        centreline_velocity=1.66,
        length=30.0,
        stations=[0.0, 30.0],
        passages=800,
        repeats=2,
        seed=1,
    )
    scaled = result["mean_spacing"].values * 0.008 / 0.04
    np.testing.assert_allclose(scaled, design_figures.TUBE, rtol=0.05)


# ----------------------------------------------------------------------------------- command line


@pytest.mark.slow
def test_scripts_from_the_command_line(tiny_table, tmp_path):
    def run(script, *arguments):
        config = "--configfile", CONFIG / "tiny.yaml"
        return output(run_script(script, *config, *arguments, folder=tmp_path))

    for phi in ("0.01", "0.015"):
        condition = ["--deborah", "1", "--volume-fraction", phi]
        run("trains.py", "--design-map", *condition, tiny_table, f"phi{phi}.nc")
    run("units.py", "units.nc")
    words = run(
        "design_map.py", "map.nc", "units.nc", "phi0.015.nc", "phi0.01.nc", "--figures", "figures"
    )
    assert (tmp_path / "figures" / "spacing_law.png").exists()
    assert (tmp_path / "figures" / "design_map.csv").exists()
    assert "of 2 conditions" in words
    result = xr.load_dataset(tmp_path / "map.nc")
    assert result["flow_rate"][0] == xr.load_dataset(tmp_path / "units.nc")["flow_rate"][-1]
    assert result["volume_fraction"].values.tolist() == [0.01, 0.015]
    assert result["station"].values.tolist() == [0, 5, 10, 15, 20]
