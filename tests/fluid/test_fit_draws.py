"""Draws of a fit: their statistics are those of the fit; flows of each by exact limits."""

import math

import numpy as np
import pytest
from rheometer import HYALURONIC_ACID, NOISE, OLDROYD_B, measured

from viscotrain.errors import FluidError
from viscotrain.fluid import fit_report, measurements
from viscotrain.fluid.fit_draws import drawn_fluids, flow_in_channel
from viscotrain.fluid.fit_parameters import Known, logarithmic, values_of
from viscotrain.fluid.fluid_fit import fit
from viscotrain.fluid.parameters import DimensionlessFluid, Fluid, Mode
from viscotrain.fluid.pipe import pipe_flow
from viscotrain.fluid.units import physical_units


def fitted(folder, fluid=HYALURONIC_ACID, known=None):
    data = measurements.read(measured(folder, fluid, noise=NOISE))
    result = fit(data, modes=len(fluid.modes), known=known)
    return result.chosen, fit_report.dataset(result, {})


def vectors(fluids, names):
    values = np.array([values_of(fluid, names) for fluid in fluids])
    return np.where(logarithmic(names), np.log(np.maximum(values, 1e-300)), values)


def test_draws_have_mean_and_covariance_of_the_fit(tmp_path):
    """Of 4000 draws: the mean within 0.06 errors, errors within 5 %, correlations within 0.06."""
    chosen, dataset = fitted(tmp_path)
    drawn = vectors(drawn_fluids(dataset, chosen.fluid, 4000), chosen.names)
    best = vectors([chosen.fluid], chosen.names)[0]
    assert np.abs((drawn.mean(axis=0) - best) / chosen.uncertainties).max() < 0.06
    assert drawn.std(axis=0) == pytest.approx(chosen.uncertainties, rel=0.05)
    assert np.abs(np.corrcoef(drawn.T) - chosen.correlation).max() < 0.06


def test_what_was_known_is_the_same_in_all_draws(tmp_path):
    known = Known(0.051, (0.0752,), (None, 0.49))
    chosen, dataset = fitted(tmp_path, known=known)
    for fluid in drawn_fluids(dataset, chosen.fluid, 5):
        assert fluid.solvent_viscosity == 0.051
        assert fluid.modes[0].relaxation_time == 0.0752
        assert fluid.modes[1].mobility == 0.49
        assert fluid.modes[0].viscosity != chosen.fluid.modes[0].viscosity


def test_fewer_draws_are_the_first_ones_of_more(tmp_path):
    chosen, dataset = fitted(tmp_path)
    assert drawn_fluids(dataset, chosen.fluid, 9)[:4] == drawn_fluids(dataset, chosen.fluid, 4)


def test_mobilities_of_draws_stay_in_their_range(tmp_path):
    """An Oldroyd-B fluid is at the limit: a normal distribution cut there, not piled up."""
    chosen, dataset = fitted(tmp_path, OLDROYD_B)
    alphas = [fluid.modes[0].mobility for fluid in drawn_fluids(dataset, chosen.fluid, 400)]
    assert min(alphas) > 0
    assert len(set(alphas)) == 400
    error, best = chosen.uncertainties[-1], chosen.values[-1]
    if best < 0.01 * error:  # half a normal distribution
        assert np.mean(alphas) == pytest.approx(error * math.sqrt(2 / math.pi), rel=0.15)


def test_draws_that_all_miss_the_range_are_refused(tmp_path):
    chosen, dataset = fitted(tmp_path)
    dataset["lowest"][:] = 1e9
    with pytest.raises(FluidError, match="of 1000 draws of the fit none is in the range"):
        drawn_fluids(dataset, chosen.fluid, 1)


def test_a_newtonian_like_flow_is_poiseuille():
    """Oldroyd-B does not thin: U_max = 2 Ubar, dp = 32 eta_0 Ubar L/D^2, gamma_w = 8 Ubar/D."""
    found = flow_in_channel(Fluid(0.3, (Mode(0.2, 0.05),)), 0.01, 1e-4, 800.0)
    assert found["centreline_velocity"] == pytest.approx(2, rel=1e-8)
    assert found["pressure_drop"] == pytest.approx(32 * 0.5 * 0.01 * 800 / 1e-4 / 1e5, rel=1e-8)
    assert found["wall_shear_rate"] == pytest.approx(800, rel=1e-8)
    assert found["weissenberg_number"] == pytest.approx(40, rel=1e-8)
    assert found["deborah_longest_mode"] == pytest.approx(0.05 * 0.01 / 1e-4)
    assert found["deborah_mean_relaxation_time"] == pytest.approx(0.05 * 0.01 / 1e-4)


def test_flow_is_that_of_the_units_of_a_study():
    fluid = HYALURONIC_ACID
    units = physical_units(fluid, {5.0: 5.0}, channel_diameter=1e-4, particle_diameter=2e-5)
    one = units.sel(deborah=5.0)
    found = flow_in_channel(fluid, float(one["mean_velocity"]), 1e-4, 800.0)
    scaled = DimensionlessFluid.from_physical(fluid.solvent_viscosity, fluid.modes)
    flow = pipe_flow(scaled, 5.0)
    assert found["deborah_longest_mode"] == pytest.approx(5.0)
    mean = float(one["deborah_mean_relaxation_time"])
    assert found["deborah_mean_relaxation_time"] == pytest.approx(mean)
    drop = flow.pressure_gradient * float(one["stress"]) * 800 * 1e-5
    assert found["pressure_drop"] == pytest.approx(drop)


def test_a_flow_that_is_not_unique_or_slow_has_no_numbers():
    thinning = Fluid(0.01, (Mode(1.0, 0.1, 0.9),))
    found = flow_in_channel(thinning, 0.02, 1e-4, 800.0)
    assert found["deborah_longest_mode"] == pytest.approx(20)
    assert math.isnan(found["pressure_drop"])
    slow = flow_in_channel(HYALURONIC_ACID, 0.0, 1e-4, 800.0)
    assert slow["deborah_longest_mode"] == 0
    assert math.isnan(slow["centreline_velocity"])
