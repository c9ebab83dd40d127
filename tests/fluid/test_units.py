"""Physical units: factors by hand, both Deborah numbers, the Newtonian limit."""

import numpy as np
import pytest

from viscotrain.fluid.parameters import Fluid, Mode
from viscotrain.fluid.units import FACTORS, physical_units

HYALURONIC_ACID = (Mode(0.257, 0.0752, 0.283), Mode(0.254, 0.00848, 0.49))
ROUND_OFF = 1e-14  # a few operations in double precision


def units(longest_modes, modes=HYALURONIC_ACID):
    return physical_units(
        Fluid(0.051, modes), longest_modes, channel_diameter=100e-6, particle_diameter=20e-6
    )


def test_factors_by_hand():
    """De = 5 in a channel of 100 um: 6.65 mm/s and 3.1 uL/min."""
    at_five = units({0.0: 0.0, 5.0: 5.0}).sel(deborah=5)
    velocity = 5 * 100e-6 / 0.0752
    mean = (0.257 * 0.0752 + 0.254 * 0.00848) / 0.511
    expected = {
        "deborah_longest_mode": 5.0,
        "deborah_mean_relaxation_time": 5 * mean / 0.0752,
        "channel_diameter": 0.1,
        "particle_diameter": 0.02,
        "mean_velocity": velocity,
        "time": 0.0752 / 5,
        "stress": 0.562 * velocity / 100e-6,
    }
    for name, value in expected.items():
        assert float(at_five[name]) == pytest.approx(value, rel=ROUND_OFF), name
    assert float(at_five["mean_velocity"]) == pytest.approx(6.65e-3, abs=5e-6)
    assert float(at_five["flow_rate"]) == pytest.approx(3.1, abs=0.05)


@pytest.mark.parametrize("modes", [HYALURONIC_ACID, ()])
def test_newtonian_limit_has_no_velocity_scale(modes):
    at_zero = units({0.0: 0.0}, modes).sel(deborah=0)
    for name in ("deborah_longest_mode", "deborah_mean_relaxation_time"):
        assert float(at_zero[name]) == 0
    assert float(at_zero["channel_diameter"]) == pytest.approx(0.1)
    for name in ("mean_velocity", "time", "flow_rate", "stress"):
        assert np.isnan(at_zero[name])


def test_deborah_numbers_are_named_as_the_study_defines_them():
    other = units({5.0: 8.9}).sel(deborah=5)
    assert float(other["deborah_longest_mode"]) == 8.9
    assert float(other["time"]) == pytest.approx(0.0752 / 8.9)


def test_every_factor_says_its_unit_and_meaning():
    dataset = units({5.0: 5.0})
    assert set(dataset.variables) == set(FACTORS)
    for name, variable in dataset.variables.items():
        assert variable.attrs["units"] and variable.attrs["long_name"], name
    assert dataset["flow_rate"].attrs["units"] == "uL min-1"
