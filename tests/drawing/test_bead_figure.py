"""Figure of unequal spheres: what is seen against what the data say."""

import numpy as np
import pytest
import xarray as xr

from viscotrain.drawing.bead_figure import MISSING, draw_diameter_variation

SIMULATED, LAW = [0.0, 0.01, 0.05], [0.0, 0.025, 0.05]


def found(known=True):
    """Two De and two volume fractions; CV 0.4 by the injection, and 10 times that of diameters."""
    cv = np.hypot(np.array([0.4, 0.0])[:, None], 10 * np.array(SIMULATED))
    law = np.hypot(np.array([0.4, 0.0])[:, None], 10 * np.array(LAW))
    both = {"condition": 4, "injection": 2}
    dims = (*both, "diameter_variation")
    made = xr.Dataset(
        {
            "spacing_variation": (dims, np.broadcast_to(1.1 * cv, (4, 2, 3))),
            "spacing_variation_halfwidth": (dims, np.full((4, 2, 3), 0.02)),
            "law_variation": ((*both, "law_diameter_variation"), np.broadcast_to(law, (4, 2, 3))),
            "ordered_variation": 0.25,
            "study_variation": 0.01,
            "confinement": 0.2,
            "length": 800.0,
        },
        coords={
            "deborah": ("condition", [5.0, 5.0, 31.0, 31.0]),
            "volume_fraction": ("condition", [0.004, 0.01, 0.0041, 0.0102]),
            "given_fraction": ("condition", [0.0066, 0.0165] * 2),
            "diameter_variation": SIMULATED,
            "law_diameter_variation": LAW,
            "injection": ["uniform", "even"],
        },
        attrs={"given": "feed_volume_fraction"},
    )
    if not known:
        made["law_variation"] = np.nan * made["law_variation"]
        made["spacing_variation"] = made["spacing_variation"].where(made.diameter_variation == 0)
    return made


def test_lines_are_the_law_and_symbols_are_simulated():
    figure, data = draw_diameter_variation(found())
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["De = 5", "De = 31"]
    for n, axes in enumerate(figure.axes):
        drawn = [line for line in axes.lines if len(line.get_xdata()) == 3]
        lines = [line for line in drawn if line.get_linestyle() != "None"]
        symbols = [line for line in drawn if line.get_marker() not in ("None", None, "")]
        assert len(lines) == len(symbols) == 4
        for k, (line, marks) in enumerate(zip(lines, symbols, strict=True)):
            own = data.isel(condition=2 * n + k // 2, injection=k % 2)
            np.testing.assert_allclose(line.get_xdata(), 100 * np.array(LAW))
            np.testing.assert_array_equal(line.get_ydata(), own["law_variation"])
            np.testing.assert_allclose(marks.get_xdata(), 100 * np.array(SIMULATED))
            np.testing.assert_array_equal(marks.get_ydata(), own["spacing_variation"])
            assert line.get_linestyle() == ("-", "--")[k % 2]
            assert (str(marks.get_markerfacecolor()) == "none") == bool(k % 2)
        levels = [line.get_ydata()[0] for line in axes.lines if len(set(line.get_ydata())) == 1]
        assert 0.25 in levels
        assert axes.get_ylim()[1] > 1.0
    (legend,) = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert words[:2] == [r"$\phi_{feed}$ = 0.66 %", r"$\phi_{feed}$ = 1.65 %"]
    assert words[-1] == "beads of the study"
    assert (
        "injection: random (gaps uniformly distributed)" in words
        and "injection: equally spaced" in words
    )


def test_a_single_volume_fraction_is_in_the_title_and_all_that_is_drawn_within_the_axes():
    one = found().isel(condition=[0, 2])
    one["spacing_variation_halfwidth"] = one["spacing_variation_halfwidth"] + 2.0
    figure, data = draw_diameter_variation(one)
    assert r"$\phi_{feed}$ = 0.66 %" in figure.get_suptitle()
    (legend,) = figure.legends
    assert not [text for text in legend.get_texts() if "phi" in text.get_text()]
    high = float((data["spacing_variation"] + data["spacing_variation_halfwidth"]).max())
    assert figure.axes[0].get_ylim()[1] > high > 2


def test_what_is_not_known_is_said():
    figure, _ = draw_diameter_variation(found(known=False))
    assert MISSING in figure.get_suptitle()
    assert figure.axes[0].get_ylim()[1] == pytest.approx(1.03)
    assert figure.axes[0].get_ylim()[0] < 0  # symbols at zero are whole
