"""Operating conditions: every number by hand, every limit from both sides, and in words."""

import math

import numpy as np
import pytest
import xarray as xr

from viscotrain.fluid.channel import RECTANGLE, ROUND, CrossSection
from viscotrain.fluid.parameters import DimensionlessFluid, Fluid, Mode
from viscotrain.fluid.units import physical_units
from viscotrain.studies.channel_flow import channel_flow
from viscotrain.trains import operating_conditions as conditions

FLUID = Fluid(0.051, (Mode(0.257, 0.0752, 0.283), Mode(0.254, 0.00848, 0.49)))
SCALED = DimensionlessFluid.from_physical(FLUID.solvent_viscosity, FLUID.modes)
D, d, ETA_0, LAMBDA_1, U_P = 100e-6, 20e-6, 0.562, 0.0752, 1.65
NUMBERS = {0.0: 0.0, 5.0: 5.0}


def train(deborah=5.0, phi=0.004, memory=0.04, section=ROUND, beta=0.2):
    """What is read of the file of a train."""
    law = section.mean_spacing(beta, phi)
    values = {
        "deborah": deborah,
        "volume_fraction": phi,
        "feed_volume_fraction": U_P * phi,
        "confinement": beta,
        "isolated_velocity": U_P,
        "channel_length": 800.0,
        "mean_spacing_law": law,
        "injection_rate": U_P / (law * beta),
    }
    return xr.Dataset(values).assign(memory_number=("repeat", [memory, memory / 2]))


def found(*trains, section=ROUND, **densities):
    given = {"fluid_density": 1000.0, "particle_density": 1050.0} | densities
    units = physical_units(FLUID, NUMBERS, channel_diameter=D, particle_diameter=d, section=section)
    flow = channel_flow(SCALED, NUMBERS, section)
    return conditions.operating_conditions(
        trains, units=units, flow=flow, fluid=FLUID, section=section, **given
    )


def test_numbers_by_hand():
    own = found(train()).isel(condition=0)
    Ubar = 5 * D / LAMBDA_1
    Re = 1000 * Ubar * D / ETA_0
    residence = 800 * D / (U_P * Ubar)
    sinking = 50 * 9.81 * d**2 / (18 * ETA_0)  # m/s
    rate = 0.004 * U_P * Ubar * math.pi / 4 * D**2 / (math.pi / 6 * d**3)
    expected = {
        "mean_spacing": 2 / 3 * 0.04 / 0.004,
        "mean_velocity": 1e3 * Ubar,
        "flow_rate": Ubar * math.pi / 4 * D**2 * 60e9,
        "sphere_rate": rate,
        "residence_time": residence,
        "reynolds_number": Re,
        "elasticity_number": LAMBDA_1 * ETA_0 / (1000 * D**2),
        "settling": sinking * residence / D,
        "memory_number": 0.04,
    }
    for name, value in expected.items():
        assert float(own[name]) == pytest.approx(value, rel=1e-12), name
    # Rabinowitsch: the stress at the wall is that of the pressure drop, and of the rate there
    drop = float(own["pressure_drop"]) * 1e5
    wall = float(own["wall_shear_rate"])
    viscosity = drop / (800 * D) * D / 4 / wall
    assert float(own["polymer_share"]) == pytest.approx(1 - 0.051 / viscosity, rel=1e-9)
    assert float(own["particle_reynolds_number"]) == pytest.approx(
        1000 * Ubar * d**2 / D / viscosity, rel=1e-9
    )
    assert str(own["reason"].values) == ""
    assert not own["beyond"].any()


def test_a_square_has_its_own_flow_rate_and_spheres():
    """4/pi times the flow rate; at the same fraction as many more spheres, and the remark."""
    section = CrossSection(RECTANGLE)
    square = found(train(section=section), section=section)
    own, tube = square.isel(condition=0), found(train()).isel(condition=0)
    for name in ("flow_rate", "sphere_rate"):
        assert float(own[name]) == pytest.approx(4 / math.pi * float(tube[name]), rel=1e-12)
    assert float(own["pressure_drop"]) < float(tube["pressure_drop"])
    assert conditions.summary(square)[-1] == section.remark
    assert "inscribed" not in "\n".join(conditions.summary(found(train())))


def test_unknown_numbers_exceed_no_limit():
    """De = 0 has no velocity, spheres without a density do not settle."""
    own = found(train(deborah=0.0, memory=0.0), particle_density=None).isel(condition=0)
    for name in ("reynolds_number", "pressure_drop", "settling", "wall_shear_rate"):
        assert math.isnan(own[name])
    assert not own["beyond"].any()
    assert any(
        "not known without particle.density" in line
        for line in conditions.summary(found(train(), particle_density=None))
    )


@pytest.mark.parametrize("limit", conditions.LIMITS, ids=lambda limit: f"{limit.quantity}")
def test_every_limit_is_between_its_sides(limit):
    """What is at the limit, as 10 um in 100 um, is within."""
    off = 0.99 if limit.least else 1.01
    for factor, beyond in ((1.0, False), (1 + 1e-13, False), (off, True), (1 / off, False)):
        row = {name: math.nan for name in conditions.NAMES}
        assert conditions._is_beyond(row | {limit.quantity: factor * limit.value}, limit) == beyond


def test_conditions_beyond_limits_say_which_and_why():
    wrong = found(
        train(phi=0.02, memory=0.3),
        train(phi=0.004),
        train(phi=0.004, memory=0.2),
        particle_density=8000.0,
    )
    assert wrong.sizes["condition"] == 2  # the same condition of trains and of the map is one
    close, wide = (str(wrong["reason"].values[n]) for n in (1, 0))
    assert "mean spacing 1.33 d, below 1.5" in close and "mean spacing" not in wide
    assert "memory number 0.3, above 0.1: velocities are those of distances" in close
    assert "memory number 0.2" in wide  # the larger one counts
    assert "settling" in close and "sink away from the axis" in wide
    lines = conditions.summary(wrong)
    assert any("settling above 0.1 D" in line and "(all conditions)" in line for line in lines)
    assert any("mean spacing below" in line and "(De 5 at phi 2 %)" in line for line in lines)


def test_table_has_units_and_reasons():
    rows = conditions.table(found(train(phi=0.02)))
    (row,) = rows.to_dict("records")
    assert row["flow_rate_uL_min-1"] == pytest.approx(3.13, abs=0.01)
    assert row["volume_fraction"] == 0.02 and "mean spacing" in row["reason"]
    np.testing.assert_array_equal(rows.columns[:2], ["deborah", "volume_fraction"])
