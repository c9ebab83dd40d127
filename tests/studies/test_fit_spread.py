"""Spread of a fit: the fitted fluid is its draw 0, a spread is that of the draws, configs run."""

import numpy as np
import pytest
import yaml
from harness import FINISHED_TABLE, ROOT, study
from rheometer import NOISE, measured
from synthetic import superposed, triplet

from viscotrain.config import stages
from viscotrain.config.flow_rates import at_same_flow_rates
from viscotrain.config.models import FluidConfig
from viscotrain.config.reading import parse_study, with_fluid
from viscotrain.fluid import fit_report, measurements
from viscotrain.fluid.fluid_fit import fit
from viscotrain.fluid.parameters import Fluid
from viscotrain.fluid.units import physical_units
from viscotrain.studies import fit_spread
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import order

LENGTH = 800.0


class Table:
    """Repulsion that grows with De, in place of a table of the study."""

    deborah, smallest_distance = (0.0, 1.0, 5.0), 1.1
    dataset = VelocityTable.open(ROOT / FINISHED_TABLE).dataset  # has no holes

    def at(self, deborah):
        return triplet(law=lambda sp, sf: superposed(sp, sf, scale=deborah / 5))


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The fit, the settings of the stage, the order at the central fluid and the spread."""
    data = measurements.read(measured(tmp_path_factory.mktemp("data"), noise=NOISE))
    result = fit(data, modes=2)
    dataset = fit_report.dataset(result, {})
    fluid = FluidConfig.model_validate(fit_report.rounded(result.chosen.fluid))
    known = with_fluid(study("config"), fluid)
    own = stages.fit_spread(known).model_copy(update={"draws": 40})
    at_nodes = order.orders(Table(), 0.2, spacing=[2.0, 3.0, 5.0])
    fluids = fit_spread.fluids_of(dataset, own)
    names = list(result.chosen.names)
    return known, own, at_nodes, fluids, fit_spread.spread(fluids, names, at_nodes, own)


def test_the_fitted_fluid_is_draw_zero(found):
    known, _, at_nodes, fluids, result = found
    zero = result.sel(draw=0)
    assert zero["deborah_longest_mode"].values == pytest.approx([0, 1, 5], rel=1e-12)
    expected = 1 / at_nodes["ordering_length"]
    assert zero["ordering_rate"].values == pytest.approx(expected.values, rel=1e-9)
    assert expected.sel(deborah=5, spacing=5.0) > 0
    given = stages.units(known)
    units = physical_units(
        given.known_fluid, given.longest_modes(), channel_diameter=1e-4, particle_diameter=2e-5
    )
    assert result["flow_rate"].values == pytest.approx(units["flow_rate"].values, nan_ok=True)
    assert fluids[0] == known.fluid.physical()


def test_deborah_numbers_of_draws_scatter_as_their_relaxation_times(found):
    *_, fluids, result = found
    times = np.array([fluid.longest_relaxation_time for fluid in fluids])
    De = result["deborah_longest_mode"].sel(deborah=5).values
    assert De == pytest.approx(5 * times / times[0], rel=1e-12)
    low, high = (
        float(result[f"deborah_longest_mode_{end}"].sel(deborah=5)) for end in ("low", "high")
    )
    drawn = De[1:]
    assert np.mean((drawn >= low) & (drawn <= high)) == pytest.approx(0.95, abs=0.03)
    assert low < 5 < high


def test_faster_and_slower_draws_order_accordingly(found):
    """Repulsion is proportional to De here; from 1 to 5 a line in ln(1 + De) is taken for it."""
    _, _, at_nodes, _, result = found
    De = result["deborah_longest_mode"].sel(deborah=5)
    rate = result["ordering_rate"].sel(deborah=5, spacing=5.0)
    assert np.corrcoef(De, rate)[0, 1] > 0.99
    nodes = 1 / at_nodes["ordering_length"].sel(spacing=5.0, deborah=[1, 5]).values
    slope = (nodes[1] - nodes[0]) / np.log(6 / 2)
    expected = nodes[1] + slope * np.log((1 + De.values) / 6)
    assert rate.values == pytest.approx(expected, rel=1e-3)  # U, too, changes a little


def test_what_has_no_number_is_counted(found):
    _, own, at_nodes, fluids, result = found
    assert not result["without_flow"].any()
    assert not result["without_order"].any()
    assert np.isnan(result["pressure_drop_low"].sel(deborah=0))
    one = fit_spread.spread(fluids, [], at_nodes.isel(deborah=[2]), own)
    assert one["without_order"].values.tolist() == [40]
    assert any("40 draws left out: too far" in line for line in fit_spread.headline(one))


def test_words_give_ranges_of_every_flow(found):
    *_, result = found
    lines = list(fit_spread.headline(result))
    assert lines[0].startswith("95 % of 40 draws of the fit")
    assert [line.partition(",")[0] for line in lines if line.startswith("De = ")] == [
        "De = 1",
        "De = 5",
    ]
    assert "e+0" not in "".join(lines)
    for name in (*result.data_vars, *result.coords):
        assert result[name].attrs.get("long_name"), name


def test_configs_of_draws_are_studies_at_the_same_flow_rates(found):
    known, own, _, fluids, result = found
    texts = list(fit_spread.configs(fluids, own))
    assert len(texts) == 40
    for number in (1, 40):
        drawn = parse_study(yaml.safe_load(texts[number - 1]))
        assert drawn.study == f"demo_draw_{number:02d}"
        De = result["deborah_longest_mode"].sel(draw=number).values
        assert drawn.deborah.values == pytest.approx(De, rel=2e-4)  # fluids are rounded
        assert drawn.trains.deborah[0] == pytest.approx(De[2], rel=2e-4)
        mine = drawn.fluid.physical()
        assert mine.solvent_viscosity == pytest.approx(fluids[number].solvent_viscosity, rel=1e-3)
        assert drawn.channel == known.channel
    swept = own.model_copy(update={"config": own.config | {"study": "mine/beta0.2"}, "draws": 1})
    assert (
        yaml.safe_load(next(fit_spread.configs(fluids, swept)))["study"] == "mine_beta0_2_draw_01"
    )


def test_a_newtonian_fluid_has_draws_without_elasticity(tmp_path):
    data = measurements.read(measured(tmp_path, Fluid(0.3), noise=NOISE))
    result = fit(data, modes=0)
    dataset = fit_report.dataset(result, {})
    fluid = FluidConfig.model_validate(fit_report.rounded(result.chosen.fluid))
    demo = study("config")
    newtonian = at_same_flow_rates(demo.model_dump(), "newtonian", fluid, 0.0)
    own = stages.fit_spread(demo).model_copy(
        update={"fluid": fluid.physical(), "deborah": (0.0,), "draws": 3, "config": newtonian}
    )
    fluids = fit_spread.fluids_of(dataset, own)
    assert len({drawn.solvent_viscosity for drawn in fluids}) == 4
    at_rest = order.orders(Table(), 0.2, spacing=[3.0]).isel(deborah=[0])
    spread = fit_spread.spread(fluids, ["solvent_viscosity"], at_rest, own)
    assert len(list(fit_spread.headline(spread))) == 3  # no De above 0
    texts = list(fit_spread.configs(fluids, own))
    assert set(yaml.safe_load(texts[0])["deborah"]["values"]) == {0.0}
