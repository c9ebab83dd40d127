"""Settings of stages: dimensionless, complete, equal for equal flows, the same again in a job."""

import math
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from viscotrain.config import settings, stages
from viscotrain.config.reading import load_study, parse_study
from viscotrain.errors import FluidError
from viscotrain.fluid.parameters import Fluid
from viscotrain.fluid.units import physical_units

CONFIG = Path(__file__).parents[2] / "config"
DEMO = load_study(CONFIG / "config.yaml")
OF_FLOWS = {
    "dns": lambda study: stages.dns(study, 1.1, 1.5),
    "field": stages.field,
    "transient": lambda study: stages.transient(study, 5.0),
    "start_up": stages.start_up,
    "closure_train": lambda study: stages.closure_train(study, 5.0),
    "closure_gap": stages.closure_gap,
    "convergence": stages.convergence,
    "table": stages.table,
}
OF_TRAINS = {
    "trains": stages.trains,
    "design_points": stages.design_points,
    "design_map": stages.design_map,
    "film": stages.film,
    "channel_flow": stages.channel_flow,
    "movies": stages.movies,
    "figures": stages.figures,
    "schematic": stages.schematic,
}
DIMENSIONLESS = OF_FLOWS | OF_TRAINS
TEXTS = {name: repr(make(DEMO).stated()) for name, make in DIMENSIONLESS.items()}
PHYSICAL = {
    "units": stages.units,
    "operating_conditions": stages.operating_conditions,
    "encapsulation": stages.encapsulation,
    "study_figures": lambda study: stages.figures(study, "rheology"),
    "study_config": stages.study_config,
    "fluid_fit": stages.fluid_fit,
    "fit_spread": stages.fit_spread,
}


def changed(**sections):
    """The demo with other values in some sections, by section."""
    data = DEMO.model_dump()
    for section, values in sections.items():
        data[section] = data[section] | values
    return parse_study(data)


def scaled(length: float, time: float, viscosity: float):
    """The demo with all lengths, relaxation times and viscosities times a factor each."""
    modes = [
        mode.model_dump()
        | {
            "viscosity": mode.viscosity * viscosity,
            "relaxation_time": mode.relaxation_time * time,
        }
        for mode in DEMO.fluid.modes
    ]
    return changed(
        channel={"diameter": DEMO.channel.diameter * length},
        particle={"diameter": DEMO.particle.diameter * length},
        fluid={"solvent_viscosity": DEMO.fluid.solvent_viscosity * viscosity, "modes": modes},
    )


factors = st.floats(min_value=0.01, max_value=1e3)  # of a channel of 100 um, down to 1 um


@given(factors, factors, factors)
def test_scaled_studies_have_the_same_settings(length, time, viscosity):
    """Texts are what Snakemake compares."""
    assert_same_settings(scaled(length, time, viscosity))


def test_a_scaled_study_has_the_same_settings_though_its_quotients_round_differently():
    twin = scaled(1.1, 1.7, 1.3)
    assert twin.confinement != DEMO.confinement
    assert twin.dimensionless_fluid != DEMO.dimensionless_fluid
    assert_same_settings(twin)
    for make in DIMENSIONLESS.values():  # what datasets hold
        assert make(twin).stated().text() == make(DEMO).stated().text()


def assert_same_settings(study):
    for name, make in DIMENSIONLESS.items():
        assert repr(make(study).stated()) == TEXTS[name], name


@pytest.mark.parametrize("name", DIMENSIONLESS)
def test_what_is_computed_holds_nothing_of_a_device(name):
    text = DIMENSIONLESS[name](DEMO).stated().text().replace("diameter_variation", "")
    for word in ("diameter", "solvent_viscosity", "method", "save_fields"):
        assert word not in text


@pytest.mark.parametrize("name", DIMENSIONLESS | PHYSICAL)
def test_a_job_makes_the_same_settings_of_what_it_is_given(name):
    own = (DIMENSIONLESS | PHYSICAL)[name](DEMO)
    given = own.stated()
    assert type(own).model_validate(dict(given)) == own  # to the last bit
    assert isinstance(yaml.safe_load(given.text()), dict)


def test_all_digits_are_kept_and_twelve_compared():
    third = settings.Stated({"a": {"b": (1 / 3, math.inf)}, "c": None})
    assert repr(third) == "{'a': {'b': [0.333333333333, inf]}, 'c': None}"
    assert third["a"]["b"][0] == 1 / 3
    assert repr(settings.Stated({"a": 0.30000000000000004})) == repr(settings.Stated({"a": 0.3}))
    assert repr(settings.Stated({"a": 0.3000001})) != repr(settings.Stated({"a": 0.3}))


@pytest.mark.parametrize(
    "section",
    [
        {"dns": {"tolerance": 1e-8}},
        {"dns": {"margin": 2.5}},
        {"particle": {"diameter": 2.1e-5}},
        {"fluid": {"solvent_viscosity": 0.06}},
        {"deborah": {"definition": "mean_relaxation_time"}},
    ],
)
def test_what_decides_a_flow_is_in_its_settings(section):
    study = changed(**section)
    for name, make in OF_FLOWS.items():
        if name != "table":
            assert repr(make(study).stated()) != repr(make(DEMO).stated()), name


@pytest.mark.parametrize(
    "section",
    [
        {"dns": {"save_fields": True}},
        {"trains": {"repeats": 3}},
        {"movies": {"frames": 7}},
        {"channel": {"length": 900.0}},
        {"channel": {"diameter": 2e-4}, "particle": {"diameter": 4e-5}},
        {"fluid": {"density": 900.0}, "particle": {"density": 1050.0}},
        {"channel": {"shape": "square", "diameter": None, "side": 1e-4}},
        {"channel": {"shape": "rectangle", "diameter": None, "width": 3e-4, "height": 1e-4}},
    ],
)
def test_what_does_not_is_not(section):
    study = changed(**section)
    for name, make in OF_FLOWS.items():
        assert repr(make(study).stated()) == repr(make(DEMO).stated()), name


def test_a_droplet_wants_a_bead_unless_a_rate_is_given():
    assert stages.encapsulation(DEMO).bead_rate is None
    one = stages.encapsulation(changed(encapsulation={"droplet_frequency": 20.0}))
    assert (one.droplet_frequency, one.bead_rate) == (20.0, 20.0)
    few = changed(encapsulation={"droplet_frequency": 20.0, "bead_rate": 5.0})
    assert stages.encapsulation(few).bead_rate == 5.0


def test_de_of_flow_and_closure_do_not_collide():
    other = changed(deborah={"definition": "mean_relaxation_time"})
    given = stages.closure_gap(other).stated()
    assert given["flow"]["longest_modes"] != stages.closure_gap(DEMO).flow.longest_modes
    assert given["deborah"] == DEMO.closure_deborahs


@pytest.mark.parametrize("definition", ["longest_mode", "mean_relaxation_time"])
def test_a_fitted_fluid_completes_the_settings(definition):
    deborah = DEMO.deborah.model_dump() | {"definition": definition}
    written = parse_study(DEMO.model_dump() | {"deborah": deborah})
    waiting = parse_study(written.model_dump() | {"fluid": {"data": ["a.csv"]}})
    for name, make in (DIMENSIONLESS | PHYSICAL).items():
        # Which point is drawn depends on De of the longest mode, as far as it is known; a spread
        # has the config itself.
        if name not in ("fluid_fit", "field", "fit_spread"):
            given = type(make(written)).model_validate(dict(make(waiting).stated()))
            assert given.with_fluid(written.fluid.physical()) == make(written), name


def test_a_fitted_fluid_without_modes_has_no_deborah_number():
    with pytest.raises(FluidError, match="has no modes, found De = 5; allowed: 0"):
        stages.flow(DEMO).with_fluid(Fluid(1.0))


@pytest.mark.parametrize("definition", ["longest_mode", "mean_relaxation_time"])
def test_both_deborah_numbers_of_a_flow_are_those_of_the_units(definition):
    study = changed(deborah={"definition": definition})
    own, given = stages.flow(study), stages.units(study)
    units = physical_units(
        given.known_fluid, given.longest_modes(), channel_diameter=1e-4, particle_diameter=2e-5
    )
    for De in study.deborah.values:
        at = units.sel(deborah=De)
        assert own.deborah_longest_mode(De) == float(at["deborah_longest_mode"])
        assert own.deborah_longest_mode(De) == study.deborah_longest_mode(De)
        assert own.deborah_mean_relaxation_time(De) == float(at["deborah_mean_relaxation_time"])
