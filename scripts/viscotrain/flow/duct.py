r"""Undisturbed flow in a duct: a generalised Newtonian fluid in a section of any shape.

Fully developed flow has one velocity component u(x, y), with the shear rate |grad u| everywhere.
With the steady shear viscosity of the fluid (`fluid.shear`) and the pressure gradient G = -dp/dz

    div(eta(|grad u|) grad u) + G = 0,    u = 0 at the wall,    mean of u = 1,

a nonlinear Poisson problem whose last line determines G. Lengths are in the diameter D of the
inscribed tube, the smaller side of a rectangle; velocities in Ubar; stresses in eta_0 Ubar/D, so
that De = lambda_1 Ubar/D as in a tube. What is left out are secondary flows across the section,
which second normal stress differences drive in ducts that are not round: of a percent of Ubar or
less in such fluids (Debbaut, Avalosse, Dooley & Hughes, J. Non-Newtonian Fluid Mech. 69, 1997,
255).

**Discretisation.** A quarter of the section, by symmetry, in H1 elements of high order. u behaves
as r^2 log r in the corners of a rectangle, so elements shrink geometrically towards walls; layers
of a thinning fluid are there too. The law is evaluated at the quadrature points, with its
derivative by a complex step, so each iteration is Newton's,

    (eta grad w + (eta'/|grad u|) (grad u . grad w) grad u, grad v) - dG (1, v)
        = G (1, v) - (eta grad u, grad v),    (1, w) = 0,

from De = 0, which is linear, in steps of De. The stress must grow with the shear rate, else there
is no unique flow, as in a tube (`fluid.pipe`).
"""

import math
from typing import NamedTuple

import ngsolve as ng
import numpy as np
from ngsolve.comp import IntegrationRuleSpace
from ngsolve.meshes import MakeStructured2DMesh
from numpy.typing import NDArray

from viscotrain.errors import FluidError
from viscotrain.fluid.parameters import CHANNEL_RADIUS, DimensionlessFluid
from viscotrain.fluid.shear import shear_viscosity

ORDER = 6
ELEMENTS = 5  # of equal length from the axis to a wall; the last one is cut into layers
LAYERS, SHRINK = 5, 0.35  # each layer over the one before: the last one is 5e-4 D thick
LONGEST_ELEMENT = 0.5  # D, along the larger side of a flat duct
QUADRATURE = 15  # order: 2 (ORDER - 1) and some, for no polynomial; above, NGSolve 6.2 crashes
DEBORAH_STEP, FIRST_DEBORAH = 4.0, 0.5  # of the continuation; 8 takes more iterations in all
TOLERANCE = 1e-9  # Ubar, of the last update: the next one would be round-off
MOST_ITERATIONS, MOST_HALVINGS = 30, 12
SMALLEST_RATE = 1e-7  # Ubar/D, for eta'/rate, which is finite at 0
COMPLEX_STEP = 1e-30
WALL_POINTS = 201  # on each side, where the largest shear rate is looked for
PERMITTED_DECREASE = 1e-12  # of the stress between two shear rates: round-off


class DuctFlow(NamedTuple):
    """Flow of unit mean velocity.

    Attributes:
        centreline_velocity: Largest velocity U_max, in Ubar.
        pressure_gradient: -dp/dz in eta_0 Ubar/D^2.
        largest_wall_shear_rate: At the middle of the longest side, in Ubar/D.
        mean_wall_shear_rate: Over the perimeter, in Ubar/D.
    """

    centreline_velocity: float
    pressure_gradient: float
    largest_wall_shear_rate: float
    mean_wall_shear_rate: float


def rectangle_flow(
    fluid: DimensionlessFluid, deborah: float, aspect_ratio: float = 1.0
) -> DuctFlow:
    """Flow through a rectangle of height 1 and width `aspect_ratio` >= 1, in D.

    Raises:
        FluidError: The shear stress decreases with the shear rate, or the iteration failed.
    """
    mesh = quarter_of_rectangle(aspect_ratio)
    u, G = solve(mesh, fluid, deborah)
    rate = ng.sqrt(ng.grad(u) * ng.grad(u))
    half_width, half_height = aspect_ratio / 2, CHANNEL_RADIUS
    along = np.linspace(0.0, 1.0, WALL_POINTS) ** 2  # the corner, where the rate vanishes, is at 1
    sides = [(half_width * along, half_height + 0 * along)]
    sides.append((half_width + 0 * along, half_height * along))
    largest = max(float(np.max(rate(mesh(x, y)))) for x, y in sides)
    at_wall = ng.Integrate(ng.BoundaryFromVolumeCF(rate) * ng.ds("wall"), mesh)
    return DuctFlow(
        centreline_velocity=float(u(mesh(0.0, 0.0))),
        pressure_gradient=G,
        largest_wall_shear_rate=largest,
        mean_wall_shear_rate=at_wall / (half_width + half_height),
    )


def quarter_of_rectangle(aspect_ratio: float) -> ng.Mesh:
    """The part x, y > 0 of a rectangle about the origin; boundaries `wall` and `symmetry`."""
    x, y = _graded(aspect_ratio / 2), _graded(CHANNEL_RADIUS)

    def place(s: float, t: float) -> tuple[float, float]:
        return x[round(s * (len(x) - 1))], y[round(t * (len(y) - 1))]

    mesh = MakeStructured2DMesh(quads=True, nx=len(x) - 1, ny=len(y) - 1, mapping=place)
    walls = {"right", "top"}
    for number, name in enumerate(mesh.GetBoundaries()):
        mesh.ngmesh.SetBCName(number, "wall" if name in walls else "symmetry")
    return ng.Mesh(mesh.ngmesh)


def _graded(end: float) -> NDArray:
    """Nodes from 0 to the wall at `end`, closer towards it."""
    flat, size = end - CHANNEL_RADIUS, CHANNEL_RADIUS / ELEMENTS
    count = math.ceil(flat / LONGEST_ELEMENT)
    far = np.linspace(0, flat, count + 1)[:-1]
    near = flat + size * np.arange(ELEMENTS - 1)
    layers = end - size * SHRINK ** np.arange(LAYERS + 1)
    return np.concatenate([far, near, layers, [end]])


def solve(
    mesh: ng.Mesh, fluid: DimensionlessFluid, deborah: float, order: int = ORDER
) -> tuple[ng.GridFunction, float]:
    """Velocity in Ubar and -dp/dz in eta_0 Ubar/D^2 on a mesh with a boundary `wall`.

    Args:
        mesh: Of the section or of a part of it, by symmetry, in D.
        fluid: Its viscosity.
        deborah: lambda_1 Ubar/D.
        order: Polynomial order.

    Raises:
        FluidError: The shear stress decreases with the shear rate, or the iteration failed.
    """
    own = _Problem(mesh, fluid, order)
    path = [deborah]
    while path[-1] > FIRST_DEBORAH:
        path.append(path[-1] / DEBORAH_STEP)
    for De in (0.0, *reversed(path)):
        own.solve_at(De)
    return own.velocity, own.gradient


class _Problem:
    """The discrete problem on one mesh, with its present solution."""

    def __init__(self, mesh: ng.Mesh, fluid: DimensionlessFluid, order: int):
        self.fluid = fluid
        self.space = ng.H1(mesh, order=order, dirichlet="wall")
        self.velocity, self.gradient = ng.GridFunction(self.space), 0.0
        points = IntegrationRuleSpace(mesh, order=QUADRATURE)
        self.rule = {"intrules": points.GetIntegrationRules()}
        self.rate, self.eta, self.slope = (ng.GridFunction(points) for _ in range(3))
        v = self.space.TestFunction()
        self.area = ng.Integrate(ng.CF(1.0), mesh)
        self.load = ng.LinearForm(v * ng.dx).Assemble().vec.FV().NumPy().copy()
        self.free = np.array(list(self.space.FreeDofs()), dtype=bool)

    def solve_at(self, deborah: float):
        """Newton's iteration from the present solution.

        Raises:
            FluidError: It failed, or the stress decreases.
        """
        self._refuse_decreasing_stress(deborah)  # up to the rates of the flow before, if slower
        for _ in range(MOST_ITERATIONS):
            change, more = self._newton_step(deborah)
            self._take(change, more, deborah)
            size = np.max(np.abs(change))
            if size < TOLERANCE:
                return self._refuse_decreasing_stress(deborah)
        raise FluidError(
            f"flow in the duct not found at De = {deborah:g} in {MOST_ITERATIONS} iterations, "
            f"last change {size:.1e} Ubar; allowed: a stress that grows with the shear rate"
        )

    def _law(self, deborah: float):
        """Viscosity, and its derivative over the shear rate, at the quadrature points."""
        grad = ng.grad(self.velocity)
        self.rate.Interpolate(ng.sqrt(grad * grad + SMALLEST_RATE**2))
        rate = self.rate.vec.FV().NumPy()
        self.eta.vec.FV().NumPy()[:] = shear_viscosity(rate.copy(), self.fluid, deborah)
        shifted = shear_viscosity(rate + 1j * COMPLEX_STEP, self.fluid, deborah)
        self.slope.vec.FV().NumPy()[:] = shifted.imag / COMPLEX_STEP / rate

    def _residual(self, deborah: float) -> NDArray:
        self._law(deborah)
        v = self.space.TestFunction()
        stress = self.eta * ng.grad(self.velocity) * ng.grad(v)
        return ng.LinearForm(stress * ng.dx(**self.rule)).Assemble().vec.FV().NumPy().copy()

    def _newton_step(self, deborah: float) -> tuple[NDArray, float]:
        """Updates of velocity and pressure gradient that keep the mean velocity at 1."""
        stress = self._residual(deborah)
        w, v = self.space.TnT()
        grad = ng.grad(self.velocity)
        form = self.eta * ng.grad(w) * ng.grad(v)
        form += self.slope * (grad * ng.grad(w)) * (grad * ng.grad(v))
        matrix = ng.BilinearForm(self.space)
        matrix += form * ng.dx(**self.rule)
        inverse = matrix.Assemble().mat.Inverse(self.space.FreeDofs(), inverse="umfpack")
        by_load, by_stress = (self._solved(inverse, vector) for vector in (self.load, stress))
        u = self.velocity.vec.FV().NumPy()
        G = float((self.area - self.load @ (u - by_stress)) / (self.load @ by_load))
        return G * by_load - by_stress, G - self.gradient

    def _solved(self, inverse, vector: NDArray) -> NDArray:
        right, found = (self.velocity.vec.CreateVector() for _ in range(2))
        right.FV().NumPy()[:] = vector
        found.data = inverse * right
        return found.FV().NumPy().copy()

    def _take(self, change: NDArray, more: float, deborah: float):
        """The largest half, quarter, ... of a step that does not increase the residual."""
        u = self.velocity.vec.FV().NumPy()
        start, G = u.copy(), self.gradient

        def size() -> float:
            wrong = self._residual(deborah) - self.gradient * self.load
            return float(np.linalg.norm(wrong[self.free]))

        before = math.inf if G == 0 else size()
        for halvings in range(MOST_HALVINGS):
            share = 0.5**halvings
            u[:], self.gradient = start + share * change, G + share * more
            if size() <= max(before, TOLERANCE):
                return

    def _refuse_decreasing_stress(self, deborah: float):
        rates = np.linspace(0.0, float(np.max(self.rate.vec.FV().NumPy())), 2000)
        stress = shear_viscosity(rates, self.fluid, deborah) * rates
        if np.any(np.diff(stress) < -PERMITTED_DECREASE):
            raise FluidError(
                f"shear stress is not a monotonic function of the shear rate at De = {deborah:g}; "
                "allowed: mobility up to 1/2, or enough solvent"
            )
