"""Shear rate at the wall of a tube, against exact flows and the identity of Rabinowitsch."""

import numpy as np
import pytest

from viscotrain.errors import FluidError
from viscotrain.fluid.parameters import NEWTONIAN, DimensionlessFluid, Mode
from viscotrain.fluid.pipe import pipe_flow
from viscotrain.fluid.wall import wall_shear_rate


def test_newtonian_flow_has_eight():
    assert wall_shear_rate(NEWTONIAN, 0.0) == pytest.approx(8.0, rel=1e-9)


def test_oldroyd_b_has_eight_at_any_rate():
    fluid = DimensionlessFluid(0.5, (Mode(0.5, 1.0, 0.0),))
    assert wall_shear_rate(fluid, 7.0) == pytest.approx(8.0, rel=1e-9)


@pytest.mark.parametrize("deborah", [0.5, 5.0, 62.0])
def test_rate_follows_from_pressures_at_other_flow_rates(deborah, hyaluronic_acid):
    """Rabinowitsch: gamma_w = (8 Ubar/D) (3 + d ln Ubar/d ln T_w)/4, from pressures alone.

    T_w in units that do not change with De: eta_0/lambda_1, in which Ubar/D is De.
    """
    step = 1e-3
    De = deborah * np.exp([-step, step])
    stress = [De_ * pipe_flow(hyaluronic_acid, De_).pressure_gradient for De_ in De]
    slope = 2 * step / np.log(stress[1] / stress[0])
    found = wall_shear_rate(hyaluronic_acid, deborah)
    assert found == pytest.approx(8 * (3 + slope) / 4, rel=1e-5)
    assert found == wall_shear_rate(hyaluronic_acid, deborah, pipe_flow(hyaluronic_acid, deborah))


def test_a_flow_that_is_not_unique_is_refused():
    with pytest.raises(FluidError, match="not a monotonic function"):
        wall_shear_rate(DimensionlessFluid(0.01, (Mode(0.99, 1.0, 0.9),)), 20.0)
