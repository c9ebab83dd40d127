"""Direct numerical simulation: quasi-steady velocities of force-free spheres in one geometry.

Frame. The flow is solved in the frame of one sphere, the middle one: there u_z = 0, and on the
wall u_z is one unknown, minus the velocity of that sphere. So the velocity that carries the stress
is an unknown of the Newton system, and its linearisation is exact. Rigid, force-free spheres cost
nothing: u_z is one unknown on each of the other spheres (`PlateauFESpace`), whose natural condition
is zero total force; the reference sphere is force-free because the wall carries the force of the
pressure drop (`weak_forms.flow_rate`).

Quasi-steady. The mesh moves with the spheres, with velocity w between them, and the time derivative
at a fixed point of the mesh is dropped: the stress has settled at the present distances.

Continuation. All Deborah numbers are solved in ascending order. The guess of a step extrapolates up
to `HISTORY` solutions as polynomials of log(1 + De/De_0); a step that fails is halved.
"""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import ngsolve
from ngsolve import H1, CoefficientFunction, IfPos, NumberSpace, Periodic, PlateauFESpace

from viscotrain import giesekus, newton, weak_forms
from viscotrain.axisymmetry import (
    Velocity,
    rate_of_deformation,
    volume_integral,
    vorticity,
    z,
)
from viscotrain.fluid import DimensionlessFluid
from viscotrain.giesekus import LogConformation
from viscotrain.meshes import Geometry

HISTORY = 3  # solutions that a guess is extrapolated from
DEBORAH_OF_ELASTICITY = 0.5  # De_0: the coordinate of the continuation is linear in De below it
SMALLEST_STEP = 1e-2  # in that coordinate; a continuation that needs smaller ones has failed
LOOSE = 1e3  # tolerance of the steps between requested De, in units of the final one
EASY, HARD = 1, 2  # factorisations of a step: so few lengthen the next one, more shorten it


class Fields(NamedTuple):
    """All unknowns, as trial, test or grid functions.

    Attributes:
        u: Velocity in the frame of the reference sphere, in Ubar.
        p: Pressure in eta_0 Ubar/D.
        drop: Minus the pressure drop over the periodic length.
        speeds: u_z of each sphere but the reference one, by which the mesh moves.
        psi: Log-conformation of each mode.
    """

    u: Velocity
    p: CoefficientFunction
    drop: CoefficientFunction
    speeds: list[CoefficientFunction]
    psi: list[LogConformation]


class Flow:
    """Unknowns and residuals of the flow in one geometry.

    Args:
        geometry: Spheres and periodic length.
        mesh: A mesh of it, with named boundaries.
        fluid: Solvent and modes.
        velocity_order: Polynomial order of u; p and psi are one order lower.
        mean_velocity: Imposed mean velocity relative to the wall, in Ubar.
    """

    def __init__(
        self,
        geometry: Geometry,
        mesh: ngsolve.Mesh,
        fluid: DimensionlessFluid,
        velocity_order: int,
        mean_velocity: float = 1.0,
    ):
        self.geometry, self.mesh, self.fluid = geometry, mesh, fluid
        self.deborah = ngsolve.Parameter(1.0)
        self._fixed = geometry.reference or "wall"
        self.space = _space(geometry, mesh, len(fluid.modes), velocity_order)
        self.state = ngsolve.GridFunction(self.space)
        self.free = ngsolve.BitArray(self.space.FreeDofs())
        self.free.Clear(self.space.Range(2).start)  # one pressure, whose level is arbitrary
        self.free_newtonian = ngsolve.BitArray(self.free)
        first_psi = 4 + len(geometry.moving_spheres)
        for component in range(first_psi, len(self.space.components)):
            unknowns = self.space.Range(component)
            self.free_newtonian[unknowns.start : unknowns.stop] = False
        self.newtonian = ngsolve.BilinearForm(self.space)
        self.viscoelastic = ngsolve.BilinearForm(self.space)
        self._add_momentum(self.newtonian, 1.0, mean_velocity)
        self._add_momentum(self.viscoelastic, fluid.solvent, mean_velocity)
        self._add_modes(self.viscoelastic)

    def _add_momentum(self, form, viscosity, mean_velocity):
        (u, p, drop, speeds, _), (v, q, drop_test, speed_tests, _) = self._unknowns()
        form += volume_integral(weak_forms.viscous(viscosity, u, v))
        form += volume_integral(weak_forms.pressure(p, v))
        form += volume_integral(weak_forms.incompressibility(u, q))
        form += weak_forms.flow_rate(
            u, v, drop, drop_test, mean_velocity=mean_velocity, length=self.geometry.length
        )
        for name, speed, test in zip(
            self.geometry.moving_spheres, speeds, speed_tests, strict=True
        ):
            form += weak_forms.follow(u, speed, test, name)

    def _add_modes(self, form):
        (u, _, _, speeds, psis), (v, _, _, _, chis) = self._unknowns()
        w = self.mesh_velocity(speeds)
        for mode, psi, chi in zip(self.fluid.modes, psis, chis, strict=True):
            lam = self.deborah * mode.relaxation_time
            tau = giesekus.polymer_stress(psi, mode.viscosity, lam)
            rate = giesekus.evolution(psi, rate_of_deformation(u), vorticity(u), lam, mode.mobility)
            form += volume_integral(weak_forms.polymer(tau, v))
            # one integral per test function: all in one would be an order of magnitude slower
            for component in weak_forms.transport(psi, chi, u, w, rate):
                form += volume_integral(component)

    def _unknowns(self) -> tuple["Fields", "Fields"]:
        """Trial and test functions."""
        return tuple(self._grouped(functions) for functions in self.space.TnT())

    def fields(self) -> "Fields":
        """The present state; velocities in the frame of the reference sphere."""
        return self._grouped(self.state.components)

    def _grouped(self, components) -> "Fields":
        u_z, u_r, p, drop, *rest = components
        moving = len(self.geometry.moving_spheres)
        speeds, psi = rest[:moving], rest[moving:]
        modes = [LogConformation(*psi[k : k + 4]) for k in range(0, len(psi), 4)]
        return Fields(Velocity(u_z, u_r), p, drop, speeds, modes)

    def mesh_velocity(self, speeds: Sequence) -> Velocity:
        """w: that of each sphere over its width, smooth in between, zero at the periodic ends."""
        own = dict(zip(self.geometry.moving_spheres, speeds, strict=True))
        spheres = [own.get(name, CoefficientFunction(0.0)) for name in self.geometry.spheres]
        speeds = [CoefficientFunction(0.0), *spheres, CoefficientFunction(0.0)]
        w = CoefficientFunction(0.0)
        for (low, high), before, after in zip(
            self.geometry.free_axis, speeds, speeds[1:], strict=False
        ):
            w += (after - before) * _smooth_step(z, low, high)
        return Velocity(z=w, r=CoefficientFunction(0.0))

    def sphere_velocities(self) -> dict[str, float]:
        """U of each sphere relative to the wall, in Ubar, by name."""
        return {name: self._speed(name) - self._speed("wall") for name in self.geometry.spheres}

    def pressure_gradient(self) -> float:
        """-dp/dz, mean over the periodic length, in eta_0 Ubar/D^2."""
        return -self.fields().drop.vec[0] / self.geometry.length

    def _speed(self, boundary: str) -> float:
        """u_z on a sphere or the wall in the frame of the reference sphere."""
        return 0.0 if boundary == self._fixed else self.state.vec[self.unknown_of(boundary)]

    def unknown_of(self, boundary: str) -> int:
        """Index in the state of u_z on a boundary where it is one unknown."""
        element = next(iter(self.mesh.Boundaries(boundary).Elements()))
        return self.space.components[0].GetDofNrs(element)[0]


def _space(geometry: Geometry, mesh: ngsolve.Mesh, modes: int, order: int):
    """Product of the spaces of `Fields`, in their order.

    All but the pressure are periodic: the pressure drop needs a trace of its own on either side.
    """
    fixed = geometry.reference or "wall"
    moving = [name for name in ("wall", *geometry.spheres) if name != fixed]
    u_z = PlateauFESpace(
        Periodic(H1(mesh, order=order, dirichlet=fixed)), [mesh.Boundaries(name) for name in moving]
    )
    u_r = Periodic(H1(mesh, order=order, dirichlet="|".join(["axis", "wall", *geometry.spheres])))
    p = H1(mesh, order=order - 1)
    psi = Periodic(H1(mesh, order=order - 1))
    odd = Periodic(H1(mesh, order=order - 1, dirichlet="axis"))  # c_zr is odd in r
    number = NumberSpace(mesh)
    speeds = [number] * len(geometry.moving_spheres)
    return ngsolve.FESpace([u_z, u_r, p, number, *speeds, *(modes * [psi, psi, odd, psi])])


def _smooth_step(coordinate, low: float, high: float):
    """0 below `low`, 1 above `high`, a cubic with zero slopes in between."""
    t = (coordinate - low) / (high - low)
    t = IfPos(t, IfPos(1 - t, t, 1.0), 0.0)
    return t * t * (3 - 2 * t)


@dataclass(frozen=True)
class SolverOptions:
    """When an iteration has converged; meaning and defaults stand in `config.DnsConfig`."""

    tolerance: float
    max_iterations: int
    deborah_step: float


@dataclass(frozen=True)
class Solution:
    """Result at one Deborah number.

    Attributes:
        deborah: lambda_1 Ubar/D.
        velocities: U in Ubar by name of the sphere; empty if not solved.
        pressure_gradient: -dp/dz, mean over the box, in eta_0 Ubar/D^2; NaN if not solved.
        convergence: Of the last iteration.
        iterations: Of all steps since the Deborah number before.
        seconds: CPU time of these.
    """

    deborah: float
    velocities: dict[str, float]
    pressure_gradient: float
    convergence: newton.Convergence
    iterations: int
    seconds: float

    @property
    def solved(self) -> bool:
        """Whether the solution converged."""
        return self.convergence.converged


def solve(flow: Flow, deborahs: Sequence[float], options: SolverOptions) -> Iterator[Solution]:
    """Solve the flow at ascending Deborah numbers; `flow.state` holds the solution just yielded.

    Ends after the first Deborah number that does not converge, which is yielded with the reason.
    """
    path = _Continuation(flow, options)
    for De in deborahs:
        started, before = time.process_time(), path.iterations
        convergence = path.advance(De)
        solved = convergence.converged
        yield Solution(
            deborah=De,
            velocities=flow.sphere_velocities() if solved else {},
            pressure_gradient=flow.pressure_gradient() if solved else math.nan,
            convergence=convergence,
            iterations=path.iterations - before,
            seconds=time.process_time() - started,
        )
        if not solved:
            return


class _Continuation:
    """Solutions along De, and the length of the next step."""

    def __init__(self, flow: Flow, options: SolverOptions):
        self.flow, self.options = flow, options
        self.iterations = 0
        self._known: list[tuple[float, ngsolve.BaseVector]] = []
        self._step = self._longest_step = math.log(options.deborah_step)

    def advance(self, De: float) -> newton.Convergence:
        """Go on to De, in one step or several."""
        if not self._known:
            convergence = self._newtonian()
            if De == 0 or not convergence.converged:
                return convergence
        target = _coordinate(De)
        while True:
            here = self._known[-1][0]
            steps = max(1, math.ceil((target - here) / self._step - 0.1))
            last = steps == 1
            convergence = self._solve(target if last else here + (target - here) / steps, last)
            if convergence.converged and last:
                return convergence
            if convergence.converged:
                continue
            self._step = (target - here) / steps / 2
            if self._step < SMALLEST_STEP:
                return convergence

    def _newtonian(self) -> newton.Convergence:
        """De = 0: viscosity eta_0, psi = 0."""
        flow = self.flow
        convergence = self._iterate(flow.newtonian, flow.free_newtonian, self.options.tolerance)
        if convergence.converged:
            self._remember(0.0)
        return convergence

    def _solve(self, coordinate: float, last: bool) -> newton.Convergence:
        flow, options = self.flow, self.options
        self._extrapolate(coordinate)
        flow.deborah.Set(_deborah(coordinate))
        tolerance = options.tolerance * (1 if last else LOOSE)
        convergence = self._iterate(flow.viscoelastic, flow.free, tolerance)
        if convergence.converged:
            self._remember(coordinate)
            if convergence.factorisations <= EASY:
                self._step = min(self._step * 1.5, self._longest_step)
            elif convergence.factorisations > HARD:
                self._step /= 1.5
        else:
            flow.state.vec.data = self._known[-1][1]
        return convergence

    def _iterate(self, form, free, tolerance) -> newton.Convergence:
        convergence = newton.solve(
            form,
            self.flow.state,
            free,
            tolerance=tolerance,
            max_iterations=self.options.max_iterations,
        )
        self.iterations += convergence.iterations
        return convergence

    def _remember(self, coordinate: float):
        solution = self.flow.state.vec.CreateVector()
        solution.data = self.flow.state.vec
        self._known = [*self._known, (coordinate, solution)][-HISTORY:]

    def _extrapolate(self, coordinate: float):
        """Lagrange polynomial through the known solutions."""
        guess = self.flow.state.vec
        guess[:] = 0.0
        for here, solution in self._known:
            others = [there for there, _ in self._known if there != here]
            weight = math.prod((coordinate - there) / (here - there) for there in others)
            guess.data += weight * solution


def _coordinate(De: float) -> float:
    return math.log1p(De / DEBORAH_OF_ELASTICITY)


def _deborah(coordinate: float) -> float:
    return DEBORAH_OF_ELASTICITY * math.expm1(coordinate)
