"""Design map: measures of hand-made trains, physical units by hand, and what the figures show."""

import math

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from harness import CONFIG, FINISHED_TABLE, ROOT, output, run_script
from matplotlib.collections import LineCollection, QuadMesh
from matplotlib.text import Text
from synthetic import triplet

from viscotrain.drawing import design_figures, figures
from viscotrain.drawing.design_map_figure import draw_design_map
from viscotrain.fluid.channel import RECTANGLE, ROUND, CrossSection
from viscotrain.fluid.parameters import NEWTONIAN, DimensionlessFluid, Fluid, Mode
from viscotrain.fluid.units import physical_units
from viscotrain.studies.channel_flow import channel_flow
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import design_map, model_error, order, statistics
from viscotrain.trains.closures import CLOSURES
from viscotrain.trains.injection import injection_law
from viscotrain.trains.repeats import run_repeats

U_P = 1.65  # of a single sphere, in Ubar

STATIONS = np.array([0.0, 100.0, 200.0])
D, d, ETA_0, LAMBDA_1 = 100e-6, 20e-6, 0.562, 0.0752  # m, m, Pa s, s


def alternating(low, high):
    """Spacings of 50 pairs: mean (low + high)/2, CV (high - low)/(high + low)."""
    return np.tile([low, high], 50)


DEBORAH = {De: De for De in (0.5, 1.0, 5.0)}
FLOW = channel_flow(NEWTONIAN, DEBORAH, ROUND)
UNITS = physical_units(
    Fluid(0.051, (Mode(0.257, LAMBDA_1), Mode(0.254, 0.00848))),
    DEBORAH,
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
    intervals = injection_law(
        confinement=0.2, volume_fraction=volume_fraction, velocity=U_P, slowest=1.6
    )
    wrong = {"closure": 1.01 * spacing.values}  # by 1 % in the mean, and nothing in the CV
    dataset = statistics.statistics(spacing, law).merge(
        statistics.injected(intervals, confinement=0.2, velocity=U_P, mean_spacing=law)
    )
    dataset = dataset.merge(model_error.model_error(spacing.values, wrong, law))
    scalars = {
        "deborah": deborah,
        "volume_fraction": volume_fraction,
        "feed_volume_fraction": U_P * volume_fraction,
        "injection_rate": 1 / intervals.mean,
        "confinement": 0.2,
        "diameter_variation": 0.0,
    }
    dataset = dataset.assign(memory_number=("repeat", list(memory)))
    return dataset.assign(scalars).assign_attrs(given="volume_fraction", injection="uniform")


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
        flow=FLOW,
        ordered_variation=0.3,
    )


# -------------------------------------------------------------------------------- ordered position


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
def test_ordered_position(variation, expected):
    assert design_map.ordered_position(STATIONS, variation, 0.3) == pytest.approx(expected)


# ------------------------------------------------------------------------------------ hand-made map


def test_measures_of_hand_made_trains(hand_made):
    own = hand_made.sel(deborah=1.0, volume_fraction=0.006)
    np.testing.assert_allclose(own["mean_spacing"], 4.0)
    np.testing.assert_allclose(own["spacing_variation"], [0.5, 0.25, 0.1])
    assert float(own["ordered_position"]) == pytest.approx(80.0)  # 0.5 to 0.25 crosses 0.3 at 4/5
    lost = hand_made.sel(deborah=5.0, volume_fraction=0.01)
    # 99 gaps of 1 d between every second and the next one: strings of two, one sphere alone
    np.testing.assert_allclose(lost["touching_share"], [0, 0, 100 / 101])
    np.testing.assert_allclose(own["mean_spacing_model_error"], 0.04)
    np.testing.assert_allclose(own["even_share"], [0, 0, 1.0])  # 2 and 6, 3 and 5, 3.6 and 4.4
    assert math.isinf(lost["ordered_position"])
    assert np.isnan(hand_made["mean_spacing"].sel(deborah=1.0, volume_fraction=0.01)).all()


def test_ordered_position_has_the_range_that_errors_leave():
    """CV 0.5, 0.25, 0.1 with a model error of 0.05 there: crossings of 0.35 and of 0.25."""
    ordering = point(1.0, 0.006, [alternating(2, 6), alternating(3, 5), alternating(3.6, 4.4)])
    ordering["spacing_variation_model_error"][:] = 0.05
    own = design_map.combine([ordering], units=UNITS, flow=FLOW, ordered_variation=0.3)
    assert float(own["ordered_position"][0, 0]) == pytest.approx(80.0)
    assert float(own["ordered_position_earliest"][0, 0]) == pytest.approx(60.0)
    assert float(own["ordered_position_latest"][0, 0]) == pytest.approx(100.0)


def test_a_map_of_the_feed_has_its_own_axis():
    """Over phi_feed; phi follows at each De, and is what the spacing law is about."""
    points = [
        point(De, phi, [alternating(3, 5)] * 3).assign(feed_volume_fraction=feed)
        for De, phi, feed in ((1.0, 0.005, 0.009), (5.0, 0.0055, 0.009), (5.0, 0.006, 0.01))
    ]
    points = [each.assign_attrs(given="feed_volume_fraction") for each in points]
    own = design_map.combine(points, units=UNITS, flow=FLOW, ordered_variation=0.3)
    assert own["spacing_variation"].dims == ("deborah", "feed_volume_fraction", "station")
    phi = own["volume_fraction"].sel(feed_volume_fraction=0.009)
    np.testing.assert_allclose(phi, [0.005, 0.0055])
    rows = design_map.table(own)
    assert rows["feed_volume_fraction_percent"].round(6).unique().tolist() == [0.9, 1.0]
    figure, _ = drawn(own)
    assert any("in the feed" in word for word in words_of(figure))
    law = figures.draw("spacing_law", own, 0.2).data
    np.testing.assert_allclose(
        law["tube_d"], 100 * 2 / 3 * 0.04 / law["volume_fraction_percent"], rtol=1e-12
    )


def test_conditions_whose_gaps_change_too_fast_are_named(hand_made):
    """The largest of all repeats counts; the limit of 0.1 itself is within the range."""
    expected = [[0.02, np.nan], [0.1, 0.11]]
    np.testing.assert_allclose(hand_made["memory_number"], expected)
    assert design_map.headline(hand_made)[-1] == "beyond the quasi-steady range: De 5"
    rows = design_map.table(hand_made).set_index(["deborah", "volume_fraction_percent"])
    assert set(rows.loc[(5.0, 1.0), "memory_number"]) == {0.11}
    slow = hand_made.assign(memory_number=hand_made["memory_number"] / 2)
    assert "quasi-steady" not in design_map.headline(slow)[-1]


def test_spheres_per_second(hand_made):
    """phi_feed Q over the volume of a sphere."""
    Q = 5 * D / LAMBDA_1 * math.pi * D**2 / 4
    expected = U_P * 0.006 * Q / (math.pi / 6 * d**3)
    found = hand_made["sphere_rate"].sel(deborah=5.0, volume_fraction=0.006)
    assert float(found) == pytest.approx(expected)
    assert found.attrs["units"] == "s-1"


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
    flow = channel_flow(DimensionlessFluid(0.1, (Mode(0.9, 1.0, 0.3),)), DEBORAH, ROUND)
    points = [point(De, 0.006, [alternating(3, 5)] * 3) for De in (1.0, 5.0)]
    thinning = design_map.combine(points, units=UNITS, flow=flow, ordered_variation=0.3)
    newtonian = design_map.combine(points, units=UNITS, flow=FLOW, ordered_variation=0.3)
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
    assert row["ordered_position_cm"] == pytest.approx(0.8)
    assert row["touching_share_percent"] == 0
    assert row["spacing_mode_um"] == pytest.approx(20 * row["spacing_mode_d"])
    assert row["mean_spacing_d_model_error"] == pytest.approx(0.04)
    assert row["feed_volume_fraction_percent"] == pytest.approx(0.99)
    assert row["spheres_per_second"] == pytest.approx(
        hand_made["sphere_rate"].sel(deborah=1.0, volume_fraction=0.006)
    )
    assert row["injection"] == "uniform"
    lost = rows[(rows["deborah"] == 5) & (rows["channel_length_D"] == 200)]
    np.testing.assert_allclose(lost["touching_share_percent"], [1e4 / 101] * 2)
    assert np.isinf(lost["ordered_position_cm"]).all()


def test_headline_names_the_most_even_train(hand_made):
    words = "\n".join(design_map.headline(hand_made))
    assert "at 1 of 3 conditions" in words
    assert "0.100 +- <0.001 +- <0.001 (sampling, model), at De = 1,\nphi = 0.6 %" in words
    assert "in the feed 0.99 %" in words and "spheres/s" in words


# ---------------------------------------------------------------------------------------- figures

UNSTABLE_FROM = 0.012


def found_for(dataset):
    """Ordering lengths by hand: l = 200 D phi/0.5 %, times 1, 2 with De; unstable if dense."""
    phi = np.geomspace(0.002, 0.02, 60)
    deborah = dataset["deborah"].values
    length = 200 * phi / 0.005 * np.arange(1, deborah.size + 1)[:, None]
    dims, stable = ("deborah", "spacing"), phi <= UNSTABLE_FROM
    return xr.Dataset(
        {
            "ordering_length": (dims, np.where(stable, length, np.inf)),
            "stability": (dims, np.where(stable, 1, -1) + np.zeros_like(length)),
            "feed_volume_fraction": (dims, U_P * phi + np.zeros_like(length)),
        },
        {"deborah": deborah, "volume_fraction": ("spacing", phi)},
    )


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


def drawn(dataset, found=None, beyond=()):
    """The figure; the table is beyond the quasi-steady range at these Deborah numbers."""
    De = dataset["deborah"].values
    memory = xr.Dataset({"memory_number": ("deborah", np.isin(De, beyond) + 0.0)}, {"deborah": De})
    return draw_design_map(dataset, found_for(dataset) if found is None else found, memory)


def numbers_on(axes):
    return {
        (round(x, 6), math.floor(y)): text.get_text()
        for text in axes.texts
        for x, y in [text.get_position()]
    }


def test_design_map_draws_only_conditions_that_were_simulated(hand_made):
    """CV at the inlet and at the outlet below the band; all that is not drawn is in the data."""
    figure, data = drawn(hand_made)
    pd.testing.assert_frame_equal(data, design_map.table(hand_made))
    inlet = hand_made["spacing_variation"].isel(station=0)
    expected = {
        (0.6, 0): rf"{inlet[0, 0]:.2f}$\rightarrow$0.10",
        (0.6, 1): rf"{inlet[1, 0]:.2f}$\rightarrow$0.75",
        (1.0, 1): rf"{inlet[1, 1]:.2f}$\rightarrow$0.75" + "\N{DAGGER}",
    }
    assert numbers_on(figure.axes[0]) == expected  # De = 1, phi = 1 %: not simulated
    bold = [text.get_text() for text in figure.axes[0].texts if text.get_weight() == "bold"]
    assert bold == [expected[0.6, 0]]  # 0.3 counts as ordered
    words = words_of(figure)
    for word in ("De = 5\n3.1 \N{MICRO SIGN}L/min, 2.4 bar", "0.6", "$z$ [$D$]"):
        assert word in words
    assert "counts as ordered: CV \N{LESS-THAN OR EQUAL TO} 0.3" in words
    assert any("[%]" in word for word in words)


def test_a_deborah_number_is_marked_by_the_table_and_else_its_own_conditions(hand_made):
    """The train at De = 5, phi = 1 % alone is beyond the range: 0.11."""
    words = every_word(drawn(hand_made, beyond=[5.0]).figure)
    assert "De = 5 \N{DAGGER}" in words and "De = 1 \N{DAGGER}" not in words
    assert "0.75\N{DAGGER}" not in words
    assert "\N{DAGGER} beyond the quasi-steady range: stress lags behind the spheres" in words
    words = every_word(drawn(hand_made).figure)
    assert "De = 5 \N{DAGGER}" not in words and words.count("0.75\N{DAGGER}") == 1
    slow = hand_made.assign(memory_number=hand_made["memory_number"] / 2)
    assert "\N{DAGGER}" not in every_word(drawn(slow).figure)


def test_the_map_shows_ordering_lengths_in_a_band_for_each_deborah_number(hand_made):
    """l/L = phi over 0.5 % of the channel's 200 D at De = 1, twice that at De = 5."""
    found = found_for(hand_made)
    axes = drawn(hand_made, found).figure.axes[0]
    bands = [one for one in axes.collections if isinstance(one, QuadMesh)]
    unstable = [one for one in axes.collections if one.get_hatch()]
    lines = [one for one in axes.collections if isinstance(one, LineCollection)]
    assert len(bands) == len(unstable) == len(lines) == 2
    phi = found["volume_fraction"].values
    for n, (band, hatched, line) in enumerate(zip(bands, unstable, lines, strict=True)):
        share = band.get_array().ravel()
        stable = phi <= UNSTABLE_FROM
        np.testing.assert_array_equal(np.ma.getmaskarray(share), ~stable)
        np.testing.assert_allclose(share[stable], (n + 1) * phi[stable] / 0.005)
        low, high = band.get_coordinates()[..., 1].min(), band.get_coordinates()[..., 1].max()
        assert n - 0.5 < low < n < high < n + 0.5  # nothing between two Deborah numbers
        edges = np.concatenate([path.vertices[:, 0] for path in hatched.get_paths()])
        between = np.sqrt(phi[stable].max() * phi[~stable].min())
        assert (edges.min(), edges.max()) == pytest.approx((100 * between, 100 * phi.max()))
        (at,) = {x for path in line.get_paths() for x in path.vertices[:, 0]}
        assert at == pytest.approx(0.5 / (n + 1), rel=np.log(phi[1] / phi[0]))  # l = L
    colours = bands[0].get_cmap()
    brightness = [np.dot(colours(bands[0].norm(share))[:3], (0.3, 0.6, 0.1)) for share in (0.2, 5)]
    assert brightness[0] < brightness[1]  # dark: short


def test_words_of_a_map_have_one_of_two_sizes_on_a_page(hand_made):
    figure = drawn(hand_made).figure
    assert figure.get_figwidth() * 25.4 == pytest.approx(180)
    sizes = {item.get_fontsize() for item in figure.findobj(Text) if item.get_text()}
    assert sizes == {7.0, 8.0}


def test_a_map_of_six_deborah_numbers_fits_a_page(hand_made):
    deborah = [1.0, 2.0, 5.0, 10.0, 31.0, 62.0]
    many = hand_made.isel(deborah=[0, 1, 1, 1, 1, 1]).assign_coords(deborah=deborah)
    figure = drawn(many).figure
    assert figure.get_figheight() * 25.4 < 220
    titles = [axes.get_title("left") for axes in figure.axes[2:]]
    assert titles == [f"De = {De:g}" for De in deborah]


def test_numbers_of_many_conditions_stand_beside_each_other():
    """Eight fractions: only CV at the outlet, in turn above and below."""
    phi = np.linspace(0.004, 0.0047, 8)
    points = [point(De, own, [alternating(3, 5)] * 3) for De in (1.0, 5.0) for own in phi]
    own = design_map.combine(points, units=UNITS, flow=FLOW, ordered_variation=0.3)
    texts = drawn(own).figure.axes[0].texts
    assert {text.get_text() for text in texts} == {"0.25"}
    rows = np.array([text.get_position()[1] for text in texts])
    assert (np.diff(rows)[::2] < 0).all() and rows.max() < 1.5


def test_ordering_lengths_of_a_map_are_those_of_its_table(hand_made):
    """As `order` has them at the same distance; as far as the thinnest train, at its De only."""
    table = VelocityTable.open(ROOT / FINISHED_TABLE)
    thin = hand_made.sel(deborah=[5.0]).assign_coords(volume_fraction=[0.0005, 0.01])
    found = design_map.ordering(thin, table, "every_sphere")
    assert found["deborah"].values.tolist() == [5.0]
    phi, s = found["volume_fraction"].values, float(found["spacing"][120])
    assert phi.min() < 0.0005 and phi.max() > 0.02
    assert phi[120] == pytest.approx(2 / 3 * 0.04 / s)
    answer = order.response(CLOSURES["every_sphere"](table.at(5.0)), s)
    length = order.ordering_length(answer, 0.2)
    assert float(found["ordering_length"][0, 120]) == pytest.approx(length, rel=1e-12)
    feed = float(found["feed_volume_fraction"][0, 120])
    assert feed == pytest.approx(phi[120] * answer.velocity, rel=1e-12)


def test_panels_of_curves_hold_all_of_them(hand_made):
    """Also those that are higher in the second panel than in the first, De = 5: CV 0.75."""
    figure = drawn(hand_made).figure
    curves = figure.axes[2:]
    assert len(curves) == 2
    for axes in curves:
        low, high = axes.get_ylim()
        assert low == 0
        values = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in axes.lines])
        assert np.nanmax(values) <= high
    assert curves[0].get_ylim()[1] > 0.75


def test_spacing_law_of_both_channels(hand_made):
    figure, data = figures.draw("spacing_law", hand_made, 0.2)
    own = data[data["volume_fraction_percent"].round(6) == 0.6].iloc[0]
    assert own["tube_d"] == pytest.approx(2 / 3 * 0.04 / 0.006)
    assert own["square_channel_d"] == pytest.approx(math.pi / 6 * 0.04 / 0.006)
    assert own["mean_spacing_d"] == pytest.approx(4.0)
    left, right = figure.axes[:2]
    constants = [set(np.round(line.get_ydata(), 12)) for line in left.lines[:2]]
    assert constants == [{round(2 / 3, 12)}, {round(math.pi / 6, 12)}]
    drawn_at = next(line for line in left.lines[2:] if line.get_marker() != "|").get_ydata()
    assert drawn_at[0] == pytest.approx(4.0 * 0.006 / 0.04)  # <s> phi/beta^2
    feed = [float(line.get_ydata()[0]) for line in right.lines]
    assert feed == pytest.approx([U_P, U_P])  # phi_feed/phi
    words = every_word(figure)
    for word in ("consistency check", "square channel", "tube", "De = 5", "not simulated"):
        assert word in words


def test_spacing_law_of_a_duct_is_its_own():
    """A flat duct of 2 : 1: pi/12, with the tube beside it, and the name of what is simulated."""
    section = CrossSection(RECTANGLE, 2.0)
    points = [point(De, 0.006, [alternating(3, 5)] * 3) for De in (1.0, 5.0)]
    own = {"units": UNITS, "flow": FLOW, "ordered_variation": 0.3}
    made = design_map.combine(points, section=section, **own)
    made_law = figures.draw("spacing_law", made, 0.2)
    assert made_law.data["duct_d"].iloc[0] == pytest.approx(math.pi / 12 * 0.04 / 0.006)
    constants = [line.get_ydata()[0] for line in made_law.figure.axes[0].lines[:2]]
    assert constants == pytest.approx([math.pi / 12, 2 / 3])
    assert design_map.headline(made)[-1] == section.remark
    assert "inscribed tube" in section.remark


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
    run("channel_flow.py", "flow.nc")
    files = tiny_table, "units.nc", "flow.nc", "phi0.015.nc", "phi0.01.nc"
    words = run("design_map.py", "map.nc", *files, "--figures", "figures")
    assert (tmp_path / "figures" / "spacing_law.png").exists()
    assert (tmp_path / "figures" / "design_map.csv").exists()
    assert "of 2 conditions, uniform injection" in words
    result = xr.load_dataset(tmp_path / "map.nc")
    assert result["flow_rate"][0] == xr.load_dataset(tmp_path / "units.nc")["flow_rate"][-1]
    assert result["volume_fraction"].values.tolist() == [0.01, 0.015]
    assert result["station"].values.tolist() == [0, 5, 10, 15, 20]
