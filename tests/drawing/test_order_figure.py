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
            )
        },
        coords={"deborah": [5.0], "volume_fraction": [0.006, 0.01], "station": [0.0, LENGTH]},
    )


def test_curves_and_points_are_those_of_the_data():
    figure, data = draw_order(found(), LENGTH, UNITS, simulated())
    left, right = figure.axes[:2]
    curve = left.lines[0]
    assert curve.get_label() == "De = 5"
    np.testing.assert_allclose(curve.get_xdata(), 100 * 2 / 3 * 0.04 / SPACING)
    np.testing.assert_allclose(curve.get_ydata(), [np.nan, 400, 4000])
    np.testing.assert_allclose(
        data["remaining_variation"].sel(deborah=5)[1:], law(LENGTH, np.array([400, 4000.0]))
    )
    points = next(line for line in right.lines if line.get_marker() not in ("None", ""))
    np.testing.assert_allclose(points.get_xdata(), [0.6, 1.0])
    np.testing.assert_allclose(points.get_ydata(), [0.8, 1.2])
    channel = next(line for line in left.lines if "channel" in str(line.get_label()))
    assert set(channel.get_ydata()) == {LENGTH}


def test_unstable_trains_are_marked_and_a_reversible_flow_is_not_drawn():
    left = draw_order(found(), LENGTH, UNITS).figure.axes[0]
    bar = left.lines[1]
    assert np.isfinite(bar.get_ydata()).tolist() == [True, False, False]
    assert not any("De = 0" in str(line.get_label()) for line in left.lines)


def test_lengths_stand_in_centimetres_too():
    left = draw_order(found(), LENGTH, UNITS).figure.axes[0]
    (other,) = left.child_axes
    forward, _ = other._functions
    assert forward(LENGTH) == pytest.approx(8.0)
