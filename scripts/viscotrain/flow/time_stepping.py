"""Transient simulation: force-free spheres that move, from rest or from a stress that is given.

ALE. The frame moves with the reference sphere, the mesh with the gaps (`moving_mesh`); d psi/dt is
taken at points of the mesh.

Time. Variable-step BDF2 with omega = dt_n/dt_{n-1} (Hairer, Norsett & Wanner, Solving Ordinary
Differential Equations I, 1993, III.5),

    dt_n dy/dt = (1 + 2 omega)/(1 + omega) y_n - (1 + omega) y_{n-1} + omega^2/(1 + omega) y_{n-2},

for psi and for the positions, fully coupled: the positions follow the velocities inside of the
Newton iteration. The first step is a backward Euler step, so small that it does not matter. The
velocities have no inertia: at t = 0 they follow from the stress by the momentum balance. From rest,
free of stress, they are those of the solvent alone.

Remeshing. When a piece of the axis between or beside the spheres has been stretched or compressed
by more than a given factor, the present geometry is meshed anew. The psi of the last states is
projected (L2) onto the new mesh as it stood at the time of each, so that BDF2 goes on without a new
start; velocities follow from psi by the momentum balance, and their jump is the error of the
transfer.

Step size. The distance of a step from the quadratic extrapolation of the three before estimates the
local error of the velocities and distances; velocities relative to the reference sphere, which
matter, have a smaller tolerance than the one they share.
"""

import functools
import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import ngsolve
import numpy as np

from viscotrain.errors import SolutionError
from viscotrain.flow import newton
from viscotrain.flow.discretisation import Flow, Storage
from viscotrain.flow.geometry import Geometry
from viscotrain.flow.moving_mesh import MovingMesh, Profile, linear, transfer_stress

GROWTH = 2.0  # of a step over the one before, at most
SAFETY = 0.8  # aim at this part of the tolerance, in the step size
REJECTED = 1.5  # error over tolerance from which on a step is repeated
SHRINK = 0.5  # after a step that did not converge
SMALLEST_STEP = 1e-6  # over the first one: below it the simulation has failed
SAME_STEP = 1.15  # smaller changes are not worth a new matrix
HISTORY = 3  # states that the next one is extrapolated from


@dataclass(frozen=True)
class TimeOptions:
    """Time steps; meaning and defaults stand in `config.models.TransientConfig`.

    Attributes:
        first_step: In D/Ubar.
        common_tolerance: Local error of the velocity of the reference sphere, in Ubar.
        relative_tolerance: Local error of the other velocities relative to it, in Ubar.
        distance_tolerance: Local error of the distances of neighbours, in d.
        tolerance: Rms update at which an iteration has converged.
        max_iterations: Updates before a step is given up and halved.
        fixed_step: Step of constant size in D/Ubar, in place of controlled ones; None = controlled.
        max_stretch: Factor of a gap, or its inverse, over that of the mesh before it is remeshed.
    """

    first_step: float = 2e-3
    common_tolerance: float = 2e-4
    relative_tolerance: float = 2e-5
    distance_tolerance: float = 1e-5
    tolerance: float = 1e-7
    max_iterations: int = 12
    fixed_step: float | None = None
    max_stretch: float = 1.5


@dataclass(frozen=True)
class Instant:
    """State of the spheres at one time.

    Attributes:
        time: In D/Ubar.
        velocities: U in Ubar, one per sphere along the flow.
        positions: Centres in D, in the frame of the wall; the reference starts at its place.
        pressure_gradient: -dp/dz, mean over the box, in eta_0 Ubar/D^2.
        iterations: Newton iterations of the step that led here.
        factorisations: Of that step.
        seconds: CPU time of that step, failed tries and remeshing included.
        remeshing_jump: Largest change of a relative velocity by remeshing before that step, in
            Ubar; NaN = not remeshed.
    """

    time: float
    velocities: np.ndarray
    positions: np.ndarray
    pressure_gradient: float
    iterations: int = 0
    factorisations: int = 0
    seconds: float = 0.0
    remeshing_jump: float = math.nan


_INSTANT_FIELDS = tuple(entry.name for entry in fields(Instant))


@dataclass
class _History:
    """The last states, newest last."""

    times: list[float] = field(default_factory=list)
    unknowns: list[np.ndarray] = field(default_factory=list)
    positions: list[np.ndarray] = field(default_factory=list)

    def append(self, time: float, unknowns: np.ndarray, positions: np.ndarray):
        self.times = [*self.times, time][-HISTORY:]
        self.unknowns = [*self.unknowns, unknowns][-HISTORY:]
        self.positions = [*self.positions, positions][-HISTORY:]

    def extrapolated(self, time: float) -> np.ndarray:
        """All unknowns at a later time, by the polynomial through the states."""
        return self._polynomial(self.unknowns, time)

    def extrapolated_positions(self, time: float) -> np.ndarray:
        """The positions at a later time, in the same way."""
        return self._polynomial(self.positions, time)

    def _polynomial(self, vectors: list[np.ndarray], time: float) -> np.ndarray:
        weights = _lagrange(self.times, time)
        terms = (w * vector for w, vector in zip(weights, vectors, strict=True))
        return functools.reduce(np.add, terms)

    def difference(self, dt: float) -> tuple[float, list[float]]:
        """Coefficients of the backward difference over dt: of the new state, of the old ones."""
        if len(self.times) == 1:
            return 1 / dt, [-1 / dt]
        omega = dt / (self.times[-1] - self.times[-2])
        old = [0.0] * (len(self.times) - 2)
        return (1 + 2 * omega) / (1 + omega) / dt, [
            *old,
            omega**2 / (1 + omega) / dt,
            -(1 + omega) / dt,
        ]

    def error_share(self, dt: float) -> float:
        """Local error of the step over its distance from the extrapolation.

        With y''' the third derivative, the error of a BDF2 step is y''' times the first
        expression below, that of the quadratic extrapolation y''' times the second.
        """
        before, first = np.diff(self.times)[::-1][:2]
        step = dt**2 * (dt + before) ** 2 / (6 * (2 * dt + before))
        extrapolation = dt * (dt + before) * (dt + before + first) / 6
        return step / (step + extrapolation)


class Transient:
    """A simulation that can be stopped, written to a file and continued.

    Args:
        geometry: The initial one.
        make_flow: Makes the mesh and the unknowns of a geometry.
        deborah: lambda_1 Ubar/D.
        options: Time steps.
        developed: Flow of the same geometry, on any mesh, with the stress at t = 0; None = rest.
        profile: Of the velocity of the mesh between the spheres.
    """

    def __init__(
        self,
        geometry: Geometry,
        make_flow: Callable[[Geometry], Flow],
        deborah: float,
        options: TimeOptions,
        developed: Flow | None = None,
        profile: Profile = linear,
    ):
        self._developed, self._profile = developed, profile
        self._make_flow, self.deborah, self.options = make_flow, deborah, options
        self.instants: list[Instant] = []
        self._history = _History()
        self._dt = options.fixed_step or options.first_step
        self._reference = geometry.spheres.index(geometry.reference) if geometry.spheres else None
        self._use(make_flow(geometry))

    def _use(self, flow: Flow):
        """Go on with this mesh and these unknowns."""
        self.flow = flow
        flow.deborah.Set(self.deborah)
        self._mesh = MovingMesh(flow, self._profile)
        self._storage = Storage(ngsolve.Parameter(0.0), ngsolve.GridFunction(flow.space))
        form = flow.transient_form(self._mesh.velocity, self._storage)
        self._newton = newton.ModifiedNewton(form, flow.free)

    def _velocities(self) -> np.ndarray:
        return np.array(list(self.flow.sphere_velocities().values()))

    def geometry(self) -> Geometry:
        """The present one, in a box of its own."""
        return self.flow.geometry.moved(self._history.positions[-1].tolist())

    # ---------------------------------------------------------------------------------- time

    def run(self, until: float) -> Iterator[Instant]:
        """Yield the start and every step until a time in D/Ubar, which is met exactly.

        What was yielded stands in `instants`, those of a loaded checkpoint before.

        Raises:
            SolutionError: Steps do not converge however small they are.
        """
        if not self.instants:
            self.instants.append(self._start())
            yield self.instants[-1]
        while self._history.times[-1] < until * (1 - 1e-12):
            self.instants.append(self._advance(until))
            yield self.instants[-1]

    def _start(self) -> Instant:
        """Velocities from the stress at t = 0; without any, only the solvent resists."""
        flow = self.flow
        flow.state.vec[:] = 0.0
        started = time.process_time()
        positions = np.array(flow.geometry.positions)
        if self._developed is not None:
            transfer_stress(MovingMesh(self._developed), self._mesh, positions)
        convergence = self._balance_momentum("start")
        self._history.append(0.0, flow.state.vec.FV().NumPy().copy(), positions)
        return self._instant(convergence, time.process_time() - started)

    def _balance_momentum(self, what: str) -> newton.Convergence:
        """Velocity and pressure from the psi of the state."""
        flow, options = self.flow, self.options
        stokes = newton.ModifiedNewton(flow.viscoelastic, flow.free_newtonian)
        convergence = stokes.solve(
            flow.state, tolerance=options.tolerance, max_iterations=options.max_iterations
        )
        if not convergence.converged:
            raise SolutionError(f"{what}: {convergence.reason}")
        return convergence

    def _advance(self, until: float) -> Instant:
        """One step, repeated with a smaller one until its error is small enough."""
        started = time.process_time()
        jump = self._remesh() if self._worn() else math.nan
        options, history = self.options, self._history
        while True:
            now = history.times[-1]
            steps = math.ceil((until - now) / self._dt * (1 - 1e-9))
            dt = (until - now) / steps if steps <= 2 else self._dt
            convergence, positions = self._step(dt)
            if not convergence.converged:
                self._dt = dt * SHRINK
                if self._dt < SMALLEST_STEP * options.first_step:
                    raise SolutionError(f"t = {now:g} D/Ubar: {convergence.reason}")
                continue
            if options.fixed_step is not None or len(history.times) < HISTORY:
                break
            error = self._error(now + dt, dt, positions)
            factor = min(GROWTH, SAFETY * error ** (-1 / 3)) if error > 0 else GROWTH
            if error > REJECTED:
                self._dt = dt * factor
                continue
            if not 1 / SAME_STEP < factor < SAME_STEP:
                self._dt = dt * factor
            break
        history.append(now + dt, self.flow.state.vec.FV().NumPy().copy(), positions)
        return self._instant(convergence, time.process_time() - started, jump)

    def _step(self, dt: float) -> tuple[newton.Convergence, np.ndarray]:
        """Try one step; the new state is in the flow."""
        flow, history, options = self.flow, self._history, self.options
        leading, old = history.difference(dt)
        self._storage.leading.Set(leading)
        self._storage.history.vec.FV().NumPy()[:] = sum(
            c * vector for c, vector in zip(old, history.unknowns, strict=True) if c
        )
        moved = sum(c * z for c, z in zip(old, history.positions, strict=True))
        flow.state.vec.FV().NumPy()[:] = history.extrapolated(history.times[-1] + dt)

        def positions() -> np.ndarray:
            return (self._velocities() - moved) / leading

        convergence = self._newton.solve(
            flow.state,
            tolerance=options.tolerance,
            max_iterations=options.max_iterations,
            prepare=lambda: self._mesh.displace(positions()),
        )
        return convergence, positions()

    def _error(self, time: float, dt: float, positions: np.ndarray) -> float:
        """Estimated local error of velocities and distances over its tolerance."""
        flow, history, options = self.flow, self._history, self.options
        if not positions.size:
            return 0.0
        found = self._velocities()
        flow_state = flow.state.vec.FV().NumPy().copy()
        flow.state.vec.FV().NumPy()[:] = history.extrapolated(time)
        difference = found - self._velocities()
        flow.state.vec.FV().NumPy()[:] = flow_state
        relative = np.abs(difference - difference[self._reference]).max()
        distances = np.diff(positions - history.extrapolated_positions(time))
        worst = max(
            abs(difference[self._reference]) / options.common_tolerance,
            relative / options.relative_tolerance,
            np.abs(distances).max(initial=0.0)
            / (options.distance_tolerance * flow.geometry.confinement),
        )
        return history.error_share(dt) * worst

    def _instant(
        self, convergence: newton.Convergence, seconds: float, jump: float = math.nan
    ) -> Instant:
        return Instant(
            time=self._history.times[-1],
            velocities=self._velocities(),
            positions=self._history.positions[-1].copy(),
            pressure_gradient=self.flow.pressure_gradient(),
            iterations=convergence.iterations,
            factorisations=convergence.factorisations,
            seconds=seconds,
            remeshing_jump=jump,
        )

    # ----------------------------------------------------------------------------- remeshing

    def _worn(self) -> bool:
        """Whether the mesh is stretched too far."""
        if not self.flow.geometry.spheres:
            return False
        return self._mesh.stretch(self._history.positions[-1]) > self.options.max_stretch

    def _remesh(self) -> float:
        """Go on with a new mesh; returns the largest jump of a relative velocity."""
        before, history, old = self._velocities(), self._history, self._mesh
        self._use(self._make_flow(self.geometry()))
        transferred = []
        for unknowns, positions in zip(history.unknowns, history.positions, strict=True):
            old.flow.state.vec.FV().NumPy()[:] = unknowns
            transfer_stress(old, self._mesh, positions)
            self._balance_momentum("remeshing")
            transferred.append(self.flow.state.vec.FV().NumPy().copy())
        history.unknowns = transferred
        return float(np.abs(np.diff(self._velocities() - before)).max())

    # ---------------------------------------------------------------------------- checkpoint

    def save(self, path: Path, signature: str = ""):
        """Write what is needed to continue; a file that is there is replaced in one move.

        Args:
            path: Ends in .npz.
            signature: What the simulation depends on; `load` compares it.
        """
        history = self._history
        partial = path.with_suffix(".partial.npz")
        instants: dict[str, Any] = {
            f"instant_{name}": [getattr(instant, name) for instant in self.instants]
            for name in _INSTANT_FIELDS
        }
        np.savez(
            partial,
            times=history.times,
            unknowns=history.unknowns,
            positions=history.positions,
            meshed_positions=self.flow.geometry.positions,
            step=self._dt,
            signature=signature,
            **instants,
        )
        os.replace(partial, path)

    def load(self, path: Path, signature: str = "") -> bool:
        """Continue from a file of `save`, unless its signature is another; whether it did."""
        with np.load(path) as stored:
            if str(stored["signature"]) != signature:
                return False
            unknowns = stored["unknowns"]
            if list(stored["meshed_positions"]) != list(self.flow.geometry.positions):
                geometry = self.flow.geometry.moved(stored["meshed_positions"])
                self._use(self._make_flow(geometry))
            self._history = _History(
                list(map(float, stored["times"])), list(unknowns), list(stored["positions"])
            )
            self._dt = float(stored["step"])
            columns = [stored[f"instant_{name}"] for name in _INSTANT_FIELDS]
            self.instants = [Instant(*row) for row in zip(*columns, strict=True)]
        self.flow.state.vec.FV().NumPy()[:] = self._history.unknowns[-1]
        self._mesh.displace(self._history.positions[-1])
        return True


def _lagrange(nodes: list[float], at: float) -> list[float]:
    """Weights of the polynomial through the nodes, at another place."""
    return [
        math.prod((at - other) / (node - other) for other in nodes if other != node)
        for node in nodes
    ]
