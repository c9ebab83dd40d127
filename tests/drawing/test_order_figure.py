"""Figure of the ordering length: what is seen against what the data say."""

import numpy as np
import pytest
import xarray as xr

from viscotrain.drawing.order_figure import draw_order
from viscotrain.trains.order import WAVE_NUMBERS, law

LENGTH, SPACING = 800.0, np.array([1.5, 3.0, 6.0])
UNITS = xr.Dataset({"channel_diameter": 0.1})  # mm
U = 1.7


def found():
    """De = 0 does nothing; De = 5 is unstable when dense, and orders along 400 D and 4000 D."""
    length = np.array([[np.inf] * 3, [np.inf, 400.0, 4000.0]])
    with np.errstate(divide="ignore"):
        rate = -(U / length)[..., None] * (1 - np.cos(WAVE_NUMBERS)) / 2
    rate[1, 0] = 0.01 * (1 - np.cos(WAVE_NUMBERS))
    return xr.Dataset(
        {
            "ordering_length": (("deborah", "spacing"), length),
            "stability": (("deborah", "spacing"), [[0, 0, 0], [-1, 1, 1]]),
            "velocity": (("deborah", "spacing"), np.full((2, 3), U)),
            "growth_rate": (("deborah", "spacing", "wave_number"), rate),
            "confinement": 0.2,
        },
        coords={
            "deborah": [0.0, 5.0],
            "spacing": SPACING,
            "wave_number": WAVE_NUMBERS,
            "volume_fraction": ("spacing", 2 / 3 * 0.04 / SPACING),
        },
    )


def simulated():
    """Two conditions at De = 5; the scatter falls to 0.8 of the inlet's in the first one."""
    return xr.Dataset(
        {
            "spacing_variation": (
                ("deborah", "volume_fraction", "station"),
                [[[0.5, 0.4], [0.5, 0.6]]],
            ),
            "diameter_variation": 0.0,
        },
        coords={"deborah": [5.0], "volume_fraction": [0.006, 0.01], "station": [0.0, LENGTH]},
        attrs={"injection": "poisson"},
    )


TABLE = xr.Dataset({"memory_number": ("deborah", [0.0, 0.2])}, {"deborah": [0.0, 5.0]})


def draw(trains=None):
    """Figure, its data, and the panels of bars, lengths and ratios."""
    figure, data = draw_order(found(), LENGTH, UNITS, TABLE, trains)
    bars, _, left, right = figure.axes[:4]
    return figure, data, bars, left, right


def test_curves_and_points_are_those_of_the_data():
    _, data, _, left, right = draw(simulated())
    curve = left.lines[0]
    np.testing.assert_allclose(curve.get_xdata(), 100 * 2 / 3 * 0.04 / SPACING)
    np.testing.assert_allclose(curve.get_ydata(), [np.nan, 400, 4000])
    np.testing.assert_allclose(
        data["remaining_variation"].sel(deborah=5)[1:], law(LENGTH, np.array([400, 4000.0]))
    )
    points = next(line for line in right.lines if line.get_marker() not in ("None", ""))
    np.testing.assert_allclose(points.get_xdata(orig=False), [0.6, 1.0])
    np.testing.assert_allclose(points.get_ydata(orig=False), [0.8, 1.2])
    assert set(left.lines[-1].get_ydata()) == {LENGTH}  # the channel


def test_symbols_have_the_errors_of_the_outlet():
    trains = simulated()
    trains["spacing_variation_halfwidth"] = 0 * trains["spacing_variation"] + 0.05
    trains["spacing_variation_model_error"] = 0 * trains["spacing_variation"] + 0.1
    _, data, _, _, right = draw(trains)
    np.testing.assert_allclose(data["simulated_variation_error"].sel(deborah=5), 0.3)
    low, high = right.containers[0].lines[2][0].get_segments()[1][:, 1]
    assert (low, high) == pytest.approx((0.9, 1.5))
    assert right.get_ylim()[1] > 1.5


def test_both_panels_hold_all_simulated_trains():
    """CV may more than double, at a volume fraction beyond those of the theory."""
    far = simulated().assign_coords(volume_fraction=[0.001, 0.03])
    far["spacing_variation"][0, 1, 1] = 1.3
    _, _, _, left, right = draw(far)
    assert left.get_xlim() == right.get_xlim()
    low, high = right.get_xlim()
    assert low < 0.1 and high > 3 and right.get_ylim()[1] > 2.6


def test_unstable_trains_are_marked_and_a_reversible_flow_is_not_drawn():
    figure, _, bars, left, _ = draw()
    (bar,) = bars.lines
    assert np.isfinite(bar.get_ydata()).tolist() == [True, False, False]
    assert len(left.lines) == 2  # De = 5 and the channel
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names[0] == "De = 5 \N{DAGGER}" and "channel, $L$ = 800 $D$" in names


def test_what_is_not_known_is_neither_stable_nor_unstable():
    lost = found()
    lost["stability"] = lost["stability"].where(lost["deborah"] < 5)
    lost["ordering_length"] = lost["ordering_length"].where(lost["deborah"] < 5)
    bars = draw_order(lost, LENGTH, UNITS, TABLE).figure.axes[0]
    assert np.isnan(bars.lines[0].get_ydata()).all()


def test_lengths_stand_in_centimetres_too():
    left = draw()[3]
    (other,) = left.child_axes
    forward, _ = other._functions
    assert forward(LENGTH) == pytest.approx(8.0)
