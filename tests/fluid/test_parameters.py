"""Fluid and scales: scaling, invariance, the Newtonian limit."""

import math
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viscotrain.errors import FluidError
from viscotrain.fluid.parameters import DimensionlessFluid, Mode, mean_spacing

ROUND_OFF = 1e-14  # a few operations in double precision


def physical(viscosity, relaxation_time, mobility=0.0):
    return SimpleNamespace(viscosity=viscosity, relaxation_time=relaxation_time, mobility=mobility)


HYALURONIC_ACID = (physical(0.257, 0.0752, 0.283), physical(0.254, 0.00848, 0.49))

numbers = st.floats(min_value=1e-3, max_value=1e3)
mode_lists = st.lists(st.builds(physical, numbers, numbers, st.floats(0, 0.99)), max_size=4)


def test_two_modes_by_hand():
    fluid = DimensionlessFluid.from_physical(0.051, HYALURONIC_ACID)
    assert fluid.solvent == pytest.approx(0.051 / 0.562, rel=ROUND_OFF)
    first, second = fluid.modes
    assert first.relaxation_time == 1
    assert second.relaxation_time == pytest.approx(0.00848 / 0.0752, rel=ROUND_OFF)
    assert first.viscosity == pytest.approx(0.257 / 0.562, rel=ROUND_OFF)
    assert (first.mobility, second.mobility) == (0.283, 0.49)


@given(solvent=numbers, modes=mode_lists)
def test_scaled_fluid_is_of_order_one(solvent, modes):
    fluid = DimensionlessFluid.from_physical(solvent, modes)
    total = fluid.solvent + sum(mode.viscosity for mode in fluid.modes)
    assert total == pytest.approx(1, abs=1e-12)
    times = [mode.relaxation_time for mode in fluid.modes]
    assert times == sorted(times, reverse=True)
    assert times[:1] in ([], [1])
    if modes:
        assert 0 < fluid.mean_relaxation_time <= 1 + ROUND_OFF


@given(solvent=numbers, modes=st.permutations(HYALURONIC_ACID))
def test_order_of_modes_does_not_matter(solvent, modes):
    expected = DimensionlessFluid.from_physical(solvent, HYALURONIC_ACID)
    assert DimensionlessFluid.from_physical(solvent, modes) == expected


def test_newtonian_fluid():
    fluid = DimensionlessFluid.from_physical(0.001, [])
    assert fluid == DimensionlessFluid(solvent=1.0)
    assert math.isnan(fluid.mean_relaxation_time)


def test_mean_relaxation_time_is_weighted_by_viscosity():
    fluid = DimensionlessFluid(0.5, (Mode(0.4, 1.0), Mode(0.1, 0.5)))
    assert fluid.mean_relaxation_time == pytest.approx(0.9, rel=ROUND_OFF)


@pytest.mark.parametrize(
    ("solvent", "modes", "message"),
    [
        (0.5, (Mode(0.4, 1.0),), "add up to 0.9; allowed: 1"),
        (0.5, (Mode(0.5, 2.0),), "longest relaxation time is 2.0; allowed: 1"),
        (0.0, (Mode(1.0, 1.0),), "solvent viscosity is 0.0; allowed: above 0"),
        (0.5, (Mode(0.5, 1.0, 1.0),), r"allowed: .*mobility in \[0, 1\)"),
        (0.5, (Mode(0.7, 1.0), Mode(-0.2, 0.5)), "allowed: viscosity and time above 0"),
        (math.nan, (), "add up to nan; allowed: 1"),
    ],
)
def test_unscaled_fluid_is_refused(solvent, modes, message):
    with pytest.raises(FluidError, match=message):
        DimensionlessFluid(solvent, modes)


def test_mean_spacing_fills_the_tube_with_the_volume_fraction():
    d, D, phi = 0.3, 1.0, 0.02
    spacing = mean_spacing(d / D, phi) * d
    sphere, tube = math.pi / 6 * d**3, math.pi / 4 * D**2 * spacing
    assert sphere / tube == pytest.approx(phi, rel=ROUND_OFF)
