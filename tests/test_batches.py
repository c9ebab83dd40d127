"""Residual and linearisation for all elements at once against those of ngsolve."""

import ngsolve
import numpy as np
import pytest

from viscotrain.axisymmetry import volume_integral
from viscotrain.flow import Flow, Storage
from viscotrain.meshes import Geometry, MeshOptions, make_mesh


@pytest.fixture(params=[2, 3, 4])
def flow(request, hyaluronic_acid):
    """A triplet whose state is far from any solution."""
    geometry = Geometry.triplet(0.2, 1.5, 2.5, 2.0)
    sizes = MeshOptions(sphere_elements=6, axis_size=0.2, wall_size=0.3, gap_elements=1)
    flow = Flow(geometry, make_mesh(geometry, sizes, 4), hyaluronic_acid, request.param)
    flow.deborah.Set(3.0)
    values = flow.state.vec.FV().NumPy()
    values[:] = np.random.default_rng(2).uniform(-0.5, 0.5, values.size)
    return flow


def by_ngsolve(flow, integrands):
    form = flow._boundary_form()
    for integrand in integrands:
        form += volume_integral(integrand)
    return form


def assert_same(form, expected, state):
    residual, wanted = state.CreateVector(), state.CreateVector()
    form.Apply(state, residual)
    expected.Apply(state, wanted)
    assert_close(residual.FV().NumPy(), wanted.FV().NumPy())
    form.AssembleLinearization(state)
    expected.AssembleLinearization(state)
    for mine, other in zip(form.mat.CSR()[1:], expected.mat.CSR()[1:], strict=True):
        assert np.array_equal(np.asarray(mine), np.asarray(other))
    assert_close(np.asarray(form.mat.CSR()[0]), np.asarray(expected.mat.CSR()[0]))


def assert_close(found, wanted):
    assert np.abs(found - wanted).max() < 1e-12 * np.abs(wanted).max()


def test_quasi_steady_form(flow):
    integrands = flow._momentum(flow.fluid.solvent) + flow._modes(flow.mesh_velocity, None)
    assert_same(flow.viscoelastic, by_ngsolve(flow, integrands), flow.state.vec)


def test_again_at_another_state_and_deborah_number(flow):
    state = flow.state.vec.CreateVector()
    state.FV().NumPy()[:] = 0.3 * flow.state.vec.FV().NumPy()[::-1]
    flow.deborah.Set(0.7)
    integrands = flow._momentum(flow.fluid.solvent) + flow._modes(flow.mesh_velocity, None)
    assert_same(flow.viscoelastic, by_ngsolve(flow, integrands), state)


def test_transient_form_on_a_deformed_mesh(flow):
    storage = Storage(ngsolve.Parameter(7.0), ngsolve.GridFunction(flow.space))
    storage.history.vec.FV().NumPy()[:] = 0.2
    form = flow.transient_form(flow.mesh_velocity, storage)
    integrands = flow._momentum(flow.fluid.solvent) + flow._modes(flow.mesh_velocity, storage)
    expected = by_ngsolve(flow, integrands)
    assert_same(form, expected, flow.state.vec)
    deformation = ngsolve.GridFunction(ngsolve.VectorH1(flow.mesh, order=1))
    deformation.Set(ngsolve.CF((0.02 * ngsolve.sin(3 * ngsolve.x), 0)))
    flow.mesh.SetDeformation(deformation)
    try:
        assert_same(form, expected, flow.state.vec)
    finally:
        flow.mesh.UnsetDeformation()
