"""Sections of channels: area, spacing law by counting spheres, and what is said of a duct."""

import math

import pytest

from viscotrain.fluid.channel import RECTANGLE, ROUND, CrossSection
from viscotrain.fluid.parameters import Fluid, Mode, mean_spacing
from viscotrain.fluid.units import physical_units

SECTIONS = {
    "tube": (ROUND, math.pi / 4 * 100e-6**2),
    "square": (CrossSection(RECTANGLE), 100e-6**2),
    "rectangle": (CrossSection(RECTANGLE, 2.5), 100e-6 * 250e-6),
}
D, d = 100e-6, 20e-6  # m
ROUND_OFF = 1e-14


@pytest.mark.parametrize("name", SECTIONS)
def test_spheres_at_the_mean_spacing_make_the_volume_fraction(name):
    """So phi = (pi/6) d^3/(s* d A), with an area in m^2."""
    section, area = SECTIONS[name]
    phi = 0.006
    spacing = section.mean_spacing(d / D, phi) * d
    assert math.pi / 6 * d**3 / (spacing * area) == pytest.approx(phi, rel=ROUND_OFF)


def test_the_laws_are_those_of_the_literature():
    """s* phi = 2/3 beta^2 in a tube, to the bit as before, and pi/6 beta^2 in a square."""
    assert ROUND.mean_spacing(0.2, 0.004) == mean_spacing(0.2, 0.004)
    assert CrossSection(RECTANGLE).mean_spacing(0.2, 0.004) == pytest.approx(
        math.pi / 6 * 0.04 / 0.004, rel=ROUND_OFF
    )


@pytest.mark.parametrize("name", SECTIONS)
def test_flow_rate_is_area_times_mean_velocity(name):
    section, area = SECTIONS[name]
    fluid = Fluid(0.051, (Mode(0.257, 0.0752, 0.283),))
    units = physical_units(
        fluid, {5.0: 5.0}, channel_diameter=D, particle_diameter=d, section=section
    ).sel(deborah=5)
    expected = area * 5 * D / 0.0752 * 60e9  # De = lambda_1 Ubar/H
    assert float(units["flow_rate"]) == pytest.approx(expected, rel=ROUND_OFF)
    assert units.attrs.get("channel", "") == section.remark


def test_a_duct_says_what_is_simulated_and_a_tube_does_not():
    assert ROUND.remark == "" and ROUND.attributes == {}
    for name, words in (("square", "square duct"), ("rectangle", "rectangular duct, 2.5 to 1")):
        remark = SECTIONS[name][0].remark
        assert remark == f"{words}: interactions are those of the inscribed tube"
