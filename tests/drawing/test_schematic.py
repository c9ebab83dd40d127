"""Schematic: real proportions, from the geometry code."""

import itertools
import math

import harness
import numpy as np
import pytest
import xarray as xr
from matplotlib import image
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.transforms import Bbox

from viscotrain.config import stages
from viscotrain.drawing import schematic
from viscotrain.drawing.style import Drawing
from viscotrain.flow.geometry import Geometry
from viscotrain.fluid.channel import RECTANGLE, CrossSection
from viscotrain.fluid.parameters import mean_spacing
from viscotrain.jobs import drawings


@pytest.fixture(scope="module", params=["config", "paper", "tiny"])
def study(request):
    return stages.schematic(harness.study(request.param))


@pytest.fixture
def drawing(study):
    return schematic.draw(schematic.geometry(study, 1.65))


def spheres(axes):
    return [patch for patch in axes.patches if isinstance(patch, Circle)]


def test_triplet_is_the_geometry_of_the_simulation(study, drawing):
    data = drawing.data
    sp, sf = float(data["sp"]), float(data["sf"])
    assert sp in study.sp and sf in study.sf
    geometry = Geometry.triplet(study.confinement, sp, sf, study.margin)
    drawn = [sphere.center[0] for sphere in spheres(drawing.figure.axes[0])]
    middle = geometry.positions[1]
    np.testing.assert_allclose(drawn, np.array(geometry.positions) - middle)
    box = next(p for p in drawing.figure.axes[0].patches if isinstance(p, Rectangle))
    assert box.get_width() == pytest.approx(geometry.length)


def test_diameters_and_mean_spacing_are_in_proportion(study, drawing):
    for axes in drawing.figure.axes:
        assert axes.get_aspect() == 1
        channel = next(p for p in axes.patches if isinstance(p, Rectangle))
        assert channel.get_height() == 1
        assert {2 * sphere.radius for sphere in spheres(axes)} == {study.confinement}
    z = np.sort([sphere.center[0] for sphere in spheres(drawing.figure.axes[1])])
    assert z[0] == 0
    assert np.diff(z).min() > study.confinement  # no overlap
    phi = study.volume_fraction
    spacing = mean_spacing(study.confinement, phi) * study.confinement
    np.testing.assert_allclose(np.diff(z)[-2:], spacing)


def test_the_feed_has_the_volume_fraction_of_what_enters(study):
    """phi_feed = phi U/Ubar, whichever the study gives."""
    own = schematic.geometry(study, 1.65)
    assert float(own["feed_volume_fraction"]) == pytest.approx(1.65 * study.volume_fraction)
    poured = study.model_copy(update={"feed": True})
    other = schematic.geometry(poured, 1.65)
    assert float(other["feed_volume_fraction"]) == pytest.approx(study.volume_fraction)
    assert float(other["mean_spacing"]) == pytest.approx(1.65 * float(own["mean_spacing"]))
    assert "% in the channel (more in the feed)" in schematic.draw(own).figure.axes[1].get_title(
        "left"
    )


def test_everything_is_named(study, drawing):
    words = " ".join(text.get_text() for axes in drawing.figure.axes for text in axes.texts)
    for word in (
        "$s_p$",
        "$s_f$",
        r"$\langle s\rangle$",
        "$d$",
        "$D$",
        r"$\bar{U}$",
        "periodic",
        "trailing",
        "leading",
    ):
        assert word in words
    assert f"outlet, $z$ = {study.channel_length:g} $D$" in words
    assert "ideal: equally spaced (not computed)" in words and "order" not in words


def test_words_of_the_train_do_not_overlap(study):
    """Of a tube, and of a duct, whose section stands beside it."""
    for section in (study.section, CrossSection(RECTANGLE, 2.0)):
        own = schematic.geometry(study.model_copy(update={"section": section}), 1.65)
        figure = schematic.draw(own).figure
        figure.draw_without_rendering()
        boxes = [text.get_window_extent() for text in figure.axes[1].texts if text.get_text()]
        assert not [pair for pair in itertools.combinations(boxes, 2) if Bbox.intersection(*pair)]


def test_a_duct_has_its_section_and_its_law(study):
    """A rectangle of 2 : 1 beside the train, with the simulated tube in it; pi/12, not 2/3."""
    section = CrossSection(RECTANGLE, 2.0)
    own = schematic.geometry(study.model_copy(update={"section": section}), 1.65)
    upper, lower = schematic.draw(own).figure.axes
    drawn = [p for p in lower.patches if isinstance(p, Rectangle)]
    assert [(p.get_width(), p.get_height()) for p in drawn].count((2.0, 1.0)) == 1
    dashed = [p for p in lower.patches if isinstance(p, Circle) and p.radius == 0.5]
    assert len(dashed) == 1 and dashed[0].get_linestyle() == "--"
    right = drawn[-1].get_x() + drawn[-1].get_width()
    assert right < lower.get_xlim()[1]
    words = " ".join(text.get_text() for text in lower.texts)
    assert "rectangular duct, 2 to 1\n(dashed: simulated)" in words
    assert "in the inscribed tube" in upper.get_title("left")
    assert f"${math.pi / 12:.3f}\\,d\\,\\beta^2/\\phi$" in lower.get_title("left")
    spacing = float(own["mean_spacing"]) / study.confinement * study.volume_fraction
    assert spacing == pytest.approx(math.pi / 12 * study.confinement**2)


def test_a_note_stands_below_a_figure_and_in_its_data(tmp_path):
    """It makes the figure higher, and moves nothing, be it a legend outside of the axes."""

    def figure():
        made = Figure(figsize=(3, 2), layout="constrained")
        made.subplots().plot([1, 2], [3, 4], label="a line")
        made.legend(loc="outside lower center")
        return made

    plain, noted = (
        drawings.save(Drawing(figure(), xr.Dataset()), tmp_path / name, note=note)
        for name, note in (("plain", ""), ("noted", "square duct: as in the inscribed tube"))
    )
    without, written = (image.imread(paths[0]) for paths in (plain, noted))
    below = written.shape[0] - without.shape[0]
    assert below == round(drawings.NOTE_HEIGHT * 200)
    np.testing.assert_array_equal(written[:-below], without)
    assert written[-below:].min() < 0.5  # words
    assert xr.load_dataset(noted[2]).attrs["channel"] == "square duct: as in the inscribed tube"
    assert "channel" not in xr.load_dataset(plain[2]).attrs
