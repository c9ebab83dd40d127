import itertools
import math
from types import SimpleNamespace

import jinja2
import matplotlib
import numpy as np
import pandas as pd
import pytest
import xarray as xr
import yaml
from harness import CONFIG, ROOT, output, run_script
from matplotlib.figure import Figure
from matplotlib.text import Text
from synthetic import DEMO_NODES, SINGLE, at_deborah, dns_result, relative, triplet

from viscotrain.drawing import conventions, figures, stress_field, style
from viscotrain.fluid.channel import RECTANGLE, CrossSection
from viscotrain.jobs import datasets, drawings
from viscotrain.table.assembly import combine
from viscotrain.table.check import check_errors
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import injection
from viscotrain.trains.closures import EverySphere
from viscotrain.trains.motion import chain_motion
from viscotrain.trains.repeats import run_repeats
from viscotrain.trains.statistics import TOUCHING
from viscotrain.trains.variables import in_digits, rate_in_words
from viscotrain.words import BEYOND_QUASI_STEADY, INACCURATE

BETA, DEBORAH, INF = 0.2, (0.0, 1.0), np.inf
HOLES = {(1.0, 1.5, 2.5), (1.0, INF, 4.5)}


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Interpolants on fewer points: a drawing takes a tenth of the time."""
    monkeypatch.setattr(conventions, "GRID", 41)


@pytest.fixture(scope="module")
def table():
    return check_errors(velocity_table(), [dns_result(1.3, 1.9)])


@pytest.fixture(scope="module")
def table_with_holes():
    return velocity_table(HOLES)


@pytest.fixture(scope="module")
def field():
    return synthetic_field()


@pytest.fixture(scope="module")
def train():
    return synthetic_train(passages=60)


def velocity_table(unsolved=frozenset()):
    results = [
        dns_result(sp, sf, DEBORAH, unsolved=[De for De, *where in unsolved if where == [sp, sf]])
        for sp, sf in itertools.product(DEMO_NODES, DEMO_NODES)
    ]
    return combine(results, sp=DEMO_NODES, sf=DEMO_NODES, deborah=DEBORAH, max_holes=len(unsolved))


def synthetic_train(passages, repeats=2, deborah=1.0):
    result = run_repeats(
        triplet(law=lambda sp, sf: SINGLE + 20 * (triplet()(sp, sf) - SINGLE)),
        confinement=BETA,
        volume_fraction=0.01,
        centreline_velocity=1.67,
        length=40.0,
        stations=[0.0, 20.0, 40.0],
        passages=passages,
        repeats=repeats,
        seed=1,
    )
    return at_deborah(result, deborah)


def synthetic_field(sp=1.1, sf=1.5, length=4.5):
    """Three spheres in a box, with a stress that is large at the wall and behind the spheres."""
    centres = 2.0 + BETA * np.array([0.0, sp, sp + sf])
    centres = centres[np.isfinite(centres)]
    z, r = np.linspace(0, length, 181), np.linspace(0, 0.5, 21)
    Z, R = np.meshgrid(z, r)
    free = (np.hypot(Z[..., None] - centres, R[..., None]) > BETA / 2).all(axis=-1)
    strand = sum(np.exp(-(((Z - c - 0.15) / 0.1) ** 2) - (R / 0.03) ** 2) for c in centres)
    De = np.array([0.0, 1.0])[:, None, None]
    stress = {"zz": De * (16 * R**2 + strand), "rr": De * -0.3 * R, "tt": De * 0 * R}
    layers = {"velocity_z": 2 - 8 * R**2 + 0 * De}
    layers |= {f"stress_{name}": values for name, values in stress.items()}
    undisturbed = {"zz": De[..., 0] * 16 * r**2, "rr": De[..., 0] * -0.3 * r}
    square = np.array([[0.0, 0.3], [0.3, 0.5]])
    scalars = {"confinement": BETA, "sp": sp, "sf": sf}
    dims = ("deborah", "r", "z")
    return xr.Dataset(
        {name: (dims, np.where(free, values, np.nan)) for name, values in layers.items()}
        | {
            f"undisturbed_stress_{name}": (("deborah", "r"), values)
            for name, values in undisturbed.items()
        }
        | {
            "edge_z": (("edge", "edge_point"), 2 + square),
            "edge_r": (("edge", "edge_point"), square),
            "sphere_position": ("sphere", centres),
            "sphere_velocity": (("deborah", "sphere"), np.full((2, centres.size), 1.5)),
            **{name: ((), value) for name, value in scalars.items()},
        },
        coords={
            "deborah": De.ravel(),
            "z": z,
            "r": r,
            "sphere": ["trailing", "middle", "leading"][: len(centres)],
        },
    )


def texts(figure):
    return " ".join(item.get_text() for item in figure.findobj(Text))


def lines(figure, **properties):
    """Lines of the first panel with these properties."""
    return [
        line
        for line in figure.axes[-1].lines + figure.axes[0].lines
        if all(getattr(line, f"get_{name}")() == value for name, value in properties.items())
    ]


# ------------------------------------------------------------------------------------- each one


def test_relative_velocities_show_the_interpolant_and_its_nodes(table):
    figure, data = figures.relative_velocities(table, 1.0, BETA)
    interpolant = VelocityTable(table).at(1.0)
    for sp, sf in ((data["sp"][7], data["sf"][30]), (INF, data["sf"][20]), (data["sp"][3], INF)):
        drawn = data["relative_velocity"].sel(sp=float(sp), sf=float(sf))
        np.testing.assert_allclose(drawn, np.diff(interpolant(sp, sf)), rtol=0, atol=1e-15)
    nodes = table["velocity"].sel(deborah=1.0).values
    np.testing.assert_array_equal(data["node_relative_velocity"], np.diff(nodes, axis=-1))
    words = texts(figure)
    for word in (
        "$s_p$ [$d$]",
        "$s_f$ [$d$]",
        r"\bar{U}",
        "De = 1",
        "$d/D$ = 0.2",
        "neither opens",
    ):
        assert word in words
    for word in ("repulsion\ngap opens", "attraction\ngap closes", "below the error"):
        assert word in words
    panel = next(axes for axes in figure.axes if "$U_2 - U_1$" in axes.get_title("left"))
    (dots,) = (line for line in panel.lines if line.get_marker() == ".")
    assert len(dots.get_xdata()) == len(DEMO_NODES) ** 2
    assert dots.get_xdata().max() == 1.0  # infinity is on the axis


def test_colours_of_signed_velocities_are_centred_on_zero(table):
    figure, _ = figures.relative_velocities(table, 1.0, BETA)
    (bar,) = (axes for axes in figure.axes if "relative velocity" in axes.get_ylabel())
    low, high = bar.get_ylim()
    assert low == pytest.approx(-high)


def test_scales_name_both_ends_and_whose_they_are(table):
    figure, _ = figures.relative_velocities(table, 1.0, BETA)
    (bar,) = (axes for axes in figure.axes if "scale of De = 1" in axes.get_ylabel())
    assert tuple(bar.get_yticks()[[0, -1]]) == bar.get_ylim()


def test_a_line_between_both_signs_is_drawn_where_its_place_is_known(table):
    """With an error of half the largest velocity no place is known, and there is no such line."""
    words = "neither opens nor closes"
    assert words in texts(figures.relative_velocities(table, 1.0, BETA).figure)
    rough = table.copy(deep=True)
    half = 0.5 * np.abs(np.diff(table["velocity"].sel(deborah=1.0).values, axis=-1)).max()
    rough["check_error"][:] = half
    figure = figures.relative_velocities(rough, 1.0, BETA).figure
    assert words not in texts(figure) and "below the error" in texts(figure)


def test_holes_are_crosses_and_nothing_is_drawn_in_between(table_with_holes):
    figure, data = figures.relative_velocities(table_with_holes, 1.0, BETA)
    assert np.isnan(data["relative_velocity"]).all()
    nodes = data["node_relative_velocity"]
    assert np.isnan(nodes.sel(node_sp=1.5, node_sf=2.5)).all()
    assert int(np.isnan(nodes).sum()) == 2 * len(HOLES)
    for panel in (axes for axes in figure.axes if axes.get_title("left")):
        crosses = [line.get_xydata()[0] for line in panel.lines if line.get_marker() == "x"]
        expected = conventions.distance_coordinate([where for _, *where in sorted(HOLES)])
        np.testing.assert_array_equal(sorted(map(tuple, crosses)), sorted(map(tuple, expected)))
    assert "hole: no solution" in texts(figure)


def test_other_deborah_numbers_of_a_table_with_holes_are_drawn_in_full(table_with_holes):
    figure, data = figures.relative_velocities(table_with_holes, 0.0, BETA)
    assert np.isfinite(data["relative_velocity"]).all()
    assert "hole" not in texts(figure)


def test_spheres_that_do_not_move_relative_to_each_other_can_be_drawn(table):
    still = table.copy(deep=True)
    still["velocity"][:] = SINGLE
    figures.relative_velocities(still, 1.0, BETA)
    figures.pair_velocity(still, BETA)


def test_pair_velocity_shows_curve_and_nodes_of_every_deborah_number(table):
    figure, data = figures.pair_velocity(table, BETA)
    for De in DEBORAH:
        own = data[data["deborah"] == De].set_index("distance_d")
        law = (1 + De) * relative(np.array(DEMO_NODES[:-1]))
        simulated = own[own["kind"] == "simulated"]["relative_velocity_Ubar"]
        np.testing.assert_allclose(simulated.loc[DEMO_NODES[:-1]], law, rtol=0, atol=1e-14)
        curve = own[own["kind"] == "interpolated"]["relative_velocity_Ubar"]
        assert curve.loc[1.0] == 0.0  # in contact
        assert curve.loc[INF] == pytest.approx(0.0, abs=1e-15)
    words = texts(figure)
    for word in ("$s$ [$d$]", r"\bar{U}", "De = 0", "De = 1", "repulsion: gap", "attraction: gap"):
        assert word in words


def test_pair_velocity_has_bands_of_the_interpolation_error(table):
    axes = figures.pair_velocity(table, BETA).figure.axes[0]
    bands = [band.get_paths()[0].get_extents() for band in axes.collections]
    assert len(bands) == len(DEBORAH)
    for band in bands:
        assert band.x0 >= conventions.distance_coordinate(min(DEMO_NODES)) - 1e-12
    exact = table.drop_vars([name for name in table.variables if name.startswith("check")])
    assert not figures.pair_velocity(exact, BETA).figure.axes[0].collections


def test_small_velocities_of_pairs_are_drawn_again_larger(table):
    """Ten times slower at De = 0 than at De = 1: else one panel with all of them."""
    (axes,) = figures.pair_velocity(table, BETA).figure.axes
    slow = table.copy(deep=True)
    slow["pair_velocity"].loc[{"deborah": 0.0}] = 0.1 * table["pair_velocity"].sel(deborah=1.0)
    slow["velocity"].loc[{"deborah": 0.0}] = 0.1 * table["velocity"].sel(deborah=1.0)
    figure = figures.pair_velocity(slow, BETA).figure
    every, again = figure.axes
    assert again.get_title("left") == "the same, enlarged: De = 0"
    assert [len(own.lines) for own in (axes, every, again)] == [5, 5, 3]  # curves, nodes, zero
    assert every.get_xlim() == again.get_xlim() == (0, 1)
    figure.draw_without_rendering()
    assert min(own.bbox.height for own in figure.axes) > 0.25 * figure.bbox.height


def test_nodes_that_are_not_accurate_are_open_and_widen_the_band(table):
    rough = table.copy(deep=True)
    at = {"deborah": 1.0, "sp": INF, "sf": 2.5}
    rough["status"].loc[at] = INACCURATE
    rough["pair_status"].loc[{"deborah": 1.0, "pair_distance": 2.5}] = INACCURATE
    rough["relative_velocity_error"].loc[at | {"pair": "leading-middle"}] = 1e-4
    figure, data = figures.pair_velocity(rough, BETA)
    (marked,) = data[data["kind"] == "inaccurate"]["distance_d"]
    assert marked == 2.5
    assert "not accurate" in texts(figure)
    before, after = (
        figures.pair_velocity(each, BETA).figure.axes[0].collections[-1].get_paths()[0]
        for each in (table, rough)
    )
    assert after.get_extents().height > before.get_extents().height
    surfaces = figures.relative_velocities(rough, 1.0, BETA).figure
    assert "not accurate" in texts(surfaces)
    assert "not accurate" not in texts(figures.relative_velocities(table, 1.0, BETA).figure)


def test_pair_velocity_is_that_of_a_train_of_two_on_any_grid():
    """One formula for figure, page and train, also where axes have other nodes."""
    sp, sf = [1.2, 2.0, np.inf], [1.1, 1.5, 2.5, np.inf]
    results = [dns_result(p, f) for p in sp for f in sf]
    table = combine(results, sp=sp, sf=sf, deborah=[0.0, 1.0])
    data = figures.pair_velocity(table, BETA).data
    curve = data[(data["kind"] == "interpolated") & (data["deborah"] == 1.0)]
    s = curve["distance_d"].to_numpy()
    velocities = VelocityTable(table).at(1.0)
    closure = EverySphere(velocities)
    expected = [float(chain_motion(closure, np.array([gap])).relative[0]) for gap in s - 1]
    np.testing.assert_allclose(curve["relative_velocity_Ubar"], expected, rtol=0, atol=1e-15)
    np.testing.assert_allclose(np.diff(velocities(np.inf, s))[:, 1], expected, rtol=0, atol=1e-15)


def test_pair_velocity_of_a_table_with_holes_has_crosses_and_no_curve(table_with_holes):
    figure, data = figures.pair_velocity(table_with_holes, BETA)
    own = data[data["deborah"] == 1.0]
    assert own["kind"].value_counts().to_dict() == {"simulated": 3, "hole": 1}
    (hole,) = own[own["kind"] == "hole"]["distance_d"]
    assert hole == 4.5
    drawn = [line for line in lines(figure, marker="x") if len(line.get_xdata())]
    assert drawn[0].get_xdata().tolist() == conventions.distance_coordinate([4.5]).tolist()
    assert "hole" in texts(figure)


def test_stress_field_is_what_the_spheres_change(field):
    figure, data = figures.stress_field(field)
    assert data.sizes["z"] < field.sizes["z"]  # the box is longer than the picture
    positions = data["sphere_position"].values
    assert positions[1] == 0
    assert data["z"].min() >= positions.min() - stress_field.FIELD_MARGIN
    # of the stress at the wall, 16 r^2, nothing is left; of the strands, all, and only with De
    near = data.sel(deborah=1.0).sel(z=positions[2] + 0.15, method="nearest")
    strand = np.exp(-(((near["z"] - positions[2] - 0.15) / 0.1) ** 2))
    assert float(near["stress_change"].sel(r=0)) == pytest.approx(float(strand), abs=0.02)
    assert np.abs(data["stress_change"].sel(r=0.5)).max() < 1e-12
    assert np.abs(data["stress_change"].sel(deborah=0)).max() < 1e-12
    # psi = int (2 - 8 r^2 - 1.5) r dr far from the spheres
    r = data["r"].values
    psi = data["streamfunction"].sel(deborah=1.0).isel(z=0)
    np.testing.assert_allclose(psi, r**2 / 4 - 2 * r**4, rtol=0, atol=2e-3)
    panels = [axes for axes in figure.axes if axes.get_aspect() == 1.0]
    assert len(panels) == 2
    words = texts(figure)
    for word in ("$z$ [$D$]", "$r$ [$D$]", r"\eta_0 \bar{U}/D", "flow", "De = 0", "De = 1"):
        assert word in words
    for word in ("as seen from sphere 2", "1 trailing", "thick line: wall"):
        assert word in words
    for axes, empty in zip(panels, (True, False), strict=True):
        assert any("empty" in text.get_text() for text in axes.texts) == empty
        assert (axes.get_ylim()[1] == 0.5) != empty  # up to the wall


def test_colours_of_the_stress_end_where_all_but_a_hundredth_of_the_field_is():
    """A layer at a sphere, a thousand times as strong, does not bleach the rest."""
    field = np.append(np.linspace(-0.1, 0.1, 9999), [-100.0, 0.0, np.nan])
    norm = stress_field._norm(field)
    assert norm.vmax == -norm.vmin == pytest.approx(0.1)
    assert float(norm(0.0)) == 0.5


def test_stress_field_without_stress_or_with_missing_spheres(field):
    figures.stress_field(field.sel(deborah=[0.0]))
    figure, data = figures.stress_field(synthetic_field(sf=INF))
    assert data.sizes["sphere"] == 2
    assert "\N{INFINITY}" in texts(figure)


def test_spacing_shows_every_station_with_its_measures(train):
    figure, data = figures.spacing(train)
    panels = [axes for axes in figure.axes if axes.lines]
    assert len(panels) == train.sizes["station"]
    xr.testing.assert_identical(data["spacing_density"], train["spacing_density"])
    for axes, station in zip(panels, train["station"].values, strict=True):
        mean = axes.lines[-1]
        assert set(mean.get_xdata()) == {float(train["mean_spacing_law"])}
        words = " ".join(item.get_text() for item in axes.texts)
        assert f"$z$ = {station:g} $D$" in words
        for word in ("CV", "touching", "\N{PLUS-MINUS SIGN}"):
            assert word in words
        own = train.sel(station=station)
        half, model = (
            float(own[f"spacing_variation{end}"]) for end in ("_halfwidth", "_model_error")
        )
        (line,) = (line for line in words.split("\n") if line.startswith("CV"))
        found = line.removeprefix("CV ").split(" \N{PLUS-MINUS SIGN} ")
        expected = [float(own["spacing_variation"]), half, model]
        for word, value in zip(found, expected, strict=True):  # rounded, but not beyond the error
            digit = 10.0 ** -len(word.partition(".")[2])
            assert abs(float(word) - value) <= 0.501 * digit and digit <= max(half, model) / 3
    words = texts(figure)
    for word in ("$s$ [$d$]", "[$1/d$]", "De = 1", r"$\phi$ = 1 % in the channel", "2 repeats"):
        assert word in words
    for word in (
        "1.7 % in the feed",
        "random (gaps uniformly distributed)",
        "model error",
        "sampling error",
    ):
        assert word in words


def test_distances_are_drawn_up_to_a_tenth_beyond_the_largest(train):
    figure, data = figures.spacing(train)
    some = (train["spacing_density"] > 0).any("station") | (train["spacing_density_injected"] > 0)
    bins = train["spacing_bin"]
    largest = float(bins[some.values][-1]) + float(bins.attrs["bin_width"]) / 2
    assert figure.axes[0].get_xlim()[1] == pytest.approx(1.1 * largest)
    highest = data["spacing_density"] + data["spacing_density_model_error"]
    assert figure.axes[0].get_ylim()[1] > float(highest.max())  # bars are whole


def test_spacing_shows_what_the_injection_makes(train):
    figure, data = figures.spacing(train)
    xr.testing.assert_identical(data["spacing_density_injected"], train["spacing_density_injected"])
    variation = float(train["spacing_variation_injected"])
    assert f"as they enter, random (gaps uniformly distributed): CV {variation:.2f}" in texts(
        figure
    )


def test_strings_are_shares_of_spheres_in_words_and_g_of_both_ends(train):
    figure, data = figures.draw("strings_De1_phi0.01", train, BETA)
    (axes,) = figure.axes
    for line, n in zip(axes.lines, (0, -1), strict=False):
        np.testing.assert_array_equal(line.get_ydata(), train["pair_correlation"][n])
    words = texts(figure)
    for n in (0, -1):
        pairs = 100 * float(train["string_share"][n, 1])
        (line,) = (
            line for line in words.split("\n") if f"at {40 if n else 0} $D$: doublets" in line
        )
        shown = float(line.split("doublets ")[1].split(" \N{PLUS-MINUS SIGN}")[0])
        assert shown == pytest.approx(pairs, abs=0.5)
    for word in ("model error", "sampling error", "in the feed", "largest gap"):
        assert word in words
    for name in ("pair_correlation_model_error", "string_share_halfwidth", "string_share_injected"):
        assert name in data


def test_strings_names_only_lengths_that_there_are(train):
    own = train.copy(deep=True)
    own["string_share"][:] = [0.9, 0.0, 0.0, 0.0, 0.1]
    words = texts(figures.strings(own).figure)
    assert "strings of 5 or more 10" in words and "doublets" not in words
    own["string_share"][:] = [1.0, 0.0, 0.0, 0.0, 0.0]
    assert "at 0 $D$: none" in texts(figures.strings(own).figure)


def test_the_largest_distance_at_which_spheres_enter_is_marked_where_there_is_one(train):
    """By uniform intervals it is 2 <s> - d; spheres at random may be as far apart as they like."""
    longest = 2 * float(train["mean_spacing_law"]) - 1
    places = [
        line.get_xdata()[0]
        for line in figures.strings(train).figure.axes[0].lines
        if len(set(line.get_xdata())) == 1
    ]
    width = float(train["spacing_bin"].attrs["bin_width"])
    assert places == [pytest.approx(longest, abs=width)]
    own = train.copy(deep=True)
    own["spacing_density_injected"][:] = 0.01
    assert "farther apart" not in texts(figures.strings(own).figure)


def test_spacing_of_a_single_repeat_has_no_band():
    figure, _ = figures.spacing(synthetic_train(passages=20, repeats=1))
    assert "95 %" not in texts(figure)
    assert "CV" in texts(figure) and "model error" in texts(figure)


def test_figures_say_that_gaps_change_too_fast(table):
    """The fastest of these gaps is 20 * 0.8e-3 Ubar: De of 1 gives a memory number of 0.08."""
    slow, fast = (synthetic_train(passages=20, repeats=1, deborah=De) for De in (0.1, 10.0))
    for draw in (figures.spacing, figures.train):
        assert BEYOND_QUASI_STEADY in texts(draw(fast).figure)
        assert BEYOND_QUASI_STEADY not in texts(draw(slow).figure)
    faster = table.copy(deep=True)
    for name in ("memory_number", "pair_memory_number"):
        faster[name].loc[{"deborah": 1.0}] = 0.11
    for layer, De in ((faster, 1.0), (table, 1.0), (faster, 0.0)):
        beyond = layer is faster and De == 1.0
        words = texts(figures.relative_velocities(layer, De, BETA).figure)
        assert (BEYOND_QUASI_STEADY in words) == beyond
    words = texts(figures.pair_velocity(faster, BETA).figure)
    assert f"De = 1 {conventions.MARK}" in words and f"De = 0 {conventions.MARK}" not in words
    assert f"{conventions.MARK} {BEYOND_QUASI_STEADY}" in words
    assert conventions.MARK not in texts(figures.pair_velocity(table, BETA).figure)


def test_figures_of_trains_say_how_many_spheres_enter_in_a_second(train):
    """The rate of the file, in Ubar/D, over D/Ubar in s; none without units, or at De = 0."""
    De = float(train["deborah"])
    units = xr.Dataset({"time": ("deborah", [np.nan, 0.02])}, {"deborah": [0.0, De]})
    rate = float(train["injection_rate"]) / 0.02
    for name in ("spacing", "strings", "train"):
        words = texts(figures.draw(f"{name}_De{De:g}_phi0.01", train, BETA, units).figure)
        assert f"{rate_in_words(rate)} spheres/s" in words
        assert "spheres/s" not in texts(
            figures.draw(f"{name}_De{De:g}_phi0.01", train, BETA).figure
        )


def test_train_is_a_row_per_sphere(train):
    figure, data = figures.train(train)
    s = data["track_spacing"]
    assert s.sizes["track_sphere"] == train.sizes["track_sphere"] - 1
    y = train["track_position"].values
    np.testing.assert_array_equal(s.values, y[:-1] - y[1:])  # the first sphere is the one ahead
    assert (s > 0.9).all()
    ratio, change = (axes.collections[0].get_array() for axes in figure.axes[:2])
    low, high = figure.axes[0].collections[0].get_clim()
    law = float(train["mean_spacing_law"])
    touches = s.values < TOUCHING
    np.testing.assert_array_equal(np.ma.getmaskarray(ratio).reshape(s.shape), touches)
    drawn = np.ma.getdata(ratio).reshape(s.shape)[~touches]
    np.testing.assert_allclose(law * np.exp(drawn), s.values[~touches], rtol=1e-12)
    assert law * math.exp(low) == pytest.approx(1.0)  # from contact
    assert law * math.exp(high) == pytest.approx(s.values.max())  # to the largest distance
    since = s.values - s.values[:, :1]
    np.testing.assert_allclose(np.asarray(change).reshape(s.shape), since, atol=1e-12)
    low, high = figure.axes[1].collections[0].get_clim()
    assert low == -high
    for axes in figure.axes[:2]:
        assert axes.collections[0].norm(0.0) == 0.5  # white is the mean, and no change
    for word in ("$z$ [$D$]", "[$d$]", "De = 1", r"$\phi$ = 1 %", "in order of passage"):
        assert word in texts(figure)


STUDIED = {  # values of studies, apart in colour and marker
    "deborah": [0, 1, 2, 5, 10, 31, 62],
    "fraction": [0.001, 0.002, 0.004, 0.006, 0.01, 0.015],
    "confinement": [0.1, 0.2, 0.3, 0.4],
}


@pytest.mark.parametrize("name", STUDIED)
def test_colours_and_markers_are_those_of_the_numbers_not_of_their_place_in_a_list(name):
    values = STUDIED[name]
    colour, look = (getattr(style, f"{name}_{end}") for end in ("colour", "look"))
    together = colour(values)
    looks = [look(value) for value in values]
    for own, one in zip(together, looks, strict=True):
        assert one["color"].tolist() == own.tolist()
    assert len(np.unique(together, axis=0)) == len({one["marker"] for one in looks}) == len(values)


def test_every_law_of_injection_has_words_in_figures_and_captions():
    assert set(conventions.INJECTIONS) == set(injection.INJECTIONS)
    captions = [path.read_text("utf-8") for path in (ROOT / "workflow" / "report").glob("*.rst")]
    naming = [words for words in captions if "Spheres enter {{" in words]
    assert len(naming) > 5
    for law, words in conventions.INJECTIONS.items():
        job = SimpleNamespace(
            config={"trains": {"injection": law}, "channel": {}},
            wildcards=SimpleNamespace(deborah=5, volume_fraction=0.004),
        )
        assert all(words in jinja2.Template(own).render(snakemake=job) for own in naming)


def test_what_counts_as_ordered_has_one_line_and_its_number():
    axes = Figure().add_subplot()
    line = conventions.draw_ordered(axes, 0.25)
    assert line.get_label() == "counts as ordered: CV \N{LESS-THAN OR EQUAL TO} 0.25"
    assert set(line.get_ydata()) == {0.25}
    assert line.get_linestyle() != axes.axhline(1, **conventions.CHANNEL).get_linestyle()


def test_numbers_have_so_many_digits_and_no_powers_of_ten():
    values = (0.6266, 12.31, 1738.0, 2e6, 3.0)
    assert [in_digits(value) for value in values] == [
        "0.63",
        "12",
        "1700",
        "2000000",
        "3",
    ]


def test_quantities_have_families_of_colours_of_their_own():
    colours = [getattr(style, f"{name}_colour")(values) for name, values in STUDIED.items()]
    every = np.concatenate([*colours, style.station_colour([0, 0.5, 1])])
    apart = np.abs(every[:, None] - every).max(-1) + np.eye(len(every))
    assert apart.min() > 0.04
    assert style.deborah_colour(0).tolist() == [0, 0, 0, 1]


def test_changes_below_the_error_of_the_velocities_are_hatched(train):
    """E t/beta after a time t, in d: nothing where E is 0 but the entry, all where it is large."""
    for error, share in ((0.0, 0.0), (10.0, 1.0)):
        figure, data = figures.train(train.assign(velocity_error=error))
        since = train["track_time"] - train["track_time"].isel(track_station=0)
        expected = error * since.mean("track_sphere") / BETA
        np.testing.assert_allclose(data["track_error"], expected)
        spans = [
            np.ptp(path.vertices[:, 0])
            for drawn in figure.axes[1].collections[1:]
            for path in drawn.get_paths()
        ]
        rows = train.sizes["track_sphere"] - 1
        assert sum(spans) / rows / 40 == pytest.approx(share, abs=0.05)


def test_figures_are_as_wide_as_a_column_or_a_page(table, train, field):
    for name, shown in (
        ("pair_velocity", table),
        ("relative_velocities_De1", table),
        ("stress_field", field),
        ("spacing_De1_phi0.01", train),
        ("strings_De1_phi0.01", train),
        ("train_De1_phi0.01", train),
    ):
        figure, _ = figures.draw(name, shown, BETA)
        assert figure.get_figwidth() * 25.4 in (pytest.approx(90), pytest.approx(180)), name
        sizes = {item.get_fontsize() for item in figure.findobj(Text) if item.get_text()}
        assert sizes <= {7.0, 8.0, 9.0}, (name, sizes)


# ---------------------------------------------------------------------------------------- files


@pytest.mark.slow
def test_files_are_written_and_read_back_the_same_byte_for_byte(table, tmp_path):
    for folder in ("a", "b"):
        for name in ("relative_velocities_De1", "pair_velocity"):
            drawings.save(figures.draw(name, table, BETA), tmp_path / folder / name)
    first = sorted((tmp_path / "a").iterdir())
    assert [path.name for path in first] == [
        "pair_velocity.csv",
        "pair_velocity.pdf",
        "pair_velocity.png",
        "relative_velocities_De1.nc",
        "relative_velocities_De1.pdf",
        "relative_velocities_De1.png",
    ]
    for path in first:
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes(), path.name
    assert first[1].read_bytes().startswith(b"%PDF")
    assert first[2].read_bytes().startswith(b"\x89PNG")
    drawing = figures.pair_velocity(table, BETA)
    pd.testing.assert_frame_equal(pd.read_csv(first[0]), drawing.data)
    drawing = figures.relative_velocities(table, 1.0, BETA)
    xr.testing.assert_identical(xr.load_dataset(first[3]), datasets.described(drawing.data))


def test_names_with_a_decimal_point_keep_it(train, tmp_path):
    name = "train_De0.5_phi0.004"
    paths = drawings.save(figures.draw(name, train, BETA), tmp_path / name)
    assert [path.name for path in paths] == [f"{name}.png", f"{name}.pdf", f"{name}.nc"]
    assert all(path.stat().st_size for path in paths)


def test_variables_of_data_are_described(table, train):
    for drawing in (figures.relative_velocities(table, 1.0, BETA), figures.spacing(train)):
        for name, variable in drawing.data.variables.items():
            assert variable.attrs["long_name"], name


def test_unknown_names_are_refused(table):
    with pytest.raises(figures.FigureError, match="figure is 'pairs'; allowed: relative_"):
        figures.draw("pairs", table, BETA)


def test_settings_of_the_user_stay_as_they_are(table):
    with matplotlib.rc_context({"font.size": 23}):
        before = dict(matplotlib.rcParams)
        figures.pair_velocity(table, BETA)
        assert dict(matplotlib.rcParams) == before


@pytest.mark.slow
def test_script_from_the_command_line(table, tmp_path):
    datasets.write(table, tmp_path / "table.nc")
    script = "figures.py", "--configfile", CONFIG / "tiny.yaml"
    files = tmp_path / "table.nc", tmp_path / "figures"
    words = output(run_script(*script, "relative_velocities_De1", *files))
    assert len(words.splitlines()) == 3
    data = xr.load_dataset(tmp_path / "figures" / "relative_velocities_De1.nc")
    assert yaml.safe_load(data.attrs["settings"])["confinement"] == 0.2
    done = run_script(*script, "pairs", *files)
    assert done.returncode == 1
    assert done.stderr.startswith("error: figure is 'pairs'")


def test_the_spacing_law_of_a_duct_stands_in_the_figure_of_its_spacings(train):
    """2/3 in a tube, as before; pi/6 in a square, whose data say what is simulated."""

    def law(data):
        return data.figure.legends[0].get_texts()[0].get_text()

    assert r"$\frac{2}{3}\,d\,(d/D)^2/\phi$" in law(figures.spacing(train))
    square = CrossSection(RECTANGLE)
    own = train.assign(mean_spacing_law=train["mean_spacing_law"] * math.pi / 4)
    words = law(figures.spacing(own.assign_attrs(square.attributes)))
    assert f"equally spaced: ${math.pi / 6:.3f}\\,d\\,(d/D)^2" in words
