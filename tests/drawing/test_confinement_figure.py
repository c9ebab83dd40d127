"""Figures that compare diameters, and their page: what is seen against what the data say."""

import numpy as np
import pytest
import xarray as xr

from viscotrain.drawing import confinement_figure
from viscotrain.drawing.confinement_figure import (
    draw_all,
    draw_lengths,
    draw_maps,
    draw_orders,
    draw_velocities,
)
from viscotrain.drawing.confinement_page import page
from viscotrain.drawing.style import confinement_look

BETA = [0.1, 0.2, 0.4]
XI = np.array([0.1, 0.3, 1.0])
CURVE = np.array([-1.0, 2.0, 1.0])


def found():
    """Velocities that go with beta^4 at De = 5, and with 2 beta^4 at De = 1; l = beta^-4."""
    beta = np.array(BETA)
    U = np.stack(
        [0 * CURVE + 0 * beta[:, None], 2 * np.outer(beta**4, CURVE), np.outer(beta**4, CURVE)]
    )
    largest = ("deborah", "largest_confinement")
    full = np.full((3, 2), 4.0)
    length = np.stack([np.full(3, np.inf), beta**-4, beta**-4])
    return xr.Dataset(
        {
            "relative_velocity": (("deborah", "confinement", "surface_distance"), U),
            "relative_velocity_error": (("deborah", "confinement", "surface_distance"), 0 * U),
            "exponent": ((*largest, "surface_distance"), np.full((3, 2, 3), 3.9)),
            "exponent_halfwidth": ((*largest, "surface_distance"), np.full((3, 2, 3), 0.3)),
            "collapse_exponent": (largest, full),
            "collapse_nearest": (largest, np.full((3, 2), 0.3)),
            "collapse_farthest": (largest, np.full((3, 2), 1.0)),
            "shortest_ordering_length": (("deborah", "confinement"), length),
            "shortest_ordering_length_volume_fraction": (
                ("deborah", "confinement"),
                np.where(np.isfinite(length), 0.01, np.nan),
            ),
        },
        coords={
            "deborah": [0.0, 1.0, 5.0],
            "confinement": BETA,
            "surface_distance": XI,
            "largest_confinement": BETA[1:],
        },
    )


def order(beta):
    """At De = 5 unstable when dense, and ordering along 100 D and 200 D when not.

    When very dilute it is unstable too, but grows by e along 10^6 D only.
    """
    growth = [[[0.0] * 2] * 4, [[0, 1e-2], [0, -1e-2], [0, -1e-2], [0, 2e-6]]]
    return xr.Dataset(
        {
            "ordering_length": (
                ("deborah", "spacing"),
                [[np.inf] * 4, [np.inf, 100.0, 200.0, np.inf]],
            ),
            "stability": (("deborah", "spacing"), [[0, 0, 0, 0], [-1, 1, 1, -1]]),
            "growth_rate": (("deborah", "spacing", "wave_number"), growth),
            "velocity": (("deborah", "spacing"), np.full((2, 4), 2.0)),
            "confinement": beta,
        },
        coords={
            "deborah": [0.0, 5.0],
            "spacing": [1.5, 3.0, 6.0, 12.0],
            "volume_fraction": ("spacing", [0.03, 0.02, 0.01, 0.005]),
        },
    )


def design_map(beta, given="volume_fraction"):
    """Two stations; the inlet's CV is 0.5, the outlet's 0.2 and, where it was simulated, 0.4."""
    values = np.array([[[0.5, 0.2], [0.5, 0.4]], [[0.5, 0.3], [np.nan, np.nan]]])
    dims = ("deborah", given, "station")
    coords = {"deborah": [1.0, 5.0], given: [0.002, 0.004], "station": [0.0, 800.0]}
    if given != "volume_fraction":
        coords["volume_fraction"] = (("deborah", given), np.array([[0.002, 0.004]] * 2) / 2)
    return xr.Dataset(
        {
            "spacing_variation": (dims, values),
            "spacing_variation_halfwidth": (dims, 0 * values + 0.01),
            "spacing_variation_model_error": (dims, 0 * values + 0.02),
            "mean_spacing": (dims, 3.0 + np.arange(4).reshape(2, 2, 1) + 0 * values),
            "ordered_variation": 0.25,
            "confinement": beta,
        },
        coords=coords,
        attrs={"given": given},
    )


def lines_named(axes, text):
    return [line for line in axes.lines if text in str(line.get_label())]


def test_scaled_velocities_of_all_diameters_lie_on_one_curve():
    figure, data = draw_velocities(found())
    slow, fast = figure.axes[:2]
    assert [axes.get_title("left")[:6] for axes in (slow, fast)] == ["De = 1", "De = 5"]
    assert slow.get_ylim() == fast.get_ylim()
    for axes, factor in ((slow, 2), (fast, 1)):
        curves = lines_named(axes, "d/D")
        assert [curve.get_label() for curve in curves] == [f"$d/D$ = {beta:g}" for beta in BETA]
        for curve, beta in zip(curves, BETA, strict=True):
            np.testing.assert_allclose(curve.get_xdata(), XI)
            np.testing.assert_allclose(curve.get_ydata(), factor * np.array([np.nan, 2, 1]))
            assert curve.get_marker() == confinement_look(beta)["marker"]
        together = [line for line in axes.lines if line not in curves]
        assert len(together) == 3
        np.testing.assert_allclose(together[0].get_ydata(), factor * np.array([1, np.nan, np.nan]))
    one = data[(data["deborah"] == 5) & (data["confinement"] == 0.2)]
    np.testing.assert_allclose(one["relative_velocity_Ubar"], 0.2**4 * CURVE)
    np.testing.assert_allclose(one["scaled_velocity_Ubar"], CURVE)


def test_what_is_not_known_leaves_its_panels_empty():
    """No velocity is above its error, no train orders; pictures are made all the same."""
    nothing = found()
    nothing["relative_velocity_error"] += 1.0
    nothing["shortest_ordering_length"][:] = np.inf
    nothing["exponent"][:], nothing["collapse_nearest"][:] = np.nan, np.nan
    for drawing in (draw_velocities(nothing), draw_lengths(nothing, 800.0)):
        drawing.figure.canvas.draw()
    disordered = order(0.1).assign(ordering_length=lambda own: 0 * own["ordering_length"] + np.inf)
    draw_orders(
        [disordered.assign(stability=disordered["stability"] * 0)], 800.0
    ).figure.canvas.draw()


def test_the_power_has_its_error_and_a_bar_where_one_holds():
    below = draw_velocities(found()).figure.axes[3]
    assert [container.lines[0].get_ydata()[0] for container in below.containers] == [3.9, 3.9]
    (segments,) = {
        str(bar.get_segments()[0][:, 1].round(6)) for c in below.containers for bar in c.lines[2]
    }
    assert segments == str(np.array([3.6, 4.2]))
    words = [text.get_text() for text in draw_velocities(found()).figure.axes[2].texts]
    assert "agree within 20 %" in words[0]
    bars = [line for line in below.lines if line.get_lw() == 3]
    assert [tuple(bar.get_xdata()) for bar in bars] == [(0.3, 1.0)] * 2


def test_large_errors_are_left_out_and_powers_of_attraction_are_dotted():
    wide = found()
    wide["exponent_halfwidth"][:, 1] = 16.0
    figure = draw_velocities(wide).figure
    narrow, large = figure.axes[3].containers
    assert all(bar.size for bar in narrow.lines[2][0].get_segments())
    assert not any(bar.size for bar in large.lines[2][0].get_segments())
    ranges = [text.get_text() for text in figure.axes[2].get_legend().get_texts()]
    assert ranges == ["0.1\N{EN DASH}0.2", "0.1\N{EN DASH}0.4"]
    solid, dotted = figure.axes[3].lines[:2]
    assert np.isnan(solid.get_ydata()).tolist() == [True, False, False]
    assert np.isnan(dotted.get_ydata()).tolist() == [False, True, True]


def test_ordering_lengths_stand_against_the_confinement_with_the_power_that_follows():
    figure, data = draw_lengths(found(), 800.0)
    lengths, fractions = figure.axes
    curve = lines_named(lengths, "De = 5")[0]
    np.testing.assert_allclose(curve.get_xdata(), BETA)
    np.testing.assert_allclose(curve.get_ydata(), np.array(BETA) ** -4.0)
    guide = lines_named(lengths, "-4")[0].get_ydata()
    assert guide[0] / guide[-1] == pytest.approx(4**4)
    assert set(lines_named(lengths, "channel, 800")[0].get_ydata()) == {800.0}
    np.testing.assert_allclose(lines_named(fractions, "De = 5")[0].get_ydata(), 1.0)
    assert set(data["deborah"]) == {1.0, 5.0}


def test_order_has_a_curve_for_each_diameter_and_bars_where_trains_are_unstable():
    figure, data = draw_orders([order(beta) for beta in BETA], 800.0)
    (axes,) = figure.axes
    assert "De = 5" in axes.get_title("left")
    for curve in lines_named(axes, "d/D"):
        np.testing.assert_allclose(curve.get_xdata(), [3, 2, 1, 0.5])
        np.testing.assert_allclose(curve.get_ydata(), [np.nan, 100, 200, np.nan])
    for width, where in (
        (confinement_figure.THICK, [True, False, False, False]),
        (confinement_figure.THIN, [False, False, False, True]),
    ):
        bars = [line for line in axes.lines if line.get_lw() == width and not line.get_clip_on()]
        assert [np.isfinite(bar.get_ydata()).tolist() for bar in bars] == [where] * 3
        assert min(np.nanmin(bar.get_ydata()) for bar in bars) > 1  # above the panel
    assert set(data["deborah"]) == {5.0}
    channel = lines_named(axes, "channel, ")[0]
    assert set(channel.get_ydata()) == {800.0}


@pytest.mark.parametrize("given", ["volume_fraction", "feed_volume_fraction"])
def test_maps_show_what_is_left_of_the_scatter_with_both_errors(given):
    figure, data = draw_maps([design_map(beta, given) for beta in BETA])
    first, second = figure.axes
    assert len(first.containers) == len(second.containers) == 3
    curve = first.containers[0].lines[0]
    np.testing.assert_allclose(curve.get_xdata(orig=False), [3, 4])
    np.testing.assert_allclose(curve.get_ydata(orig=False), [0.4, 0.8])
    np.testing.assert_allclose(second.containers[0].lines[0].get_ydata(orig=False), [0.6])
    np.testing.assert_allclose(data["error"], 0.03)
    np.testing.assert_allclose(data["remaining_error"], 0.06)
    share = 1 if given == "volume_fraction" else 2
    first_map = data[(data["confinement"] == BETA[0]) & (data["deborah"] == 1)]
    np.testing.assert_allclose(first_map["volume_fraction_percent"], np.array([0.2, 0.4]) / share)


def test_without_maps_there_is_no_figure_of_them():
    orders = [order(beta) for beta in BETA]
    assert list(draw_all(found(), orders, [], 800.0)) == [
        "confinement",
        "confinement_length",
        "confinement_order",
    ]
    maps = [design_map(beta) for beta in BETA]
    assert "confinement_design_map" in draw_all(found(), orders, maps, 800.0)


def test_the_page_links_each_diameter_and_holds_its_figures(tmp_path):
    picture = tmp_path / "figure.png"
    picture.write_bytes(b"abc")
    text = page("a<b", ["beta0.1", "beta0.2"], [{"d/D": "0.1"}], {"One & two": picture}, "x < y")
    assert '<a href="beta0.2/interactive.html">beta0.2</a>' in text
    assert "data:image/png;base64,YWJj" in text
    assert "One &amp; two" in text and "x &lt; y" in text and "a&lt;b" in text
    assert "<td>0.1</td>" in text
    assert "http:" not in text and "https:" not in text
