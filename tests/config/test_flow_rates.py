"""Configs with another fluid: the same flow rates, and a study as any other."""

import pytest
from harness import study

from viscotrain.config import stages
from viscotrain.config.flow_rates import at_same_flow_rates
from viscotrain.config.models import FluidConfig, ModeConfig
from viscotrain.config.reading import parse_study
from viscotrain.fluid.units import physical_units

OTHER = FluidConfig(
    solvent_viscosity=0.04,
    modes=(
        ModeConfig(viscosity=0.3, relaxation_time=0.08, mobility=0.2),
        ModeConfig(viscosity=0.2, relaxation_time=0.009, mobility=0.4),
    ),
)


def flow_rates(own):
    given = stages.units(own)
    units = physical_units(
        given.known_fluid, given.longest_modes(), channel_diameter=1e-4, particle_diameter=2e-5
    )
    return units["flow_rate"].values[1:]  # De = 0 has none


@pytest.mark.parametrize("name", ["config", "paper"])
@pytest.mark.parametrize("definition", ["longest_mode", "mean_relaxation_time"])
def test_every_deborah_number_is_scaled_and_flow_rates_stay(name, definition):
    shipped = study(name)
    deborah = shipped.deborah.model_dump() | {"definition": definition}
    own = parse_study(shipped.model_dump() | {"deborah": deborah})
    times = [
        fluid.longest_relaxation_time
        if definition == "longest_mode"
        else sum(mode.viscosity * mode.relaxation_time for mode in fluid.modes)
        / sum(mode.viscosity for mode in fluid.modes)
        for fluid in (own.fluid.physical(), OTHER.physical())
    ]
    ratio = times[1] / times[0]
    changed = parse_study(at_same_flow_rates(own.model_dump(), "other", OTHER, ratio))
    assert changed.study == "other"
    assert changed.fluid == OTHER
    assert flow_rates(changed) == pytest.approx(flow_rates(own), rel=1e-5)
    assert changed.trains.deborah == pytest.approx([ratio * De for De in own.trains.deborah], 1e-5)
    assert set(changed.trains.deborah) <= set(changed.deborah.values)
    same = changed.model_dump() | {"study": own.study, "fluid": own.fluid.model_dump()}
    back = at_same_flow_rates(same, own.study, own.fluid, 1 / ratio)
    assert parse_study(back).deborah.values == pytest.approx(own.deborah.values, rel=1e-5)
    assert parse_study(back).dns == own.dns  # deborah_step is a ratio, no Deborah number
    assert parse_study(back).channel == own.channel
