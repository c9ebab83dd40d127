"""Flow without spheres at the Deborah numbers of a study: tube, ducts, and what is not unique."""

import numpy as np
import pytest

from viscotrain.fluid.channel import RECTANGLE, ROUND, CrossSection
from viscotrain.fluid.parameters import DimensionlessFluid, Mode
from viscotrain.fluid.pipe import pipe_flow
from viscotrain.fluid.shear import shear_viscosity
from viscotrain.studies.channel_flow import channel_flow, summary


def test_a_tube_has_the_bits_of_the_pipe(hyaluronic_acid):
    found = channel_flow(hyaluronic_acid, {0.0: 0.0, 5.0: 5.0}, ROUND)
    for De in (0.0, 5.0):
        own = found.sel(deborah=De)
        flow = pipe_flow(hyaluronic_acid, De)
        assert float(own["centreline_velocity"]) == flow.centreline_velocity
        assert float(own["pressure_gradient"]) == flow.pressure_gradient
        assert own["mean_wall_shear_rate"] == own["largest_wall_shear_rate"]
        # the stress at the wall balances the pressure, G D/4
        rate = own["largest_wall_shear_rate"].values
        stress = shear_viscosity(rate, hyaluronic_acid, De) * rate
        assert stress == pytest.approx(flow.pressure_gradient / 4, rel=1e-9)
        assert float(own["wall_viscosity"]) == pytest.approx(float(stress / rate))
    assert float(found["largest_wall_shear_rate"][0]) == pytest.approx(8.0)
    assert "channel" not in found.attrs


def test_a_duct_is_named_by_the_de_of_the_study_and_solved_at_that_of_the_longest_mode(
    hyaluronic_acid,
):
    square = CrossSection(RECTANGLE)
    found = channel_flow(hyaluronic_acid, {0.56: 1.0}, square).sel(deborah=0.56)
    other = channel_flow(hyaluronic_acid, {1.0: 1.0}, square).sel(deborah=1.0)
    assert float(found["pressure_gradient"]) == float(other["pressure_gradient"])
    assert float(found["deborah_longest_mode"]) == 1.0
    # the gradient lies between those of the inscribed tube and of the one around the square
    tube = pipe_flow(hyaluronic_acid, 1.0).pressure_gradient
    assert 0.5 * tube < float(found["pressure_gradient"]) < tube


@pytest.mark.parametrize("section", [ROUND, CrossSection(RECTANGLE)], ids=["tube", "square"])
def test_a_flow_that_is_not_unique_is_a_result_with_a_reason(section):
    fluid = DimensionlessFluid(0.01, (Mode(0.99, 1.0, 0.9),))
    found = channel_flow(fluid, {0.0: 0.0, 20.0: 20.0}, section)
    assert np.isfinite(found["pressure_gradient"].values).tolist() == [True, False]
    assert found["reason"].values[0] == "" and "monotonic" in found["reason"].values[1]
    assert "monotonic" in summary(found)
