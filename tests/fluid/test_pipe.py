"""Undisturbed flow: viscometric functions and their integrals, against other ways to them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from viscotrain.errors import FluidError
from viscotrain.fluid.parameters import DimensionlessFluid, Mode
from viscotrain.fluid.pipe import pipe_flow
from viscotrain.fluid.shear import shear_viscosity

REFERENCE = Path(__file__).parents[1] / "reference"


def test_newtonian_flow_is_poiseuille(hyaluronic_acid):
    flow = pipe_flow(hyaluronic_acid, 0.0)
    assert flow.centreline_velocity == pytest.approx(2.0, abs=1e-12)
    assert flow.pressure_gradient == pytest.approx(32.0, abs=1e-10)


@pytest.mark.parametrize(
    "row", list(pd.read_csv(REFERENCE / "giesekus_pipe.csv", comment="#").itertuples(index=False))
)
def test_two_mode_fluid_agrees_with_the_reference(row, hyaluronic_acid):
    """The reference prints six decimals of the velocity and four of the gradient at least."""
    flow = pipe_flow(hyaluronic_acid, row.deborah)
    assert flow.centreline_velocity == pytest.approx(row.centreline, abs=1e-6)
    assert flow.pressure_gradient == pytest.approx(row.pressure_gradient, rel=1e-5)


@pytest.mark.parametrize("alpha", [0.0, 0.1, 0.5, 0.9])
@pytest.mark.parametrize("shear_rate", [0.01, 1.0, 30.0])
def test_viscosity_is_the_steady_state_of_start_up_in_tensor_form(alpha, shear_rate):
    """The Giesekus equation as its authors write it, with stresses: another form of the law."""
    fluid, De, eta = DimensionlessFluid(0.2, (Mode(0.8, 1.0, alpha),)), 2.0, 0.8
    L = np.array([[0, shear_rate, 0], [0, 0, 0], [0, 0, 0]])

    def rate(_, flat):
        tau = flat.reshape(3, 3)
        quadratic = alpha * De / eta * tau @ tau
        return (L @ tau + tau @ L.T + (eta * (L + L.T) - tau - quadratic) / De).ravel()

    settled = solve_ivp(rate, (0, 60 * De), np.zeros(9), "LSODA", rtol=1e-10, atol=1e-12)
    expected = 0.2 + settled.y[1, -1] / shear_rate
    assert shear_viscosity(np.array(shear_rate), fluid, De) == pytest.approx(expected, rel=1e-6)


def test_flow_rate_agrees_with_a_profile_found_point_by_point(hyaluronic_acid):
    """Invert the flow curve at every radius, integrate the shear rate, then the velocity."""
    De = 5.0
    flow = pipe_flow(hyaluronic_acid, De)
    r, weights = np.polynomial.legendre.leggauss(60)
    r, weights = (r + 1) / 4, weights / 4

    def shear_rate(radius):
        wanted = flow.pressure_gradient * radius / 2
        return brentq(
            lambda rate: (
                float(shear_viscosity(np.array(rate), hyaluronic_acid, De)) * rate - wanted
            ),
            0.0,
            1e3,
            xtol=1e-13,
        )

    rates = np.array([shear_rate(radius) for radius in r])
    assert weights @ rates == pytest.approx(flow.centreline_velocity, abs=1e-7)
    # mean of u over the cross-section, integrated by parts: int gamma r^2 dr / R^2
    assert weights @ (rates * r**2) * 4 == pytest.approx(1.0, abs=1e-7)


def test_a_decreasing_flow_curve_is_refused():
    with pytest.raises(FluidError, match="monotonic"):
        pipe_flow(DimensionlessFluid(0.01, (Mode(0.99, 1.0, 0.9),)), 20.0)
