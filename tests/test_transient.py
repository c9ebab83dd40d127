"""The transient simulation against the exact start, itself in smaller steps, and other frames."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from viscotrain.flow import Flow
from viscotrain.fluid import DimensionlessFluid, Mode
from viscotrain.meshes import Geometry, MeshOptions, make_mesh
from viscotrain.transient import TimeOptions, Transient

REFERENCE = Path(__file__).parent / "reference"
COARSE = MeshOptions(wall_size=0.3, axis_size=0.2, sphere_elements=6, gap_elements=3)
FINE = MeshOptions(wall_size=0.2, axis_size=0.1, sphere_elements=10, gap_elements=3)
ONE_MODE = DimensionlessFluid(0.3, (Mode(0.7, 1.0, 0.25),))


def coarse_flow(fluid=ONE_MODE, reference="middle") -> Flow:
    geometry = replace(Geometry.triplet(0.3, 1.5, 2.0, margin=1.5), reference=reference)
    return Flow(geometry, make_mesh(geometry, COARSE, 3), fluid, 3)


def last(simulation: Transient, until: float):
    return list(simulation.run(until))[-1]


@pytest.mark.parametrize("sp, sf", [(1.25, 1.25), (1.5, 1.5)])
def test_starts_with_the_newtonian_velocities(sp, sf, hyaluronic_acid):
    """Free of stress, only the solvent resists."""
    exact = pd.read_csv(REFERENCE / "newtonian_triplet.csv", comment="#")
    exact = exact[(exact.confinement == 0.2) & (exact.sp == sp) & (exact.sf == sf)].iloc[0]
    geometry = Geometry.triplet(0.2, sp, sf, margin=2.0)
    flow = Flow(geometry, make_mesh(geometry, FINE, 6), hyaluronic_acid, 4)
    start = next(Transient(flow, 1.0, TimeOptions()).run(1.0))
    assert start.time == 0
    assert pytest.approx([exact.U1, exact.U2, exact.U3], abs=1e-6) == start.velocities


def test_second_order_in_time():
    """Halving the step divides the error of velocities and positions by four."""
    steps = [0.04, 0.02, 0.01, 0.005]
    flows = [
        last(Transient(coarse_flow(), 0.5, TimeOptions(fixed_step=dt, tolerance=1e-10)), 0.4)
        for dt in steps
    ]
    for quantity, allowed in (("velocities", 1e-5), ("positions", 1e-5)):
        values = np.array([np.diff(getattr(end, quantity)) for end in flows])
        changes = np.abs(np.diff(values, axis=0)).max(axis=1)
        orders = np.log2(changes[:-1] / changes[1:])
        assert 1.7 < orders[-1] < 2.4, (quantity, orders)
        assert changes[-1] / 3 < allowed


def test_controlled_steps_reach_the_error_they_promise():
    exact = last(Transient(coarse_flow(), 0.5, TimeOptions(fixed_step=0.0025)), 0.6)
    simulation = Transient(coarse_flow(), 0.5, TimeOptions())
    instants = list(simulation.run(0.6))
    assert instants[-1].time == pytest.approx(0.6, abs=1e-12)
    assert len(instants) < 60
    relative = np.diff(instants[-1].velocities) - np.diff(exact.velocities)
    assert np.abs(relative).max() < 5 * TimeOptions.relative_tolerance
    gaps = np.diff(instants[-1].positions) - np.diff(exact.positions)
    assert np.abs(gaps).max() < 1e-4 * 0.3


def test_gaps_do_not_depend_on_the_frame():
    ends = [
        last(Transient(coarse_flow(reference=name), 0.5, TimeOptions(fixed_step=0.02)), 0.3)
        for name in ("trailing", "middle", "leading")
    ]
    for end in ends[1:]:
        assert np.diff(end.positions) == pytest.approx(np.diff(ends[0].positions), abs=1e-4 * 0.3)
        assert end.velocities == pytest.approx(ends[0].velocities, abs=2e-5)


def test_spheres_move_by_their_velocities():
    """The positions are those in the frame of the wall."""
    start, *_, end = Transient(coarse_flow(), 0.5, TimeOptions(fixed_step=0.01)).run(0.05)
    moved = end.positions - start.positions
    assert moved == pytest.approx(0.025 * (start.velocities + end.velocities), rel=1e-3)


def test_continues_from_a_checkpoint(tmp_path):
    """Stopped and continued, the simulation is the same, up to the tolerance of the iteration."""
    options = TimeOptions(fixed_step=0.02, tolerance=1e-11)
    whole = last(Transient(coarse_flow(), 0.5, options), 0.12)
    stopped = Transient(coarse_flow(), 0.5, options)
    last(stopped, 0.06)
    stopped.save(tmp_path / "checkpoint.npz")
    continued = Transient(coarse_flow(), 0.5, options)
    continued.load(tmp_path / "checkpoint.npz")
    end = last(continued, 0.12)
    assert end.velocities == pytest.approx(whole.velocities, abs=1e-9)
    assert end.positions == pytest.approx(whole.positions, abs=1e-9)


def test_uniform_stress_stays_uniform_on_a_moving_mesh():
    """Without gradients nothing is carried: psi follows the law of one point, w whatever it is."""
    flow = coarse_flow()
    simulation = Transient(flow, 0.5, TimeOptions())
    next(simulation.run(1.0))
    lam, alpha, dt, m = 0.5, 0.25, 0.1, 0.4
    rate = -(alpha * math.exp(m) - (1 - alpha) * math.exp(-m) + 1 - 2 * alpha) / lam
    psi = flow.fields().psi[0]
    flow.state.vec[:] = 0.0
    for component, value in ((psi.m, m), (psi.theta, m)):
        component.Set(value)
    new = flow.state.vec.FV().NumPy().copy()
    for component in (psi.m, psi.theta):
        component.Set(m - dt * rate)
    simulation._history.unknowns = [flow.state.vec.FV().NumPy().copy()]
    flow.state.vec.FV().NumPy()[:] = new
    for speed in flow.fields().speeds:  # the mesh moves, the fluid is at rest
        speed.vec[0] = 0.3
    leading, (old,) = simulation._history.difference(dt)
    simulation._storage.leading.Set(leading)
    simulation._storage.history.vec.FV().NumPy()[:] = old * simulation._history.unknowns[0]
    simulation._displace(np.add(flow.geometry.positions, [0.05, 0.0, -0.1]))
    residual = flow.state.vec.CreateVector()
    simulation._newton._form.Apply(flow.state.vec, residual)
    first = flow.space.Range(4 + len(flow.geometry.moving_spheres)).start
    assert np.abs(residual.FV().NumPy()[first:]).max() < 1e-14
