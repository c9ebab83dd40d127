"""The transient simulation against the exact start, itself in smaller steps, and other frames."""

import math
from dataclasses import replace

import ngsolve
import numpy as np
import pandas as pd
import pytest
from harness import REFERENCE
from scipy.integrate import solve_ivp

from viscotrain.flow.discretisation import Flow
from viscotrain.flow.geometry import Geometry
from viscotrain.flow.meshes import MeshOptions, make_mesh
from viscotrain.flow.moving_mesh import MovingMesh, linear, smooth_step, transfer_stress
from viscotrain.flow.quasi_steady import SolverOptions, solve
from viscotrain.flow.time_stepping import TimeOptions, Transient
from viscotrain.fluid.parameters import DimensionlessFluid, Mode

COARSE = MeshOptions(wall_size=0.3, axis_size=0.2, sphere_elements=6, gap_elements=3)
FINE = MeshOptions(wall_size=0.2, axis_size=0.1, sphere_elements=10, gap_elements=3)
ONE_MODE = DimensionlessFluid(0.3, (Mode(0.7, 1.0, 0.25),))


def coarse_flow(geometry: Geometry) -> Flow:
    return Flow(geometry, make_mesh(geometry, COARSE, 3), ONE_MODE, 3)


def coarse(reference="middle", **options) -> Transient:
    geometry = replace(Geometry.triplet(0.3, 1.5, 2.0, margin=1.5), reference=reference)
    return Transient(geometry, coarse_flow, 0.5, TimeOptions(**options))


def last(simulation: Transient, until: float):
    return list(simulation.run(until))[-1]


@pytest.mark.parametrize("sp, sf", [(1.25, 1.25), (1.5, 1.5)])
def test_starts_with_the_newtonian_velocities(sp, sf, hyaluronic_acid):
    """Free of stress, only the solvent resists."""
    exact = pd.read_csv(REFERENCE / "newtonian_triplet.csv", comment="#")
    exact = exact[(exact.confinement == 0.2) & (exact.sp == sp) & (exact.sf == sf)].iloc[0]

    def make_flow(geometry):
        return Flow(geometry, make_mesh(geometry, FINE, 6), hyaluronic_acid, 4)

    geometry = Geometry.triplet(0.2, sp, sf, margin=2.0)
    start = next(Transient(geometry, make_flow, 1.0, TimeOptions()).run(1.0))
    assert start.time == 0
    assert pytest.approx([exact.U1, exact.U2, exact.U3], abs=1e-6) == start.velocities


@pytest.mark.slow
def test_second_order_in_time():
    """Halving the step divides the error of velocities and positions by four."""
    steps = [0.04, 0.02, 0.01, 0.005]
    flows = [last(coarse(fixed_step=dt, tolerance=1e-10), 0.4) for dt in steps]
    for quantity, allowed in (("velocities", 1e-5), ("positions", 1e-5)):
        values = np.array([np.diff(getattr(end, quantity)) for end in flows])
        changes = np.abs(np.diff(values, axis=0)).max(axis=1)
        orders = np.log2(changes[:-1] / changes[1:])
        assert 1.7 < orders[-1] < 2.4, (quantity, orders)
        assert changes[-1] / 3 < allowed


@pytest.mark.slow
def test_controlled_steps_reach_the_error_they_promise():
    exact = last(coarse(fixed_step=0.0025), 0.6)
    simulation = coarse()
    instants = list(simulation.run(0.6))
    assert instants[-1].time == pytest.approx(0.6, abs=1e-12)
    assert len(instants) < 60
    relative = np.diff(instants[-1].velocities) - np.diff(exact.velocities)
    assert np.abs(relative).max() < 5 * TimeOptions.relative_tolerance
    gaps = np.diff(instants[-1].positions) - np.diff(exact.positions)
    assert np.abs(gaps).max() < 1e-4 * 0.3


@pytest.mark.slow
def test_gaps_do_not_depend_on_the_frame():
    ends = [last(coarse(name, fixed_step=0.02), 0.3) for name in ("trailing", "middle", "leading")]
    for end in ends[1:]:
        assert np.diff(end.positions) == pytest.approx(np.diff(ends[0].positions), abs=1e-4 * 0.3)
        assert end.velocities == pytest.approx(ends[0].velocities, abs=2e-5)


def test_spheres_move_by_their_velocities():
    """The positions are those in the frame of the wall."""
    start, *_, end = coarse(fixed_step=0.01).run(0.05)
    moved = end.positions - start.positions
    assert moved == pytest.approx(0.025 * (start.velocities + end.velocities), rel=1e-3)


def test_continues_from_a_checkpoint(tmp_path):
    """Stopped and continued, the simulation is the same, up to the tolerance of the iteration."""
    options = {"fixed_step": 0.02, "tolerance": 1e-11, "max_stretch": 1.001}
    whole = last(coarse(**options), 0.12)
    stopped = coarse(**options)
    last(stopped, 0.06)
    stopped.save(tmp_path / "checkpoint.npz")
    continued = coarse(**options)
    continued.load(tmp_path / "checkpoint.npz")
    end = last(continued, 0.12)
    assert end.velocities == pytest.approx(whole.velocities, abs=1e-9)
    assert end.positions == pytest.approx(whole.positions, abs=1e-9)


def test_uniform_stress_stays_uniform_on_a_moving_mesh():
    """Without gradients nothing is carried: psi follows the law of one point, w whatever it is."""
    simulation = coarse()
    next(simulation.run(1.0))
    flow = simulation.flow
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
    simulation._mesh.displace(np.add(flow.geometry.positions, [0.05, 0.0, -0.1]))
    residual = flow.state.vec.CreateVector()
    simulation._newton._form.Apply(flow.state.vec, residual)
    first = flow.space.Range(4 + len(flow.geometry.moving_spheres)).start
    assert np.abs(residual.FV().NumPy()[first:]).max() < 1e-14


@pytest.mark.slow
def test_gaps_do_not_depend_on_how_the_mesh_moves_between_spheres():
    """W may be any interpolation of the velocities of the spheres; here gaps change fast."""

    def make_flow(geometry: Geometry) -> Flow:
        sizes = MeshOptions(wall_size=0.25, axis_size=0.12, sphere_elements=9, gap_elements=4)
        return Flow(geometry, make_mesh(geometry, sizes, 4), ONE_MODE, 4)

    def late_step(t):
        return t**3

    geometry = Geometry.train(0.4, [1.25, 1.4], margin=1.2)
    options = TimeOptions(max_stretch=1.1)
    runs = [
        Transient(geometry, make_flow, 0.5, options, profile=profile)
        for profile in (linear, smooth_step, late_step)
    ]
    ends = [last(run, 1.0) for run in runs]
    moved = np.diff(ends[0].positions) - np.diff(geometry.positions)
    assert np.abs(moved).max() > 5e-3
    for end in ends[1:]:
        assert np.diff(end.positions) == pytest.approx(np.diff(ends[0].positions), abs=4e-5)
        assert np.diff(end.velocities) == pytest.approx(np.diff(ends[0].velocities), abs=5e-5)
    shapes = [run._mesh._shapes[0].vec.FV().NumPy().copy() for run in runs[:2]]
    assert np.abs(shapes[1] - shapes[0]).max() > 0.05


def test_stress_brought_to_another_mesh_stays_odd_on_the_axis():
    """c_zr on the axis is no unknown: what a transfer leaves there would grow by extrapolation."""
    old, new = (
        MovingMesh(coarse_flow(replace(Geometry.triplet(0.3, 1.5, sf, margin=1.5))))
        for sf in (2.0, 2.1)
    )
    for psi in old.flow.fields().psi:
        psi.b.Set(ngsolve.y * (1 + ngsolve.x))
        psi.a.Set(1 + ngsolve.x)
    transfer_stress(old, new, np.array(new.flow.geometry.positions))
    b = new.flow.fields().psi[0].b
    fixed = ~b.space.FreeDofs()
    values = b.vec.FV().NumPy()
    on_axis = [
        n
        for el in new.flow.mesh.Boundaries("axis").Elements()
        for n in b.space.GetDofNrs(el)
        if n >= 0
    ]
    assert on_axis and all(fixed[n] for n in on_axis)
    assert np.abs(values[on_axis]).max() == 0.0
    assert np.abs(values).max() > 0.1


@pytest.mark.slow
def test_starts_from_a_developed_stress():
    """From the quasi-steady stress the velocities are the quasi-steady ones, at once."""
    geometry = replace(Geometry.triplet(0.3, 1.5, 2.0, margin=1.5))
    options = SolverOptions(tolerance=1e-9, max_iterations=30, deborah_step=3.0)
    flow = coarse_flow(geometry)
    (found,) = solve(flow, [0.5], options)
    start = next(Transient(geometry, coarse_flow, 0.5, TimeOptions(), found.flow).run(1.0))
    assert start.time == 0
    expected = list(found.velocities.values())
    assert start.velocities == pytest.approx(expected, abs=5e-6)  # curved elements: a projection
    rest = next(coarse().run(1.0))
    assert np.abs(rest.velocities - start.velocities).max() > 1e-3


@pytest.mark.slow
def test_gaps_do_not_depend_on_remeshing():
    def make_flow(geometry: Geometry) -> Flow:
        sizes = MeshOptions(wall_size=0.25, axis_size=0.15, sphere_elements=8, gap_elements=3)
        return Flow(geometry, make_mesh(geometry, sizes, 4), ONE_MODE, 4)

    geometry = Geometry.train(0.4, [1.25, 1.4], margin=1.2)
    runs = [
        list(Transient(geometry, make_flow, 0.5, TimeOptions(max_stretch=limit)).run(0.5))
        for limit in (2.0, 1.005)
    ]
    jumps = [[at.remeshing_jump for at in run if at.remeshing_jump >= 0] for run in runs]
    assert len(jumps[0]) == 0
    assert len(jumps[1]) >= 2
    assert max(jumps[1]) < 5e-5
    ends = [np.diff(run[-1].positions) for run in runs]
    assert np.abs(ends[0] - np.diff(geometry.positions)).max() > 2e-3
    assert ends[1] == pytest.approx(ends[0], abs=1e-4 * 0.4)


@pytest.mark.slow
def test_start_up_of_pipe_flow(hyaluronic_acid):
    """Against the stress of points along the radius, which the flow rate couples."""
    geometry = Geometry(0.2, (), (), 0.4, None)

    def make_flow(geometry):
        options = replace(FINE, wall_size=0.06, axis_size=0.06)
        return Flow(geometry, make_mesh(geometry, options, 4), hyaluronic_acid, 4)

    options = TimeOptions(fixed_step=0.01, tolerance=1e-10)
    simulation = Transient(geometry, make_flow, 1.0, options)
    *_, end = simulation.run(0.5)
    gradient, centreline = pipe_start_up(hyaluronic_acid, 1.0, 0.5)
    assert end.pressure_gradient == pytest.approx(gradient, rel=1e-4)
    u = simulation.flow.fields().u.z(simulation.flow.mesh(0.2, 0.0))
    assert u == pytest.approx(centreline, rel=1e-4)


def pipe_start_up(fluid, deborah, time):
    """Pressure gradient and centreline velocity of Ubar = 1 at a time after the start from rest.

    eta_s u' + tau = -G r/2 at every r, G from the flow rate, -int u' r^2 dr = R^2; conformation of
    each mode from its tensor equation, at Gauss points along the radius.
    """
    R = 0.5
    x, w = np.polynomial.legendre.leggauss(60)
    r, w = R * (x + 1) / 2, R * w / 2
    modes = [(m.viscosity, deborah * m.relaxation_time, m.mobility) for m in fluid.modes]

    def shear(c):
        tau = sum(eta / lam * ck[1] for (eta, lam, _), ck in zip(modes, c, strict=True))
        G = (R**2 * fluid.solvent - w @ (r**2 * tau)) * 8 / R**4
        return G, (-G * r / 2 - tau) / fluid.solvent

    def rate(_, y):
        c = y.reshape(len(modes), 3, r.size)  # zz, zr, rr
        g = shear(c)[1]
        out = []
        for (_, lam, alpha), (zz, zr, rr) in zip(modes, c, strict=True):
            a, d = zz - 1, rr - 1
            out += [
                2 * g * zr - (a + alpha * (a * a + zr * zr)) / lam,
                g * rr - (zr + alpha * zr * (a + d)) / lam,
                -(d + alpha * (d * d + zr * zr)) / lam,
            ]
        return np.concatenate(out)

    start = np.concatenate([np.ones(r.size), np.zeros(r.size), np.ones(r.size)] * len(modes))
    y = solve_ivp(rate, (0, time), start, rtol=1e-9, atol=1e-10).y[:, -1]
    gradient, slope = shear(y.reshape(len(modes), 3, r.size))
    return gradient, -w @ slope
