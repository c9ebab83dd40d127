"""Figure of beads in droplets: what is seen against what the data say."""

import numpy as np
import pytest
import xarray as xr

from viscotrain.drawing.encapsulation_figure import draw_encapsulation
from viscotrain.trains.occupancy import FREQUENCY_RATIO, poisson

RATE = 50.0  # beads per second
SINGLE = [0.4, 0.6, 0.5]  # the second condition is at the inlet, the third one at the end


def found(ratio=1.25):
    """Three conditions with half as many empty droplets as at random; De = 1, then 5 twice."""
    m = 1 / FREQUENCY_RATIO
    curve = np.stack([poisson(m)[0] / 2, poisson(m)[1], 1 - poisson(m)[1] - poisson(m)[0] / 2])
    over = ("condition", "count")
    values = np.array([[0.2, single, 0.8 - single] for single in SINGLE])
    return xr.Dataset(
        {
            "occupancy_curve": ((*over, "frequency_ratio"), np.stack([curve] * 3)),
            "occupancy_curve_halfwidth": ((*over, "frequency_ratio"), np.full((3, 3, 281), 0.02)),
            "occupancy": (over, values),
            "occupancy_halfwidth": (over, np.full((3, 3), 0.03)),
            "best_single": ("condition", np.add(SINGLE, 0.1)),
            "best_single_halfwidth": ("condition", [0.04] * 3),
            "lowest_frequency_ratio": ("condition", [0.8] * 3),
            "highest_frequency_ratio": ("condition", [1.5] * 3),
            "droplet_frequency_ratio": ("condition", [ratio] * 3),
            "mean_count": ("condition", [1.1 / ratio] * 3),
            "bead_rate": ("condition", [RATE] * 3),
        },
        coords={
            "count": ["0", "1", "2+"],
            "frequency_ratio": FREQUENCY_RATIO,
            "deborah": ("condition", [1.0, 5.0, 5.0]),
            "volume_fraction": ("condition", [0.004, 0.004, 0.004]),
            "feed_volume_fraction": ("condition", [0.0072, 0.0066, 0.0066]),
            "station": ("condition", [400.0, 0.0, 400.0]),
            "last_station": ("condition", [1, 0, 1]),
        },
    )


def symbols(axes):
    """Places of all full and all open symbols."""
    found = {False: [], True: []}
    for line in axes.lines:
        if line.get_marker() in tuple("oD"):
            is_open = str(line.get_markerfacecolor()) == "none"
            found[is_open] += zip(line.get_xdata(), line.get_ydata(), strict=True)
    return found[False], found[True]


def test_curves_are_those_of_the_best_condition_at_its_end():
    data = found()
    left = draw_encapsulation(data).figure.axes[0]
    assert left.get_title().startswith("the best condition: De = 5")
    for n in range(3):
        share, random = left.lines[2 * n : 2 * n + 2]
        np.testing.assert_allclose(share.get_ydata(), 100 * data["occupancy_curve"][2, n])
        # the mean count is 1.1 where there is a droplet per bead, as beads come in this sample
        np.testing.assert_allclose(random.get_ydata(), 100 * poisson(1.1 / FREQUENCY_RATIO)[n])
    np.testing.assert_allclose(left.lines[6].get_xdata(), 1.25)
    np.testing.assert_allclose(left.lines[6].get_ydata(), [20, 50, 30])
    span = left.patches[0].get_extents().transformed(left.transData.inverted())
    assert (span.x0, span.x1) == pytest.approx((0.8, 1.5))


def test_droplets_per_second_stand_above():
    left = draw_encapsulation(found()).figure.axes[0]
    (above,) = left.child_axes
    assert above.get_xlabel() == "droplets per second"
    np.testing.assert_allclose(above.get_xticks(), [20, 50, 100, 200])


def test_conditions_are_where_they_belong():
    right = draw_encapsulation(found()).figure.axes[1]
    full, inlet = symbols(right)
    assert full == [pytest.approx((0.72, 40)), pytest.approx((0.66, 50))]
    assert inlet == [pytest.approx((0.66, 60))]
    assert right.get_title() == "all at 62.5 droplets per second"
    assert right.get_ylim() == (30, 70)  # at random one bead in 37 % of the droplets
    (arrow,) = right.texts
    assert (arrow.xyann, arrow.xy) == (pytest.approx((0.66, 60)), pytest.approx((0.66, 50)))


@pytest.mark.parametrize(("best", "words"), [(0.5, "the best droplet"), (0.6, "asked for")])
def test_what_the_dots_are_is_said(best, words):
    data = found()
    data["best_single"] = ("condition", [0.4, 0.6, best])
    (legend, _) = draw_encapsulation(data).figure.legends
    assert any(words in text.get_text() for text in legend.get_texts())


def test_the_inlet_is_drawn_too_and_no_arrow_where_symbols_nearly_agree():
    data = found()
    data["occupancy"][1, 1] = 0.51
    left, right = draw_encapsulation(data).figure.axes[:2]
    (inlet,) = [line for line in left.lines if "as beads enter" in str(line.get_label())]
    np.testing.assert_allclose(inlet.get_ydata(), 100 * data["occupancy_curve"][1, 1])
    assert not right.texts


def test_each_at_its_best_frequency():
    data = found()
    data["droplet_frequency_ratio"] = ("condition", [1.0, 1.1, 0.9])
    right = draw_encapsulation(data).figure.axes[1]
    assert right.get_title() == "each condition at its best frequency"


def test_without_a_velocity_there_are_no_droplets_per_second():
    """A frequency in Hz is not known at De = 0: the largest shares stand in its place."""
    data = found(np.nan)
    for name in ("occupancy", "occupancy_halfwidth", "bead_rate"):
        data[name] = data[name] * np.nan
    left, right = draw_encapsulation(data).figure.axes[:2]
    assert not left.child_axes
    assert symbols(right)[0] == [pytest.approx((0.72, 50)), pytest.approx((0.66, 60))]
