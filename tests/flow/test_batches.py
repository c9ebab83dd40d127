"""Residual and linearisation for all elements at once against those of ngsolve."""

import ngsolve
import numpy as np
import pytest
import scipy.sparse

from viscotrain.flow.axisymmetry import volume_integral
from viscotrain.flow.discretisation import Flow, Storage, momentum
from viscotrain.flow.meshes import Geometry, MeshOptions, make_mesh


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


def by_ngsolve(flow, storage=None):
    form = flow._boundary_form()
    trial, test = (flow.grouped(functions) for functions in flow.space.TnT())
    stored = storage and (storage.leading, flow.grouped(storage.history.components).psi)
    w = flow.mesh_velocity(trial.speeds)
    for integrand in (
        *momentum(flow.fluid.solvent, trial, test),
        *flow.modes(trial, test, flow.deborah, w, stored),
    ):
        form += volume_integral(integrand)
    return form


def assert_same(form, expected, state):
    residual, wanted = state.CreateVector(), state.CreateVector()
    form.Apply(state, residual)
    expected.Apply(state, wanted)
    assert_close(residual.FV().NumPy(), wanted.FV().NumPy())
    form.AssembleLinearization(state)
    expected.AssembleLinearization(state)
    difference = form.matrix() - scipy.sparse.csr_matrix(
        tuple(np.asarray(part) for part in expected.mat.CSR())
    )
    assert_close(difference.data, 0 * difference.data, np.asarray(expected.mat.CSR()[0]))


def assert_close(found, wanted, scale=None):
    assert np.abs(found - wanted).max() < 1e-12 * np.abs(wanted if scale is None else scale).max()


def test_quasi_steady_form(flow):
    assert_same(flow.viscoelastic, by_ngsolve(flow), flow.state.vec)


def test_again_at_another_state_and_deborah_number(flow):
    state = flow.state.vec.CreateVector()
    state.FV().NumPy()[:] = 0.3 * flow.state.vec.FV().NumPy()[::-1]
    flow.deborah.Set(0.7)
    assert_same(flow.viscoelastic, by_ngsolve(flow), state)


@pytest.mark.slow
def test_transient_form_on_a_deformed_mesh(flow):
    storage = Storage(ngsolve.Parameter(7.0), ngsolve.GridFunction(flow.space))
    storage.history.vec.FV().NumPy()[:] = 0.2
    form = flow.transient_form(flow.mesh_velocity, storage)
    expected = by_ngsolve(flow, storage)
    assert_same(form, expected, flow.state.vec)
    deformation = ngsolve.GridFunction(ngsolve.VectorH1(flow.mesh, order=1))
    deformation.Set(ngsolve.CF((0.02 * ngsolve.sin(3 * ngsolve.x), 0)))
    flow.mesh.SetDeformation(deformation)
    try:
        assert_same(form, expected, flow.state.vec)
    finally:
        flow.mesh.UnsetDeformation()
