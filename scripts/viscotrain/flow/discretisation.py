"""The discretised flow around rigid, force-free spheres: unknowns, residuals and measurements.

Frame. The flow is written in the frame of one sphere, the middle one of a triplet: there u_z = 0,
and on the wall u_z is one unknown, minus the velocity of that sphere. So the velocity at which
stress is carried past the spheres belongs to the unknowns and its linearisation is exact.

Spheres. u_z is one unknown on each of the other spheres (`PlateauFESpace`); the natural condition
of that unknown is zero total force. The reference sphere is force-free because the wall carries
the force of the pressure drop (`weak_forms.flow_rate`). No traction is ever integrated.

Elements. Triangles with continuous polynomials: u of order k, p and psi of order k - 1; the
transport of psi is upwinded (`weak_forms`).
"""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import ngsolve
from ngsolve import H1, CoefficientFunction, IfPos, NumberSpace, Periodic, PlateauFESpace

from viscotrain.flow import giesekus, weak_forms
from viscotrain.flow.axisymmetry import (
    Velocity,
    rate_of_deformation,
    volume_integrand,
    vorticity,
    z,
)
from viscotrain.flow.batches import BatchedForm
from viscotrain.flow.geometry import Geometry
from viscotrain.flow.giesekus import LogConformation
from viscotrain.fluid.parameters import DimensionlessFluid

ELEMENT_SIZE = ngsolve.specialcf.mesh_size


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


Integrands = Callable[[Fields, Fields, Callable], list]


class Storage(NamedTuple):
    """Backward difference of the unknowns: leading times the new one plus history.

    Attributes:
        leading: Coefficient of the new state.
        history: Sum over the old states, each with its coefficient.
    """

    leading: ngsolve.Parameter
    history: ngsolve.GridFunction


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
        self.velocity_order, self.mean_velocity = velocity_order, mean_velocity
        self.deborah = ngsolve.Parameter(1.0)
        self.fixed = geometry.reference or "wall"  # boundary without velocity in this frame
        self.space = _space(geometry, mesh, len(fluid.modes), velocity_order)
        self.state = ngsolve.GridFunction(self.space)
        self.free = ngsolve.BitArray(self.space.FreeDofs())
        self.free.Clear(self.space.Range(2).start)  # one pressure, whose level is arbitrary
        self.free_newtonian = ngsolve.BitArray(self.free)
        first_psi = 4 + len(geometry.moving_spheres)
        for component in range(first_psi, len(self.space.components)):
            unknowns = self.space.Range(component)
            self.free_newtonian[unknowns.start : unknowns.stop] = False
        self._steps = [_smooth_step(z, *gap) for gap in geometry.gaps]

    @cached_property
    def newtonian(self) -> BatchedForm:
        """The residual without polymer, of viscosity one."""
        return self._form(lambda trial, test, _: momentum(1.0, trial, test))

    @cached_property
    def viscoelastic(self) -> BatchedForm:
        """The quasi-steady residual."""
        return self._viscoelastic_form(self.mesh_velocity)

    def _form(self, integrands: "Integrands") -> BatchedForm:
        """A form with these integrands over the fluid, and the integrals over boundaries."""

        def integrals(trial, test, values):
            found = integrands(self.grouped(trial), self.grouped(test), values)
            return [volume_integrand(integrand) for integrand in found]

        return BatchedForm(self.space, integrals, self._boundary_form())

    def _boundary_form(self) -> ngsolve.BilinearForm:
        """A form with the integrals over boundaries."""
        form = ngsolve.BilinearForm(self.space)
        trial, test = (self.grouped(functions) for functions in self.space.TnT())
        (u, _, drop, speeds, _), (v, _, drop_test, speed_tests, _) = trial, test
        form += weak_forms.flow_rate(
            u,
            v,
            drop,
            drop_test,
            mean_velocity=self.mean_velocity,
            length=self.geometry.length,
        )
        for name, speed, test in zip(
            self.geometry.moving_spheres, speeds, speed_tests, strict=True
        ):
            form += weak_forms.follow(u, speed, test, name)
        return form

    def transient_form(
        self, mesh_velocity: Callable[[list], Velocity], storage: "Storage"
    ) -> BatchedForm:
        """The viscoelastic residual with the time derivative of psi, on a mesh that moves.

        Args:
            mesh_velocity: w from the speeds of `Fields`.
            storage: Backward difference of psi.
        """
        return self._viscoelastic_form(mesh_velocity, storage)

    def _viscoelastic_form(self, mesh_velocity, storage: "Storage | None" = None) -> BatchedForm:
        def integrands(trial, test, values):
            De, stored = self.deborah.Get(), None
            if storage is not None:
                stored = storage.leading.Get(), self.grouped(values(storage.history.vec)).psi
            return [
                *momentum(self.fluid.solvent, trial, test),
                *self.modes(trial, test, De, mesh_velocity(trial.speeds), stored),
            ]

        return self._form(integrands)

    def modes(self, trial: "Fields", test: "Fields", De, w: Velocity, stored: tuple | None = None):
        """Integrands over the fluid of the stress and of the evolution of each mode.

        Args:
            trial: Unknowns.
            test: Test functions.
            De: lambda_1 Ubar/D.
            w: Velocity of the mesh.
            stored: Leading coefficient and history of each psi, of `weak_forms.storage`.
        """
        integrands = []
        relative = Velocity(z=trial.u.z - w.z, r=trial.u.r - w.r)
        D, turning = rate_of_deformation(trial.u), vorticity(trial.u)
        for k, (mode, psi, chi) in enumerate(
            zip(self.fluid.modes, trial.psi, test.psi, strict=True)
        ):
            lam = De * mode.relaxation_time
            known = giesekus.exponentials(psi)
            tau = giesekus.polymer_stress(psi, mode.viscosity, lam, known)
            rate = giesekus.evolution(psi, D, turning, lam, mode.mobility, known)
            integrands.append(weak_forms.polymer(tau, test.u))
            tests = weak_forms.upwind(chi, relative, ELEMENT_SIZE, lam)
            components = weak_forms.transport(psi, tests, relative, rate)
            if stored is not None:
                more = weak_forms.storage(psi, tests, stored[0], stored[1][k])
                components = [a + b for a, b in zip(components, more, strict=True)]
            integrands += components
        return integrands

    def fields(self) -> "Fields":
        """The present state; velocities in the frame of the reference sphere."""
        return self.grouped(self.state.components)

    def grouped(self, components) -> "Fields":
        """Components of a function of the space, by name."""
        u_z, u_r, p, drop, *rest = components
        moving = len(self.geometry.moving_spheres)
        speeds, psi = rest[:moving], rest[moving:]
        modes = [LogConformation(*psi[k : k + 4]) for k in range(0, len(psi), 4)]
        return Fields(Velocity(u_z, u_r), p, drop, speeds, modes)

    def mesh_velocity(self, speeds: Sequence) -> Velocity:
        """w: that of each sphere over its width, smooth across the gaps, constant outside.

        The stress ahead of the leading and behind the trailing sphere so moves with that sphere,
        and the result does not depend on the periodic length. At the periodic ends w jumps, where
        psi does not change along z.
        """
        own = dict(zip(self.geometry.moving_spheres, speeds, strict=True))
        speeds = [own.get(name, 0.0) for name in self.geometry.spheres]
        w = speeds[0] if speeds else 0.0
        for step, before, after in zip(self._steps, speeds, speeds[1:], strict=False):
            w = w + (after - before) * step
        return Velocity(z=w, r=0.0)

    def sphere_velocities(self) -> dict[str, float]:
        """U of each sphere relative to the wall, in Ubar, by name."""
        return {name: self._speed(name) - self._speed("wall") for name in self.geometry.spheres}

    def relative_velocities(self) -> list[float]:
        """Of neighbours, along the flow: the one ahead minus the one behind, in Ubar."""
        return [
            self._speed(ahead) - self._speed(behind)
            for behind, ahead in zip(self.geometry.spheres, self.geometry.spheres[1:], strict=False)
        ]

    def speeds(self, vector: ngsolve.BaseVector) -> list[float]:
        """u_z of the other spheres and of the wall, relative to the reference sphere, in Ubar.

        Args:
            vector: Unknowns, or a change of them.
        """
        others = (*self.geometry.moving_spheres, "wall")
        return [vector[self.unknown_of(name)] for name in others if name != self.fixed]

    def wall_speed(self) -> float:
        """u_z of the wall in the frame of the reference sphere."""
        return self._speed("wall")

    def pressure_gradient(self) -> float:
        """-dp/dz, mean over the periodic length, in eta_0 Ubar/D^2."""
        return -self.fields().drop.vec[0] / self.geometry.length

    def variant(self, fluid: DimensionlessFluid, velocity_order: int) -> "Flow":
        """The flow of another fluid, or in spaces of another order, on the same mesh."""
        return Flow(self.geometry, self.mesh, fluid, velocity_order, self.mean_velocity)

    def on(self, mesh: ngsolve.Mesh) -> "Flow":
        """The same flow on another mesh of its geometry."""
        return Flow(self.geometry, mesh, self.fluid, self.velocity_order, self.mean_velocity)

    def embed(self, vector: ngsolve.BaseVector, target: "Flow") -> ngsolve.BaseVector:
        """A vector of this flow's unknowns as one of `target`, on any mesh of the same geometry.

        Exact on the same mesh if the order of `target` is not lower; else an interpolation.
        Overwrites both states.
        """
        self.state.vec.data = vector
        for mine, other in zip(self.state.components, target.state.components, strict=True):
            if isinstance(mine.space, NumberSpace):
                other.vec.data = mine.vec
            else:
                other.Set(mine)
        for boundary in (*self.geometry.moving_spheres, "wall"):
            if boundary != self.fixed:  # `Set` averages these unknowns with the wrong weight
                target.state.vec[target.unknown_of(boundary)] = self._speed(boundary)
        ngsolve.Projector(target.free, True).Project(target.state.vec)
        return copy(target.state.vec)

    def _speed(self, boundary: str) -> float:
        """u_z on a sphere or the wall in the frame of the reference sphere."""
        return 0.0 if boundary == self.fixed else self.state.vec[self.unknown_of(boundary)]

    def unknown_of(self, boundary: str) -> int:
        """Index in the state of u_z on a boundary where it is one unknown."""
        element = next(iter(self.mesh.Boundaries(boundary).Elements()))
        return self.space.components[0].GetDofNrs(element)[0]


def momentum(viscosity, trial: Fields, test: Fields) -> list:
    """Integrands over the fluid, without those of the polymer."""
    return [
        weak_forms.viscous(viscosity, trial.u, test.u),
        weak_forms.pressure(trial.p, test.u),
        weak_forms.incompressibility(trial.u, test.p),
    ]


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


def copy(vector: ngsolve.BaseVector) -> ngsolve.BaseVector:
    """A new vector of the same values."""
    new = vector.CreateVector()
    new.data = vector
    return new
