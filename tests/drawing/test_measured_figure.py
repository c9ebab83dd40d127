"""Measured spacings on the figure of the distributions: what is seen against what the data say."""

import numpy as np
import pytest
from synthetic import SINGLE, at_deborah, triplet

from viscotrain.config.device_settings import (
    FiguresSettings,
)
from viscotrain.drawing import figures, train_figures
from viscotrain.files import MADE_HERE
from viscotrain.fluid.channel import ROUND
from viscotrain.jobs import datasets
from viscotrain.trains import measured
from viscotrain.trains.repeats import run_repeats
from viscotrain.trains.spacings_file import Spacing

SEEN = [2.2, 2.6, 2.7, 3.4]  # at 40 D


@pytest.fixture(scope="module")
def trains():
    result = run_repeats(
        triplet(),
        confinement=0.2,
        volume_fraction=0.01,
        centreline_velocity=SINGLE,
        length=40.0,
        stations=[0.0, 40.0],
        passages=40,
        repeats=2,
        seed=1,
    )
    return at_deborah(result, 1.0)


@pytest.fixture(scope="module")
def compared(trains):
    return measured.compare(trains, [Spacing(40.0, s, None, None) for s in SEEN])


def test_points_are_at_the_station_where_they_were_measured(trains, compared):
    drawing = train_figures.spacing(trains.assign(compared.data_vars))
    panels = drawing.figure.axes
    points = [
        [line for line in axes.lines if line.get_marker() == "o" and len(line.get_xdata())]
        for axes in panels
    ]
    assert [len(found) for found in points] == [0, 1]
    np.testing.assert_allclose(points[1][0].get_xdata(), [2.5, 3.5])
    np.testing.assert_allclose(points[1][0].get_ydata(), [0.75, 0.25])
    assert panels[1].get_ylim()[1] > 0.75 + np.sqrt(3) / 4
    words = [axes.texts[-1].get_text() for axes in panels]
    distance = float(compared["ks_distance"][1])
    assert "measured" not in words[0]
    assert f"measured 4: KS {distance:.2f}, p = " in words[1]
    legend = [text.get_text() for text in drawing.figure.legends[0].get_texts()]
    assert "measured, \N{PLUS-MINUS SIGN} root of the count" in legend
    assert drawing.data["ks_distance"].equals(compared["ks_distance"])
    assert drawing.data["measured_spacing"].values.tolist() == SEEN


def test_without_measured_spacings_the_figure_is_as_it_was(trains):
    drawing = train_figures.spacing(trains)
    assert not any("measured" in str(name) for name in drawing.data.variables)
    legend = [text.get_text() for text in drawing.figure.legends[0].get_texts()]
    assert not any(text.startswith("measured") for text in legend)


def test_a_file_of_measured_spacings_reaches_the_figure(trains, compared, tmp_path):
    train, seen = tmp_path / "train.nc", tmp_path / "measured.nc"
    datasets.write(trains.assign_attrs({MADE_HERE: "0123"}), train)
    datasets.write(compared.assign_attrs({MADE_HERE: "0123"}), seen)
    settings = FiguresSettings(confinement=0.2, section=ROUND)
    for name in ("spacing_De1_phi0.01", "strings_De1_phi0.01"):
        drawing = figures.draw_with(settings, name, train, None, seen)
        assert ("ks_distance" in drawing.data) == name.startswith("spacing")
