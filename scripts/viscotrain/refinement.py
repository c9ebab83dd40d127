"""Error of the velocities of the spheres, estimated element by element, and meshes that reduce it.

A goal is a number J(x) = j . x of the unknowns x: the velocity of a sphere, or the relative
velocity of two neighbours. With the solution x_l of the order below, embedded in the space of the order k,
the residual R of order k and the adjoint solution z, (dR/dx)^T z = j,

    J(x_k) - J(x_l) = -z . R(x_l) + second order = sum over elements K of eta_K

(dual-weighted residual in a hierarchical basis; R. Becker & R. Rannacher, Acta Numerica 10, 2001,
1; R. E. Bank & R. K. Smith, SIAM J. Numer. Anal. 30, 1993, 921). Only the unknowns that order k
adds contribute, because x_l makes the others vanish. So eta_K is the share of K in the error of the
order below. In the order k itself it is smaller by what one more order gains in both factors, the
solution and the adjoint one, each measured by how the conformation in K decays from its degree
k - 2 to its degree k - 1, r_K and s_K:

    error of J = `SAFETY` sum_K |eta_K| r_K s_K.

Where the solution is smooth r_K and s_K are about 1/4; in a layer that the mesh does not resolve
they are about one. The sum has no signs, so errors that cancel are no surprise to it.

The new mesh has elements of such sizes h that all contribute the same: the contribution of an
element goes like h^(2 + RATE), the sum like h^RATE.
"""

from collections.abc import Callable
from dataclasses import dataclass

import ngsolve
import numpy as np
from ngsolve import L2, GridFunction, Integrate
from numpy.typing import NDArray

from viscotrain.axisymmetry import r
from viscotrain.flow import Flow
from viscotrain.meshes import Sizes

SAFETY = 2.0
SMOOTHEST = 0.02  # r_K and s_K are not below; numerical noise decays no faster
RATE = 3.0
FINEST, COARSEST = 0.4, 1.5  # change of the size of an element in one refinement
MANY_ELEMENTS = 50  # an unknown that belongs to more is no unknown of an element


@dataclass(frozen=True)
class Estimate:
    """Estimated errors of one solution.

    Attributes:
        velocity: Of the velocity of the reference sphere, in Ubar.
        relative: Of the relative velocities of neighbours, along the flow, in Ubar.
        contributions: (elements,) of the error that counts: the largest of `relative`, or
            `velocity` for a single sphere.
    """

    velocity: float
    relative: tuple[float, ...]
    contributions: NDArray

    @property
    def decisive(self) -> float:
        """The error that counts: that of the relative velocities, of U for a single sphere."""
        return max(self.relative, default=self.velocity)


def estimate(
    flow: Flow,
    below: ngsolve.BaseVector,
    adjoint: Callable[[ngsolve.BaseVector], ngsolve.BaseVector],
    ahead: int = 0,
) -> Estimate:
    """Estimate the errors of a solution.

    Args:
        flow: Its state is the solution; at least of order 3.
        below: Solution in the order below, embedded in the space of the flow.
        adjoint: Solves with the transposed matrix of the linearised viscoelastic residual.
        ahead: Estimate the errors in an order higher by so much.
    """
    residual = flow.state.vec.CreateVector()
    flow.viscoelastic.Apply(below, residual)
    weights = residual.FV().NumPy().copy()
    weights[~_mask(flow.free)] = 0.0
    of_element = _Elements(flow)
    decay = _decay(flow, flow.fields().psi)
    z = GridFunction(flow.space)
    found = []
    for goal in _goals(flow):
        z.vec.data = adjoint(goal)
        shares = np.abs(of_element.sums(z.vec.FV().NumPy() * weights))
        gain = decay * _decay(flow, flow.grouped(z.components).psi)
        found.append(SAFETY * shares * gain ** (1 + ahead))
    totals = [float(shares.sum()) for shares in found]
    relative = tuple(totals[1:])
    decisive = int(np.argmax(relative)) + 1 if relative else 0
    return Estimate(totals[0], relative, found[decisive])


def compared(flow: Flow, below: Flow) -> Estimate:
    """The distance from the order below, in place of an estimate; without contributions."""
    differences = np.subtract(flow.relative_velocities(), below.relative_velocities())
    U, U_below = (each.sphere_velocities()[flow.geometry.reference] for each in (flow, below))
    return Estimate(abs(U - U_below), tuple(np.abs(differences)), np.array([]))


def refined(mesh: ngsolve.Mesh, contributions: NDArray, reduction: float, most: float) -> Sizes:
    """Sizes of a mesh whose error is smaller.

    Args:
        mesh: The present one.
        contributions: (elements,) to the error.
        reduction: Present error over the wanted one.
        most: Elements that the new mesh may have, about.
    """
    centres, sizes = _centres_and_sizes(mesh)
    contributions = np.maximum(contributions, 1e-12 * contributions.max())

    def factors(level: float) -> NDArray:
        return np.clip((level / contributions) ** (1 / (2 + RATE)), FINEST, COARSEST)

    low, high = np.log([contributions.min(), contributions.max()])
    low -= 10.0
    for _ in range(50):
        factor = factors(np.exp((low + high) / 2))
        too_large = contributions @ factor**RATE > contributions.sum() / reduction
        if too_large and (factor**-2).sum() < most:
            high = (low + high) / 2
        else:
            low = (low + high) / 2
    return Sizes(centres, sizes * factor)


def _goals(flow: Flow) -> list[ngsolve.BaseVector]:
    """U of the reference sphere, then the relative velocities along the flow."""
    names = flow.geometry.spheres
    pairs = [(flow.geometry.reference, "wall"), *zip(names[1:], names, strict=False)]
    return [_difference(flow, one, other) for one, other in pairs]


def _difference(flow: Flow, one: str, other: str) -> ngsolve.BaseVector:
    """The vector j of the goal u_z on one boundary minus u_z on another."""
    goal = flow.state.vec.CreateVector()
    goal[:] = 0.0
    for boundary, sign in ((one, 1.0), (other, -1.0)):
        if boundary != flow.fixed:
            goal[flow.unknown_of(boundary)] = sign
    return goal


def _mask(free: ngsolve.BitArray) -> NDArray:
    return np.fromiter(free, dtype=bool, count=len(free))


class _Elements:
    """Which unknowns belong to which element; those on a side belong to both by halves."""

    def __init__(self, flow: Flow):
        elements, unknowns = [], []
        for element in flow.mesh.Elements():
            own = [n for n in flow.space.GetDofNrs(ngsolve.ElementId(element)) if n >= 0]
            elements += [element.nr] * len(own)
            unknowns += own
        self._elements, self._unknowns = np.array(elements), np.array(unknowns)
        count = np.bincount(self._unknowns, minlength=flow.space.ndof)
        share = np.where((count > 0) & (count <= MANY_ELEMENTS), 1 / np.maximum(count, 1), 0.0)
        self._shares, self._size = share[self._unknowns], flow.mesh.ne

    def sums(self, values: NDArray) -> NDArray:
        """Sum over the unknowns of each element."""
        return np.bincount(
            self._elements, weights=values[self._unknowns] * self._shares, minlength=self._size
        )


def _decay(flow: Flow, modes) -> NDArray:
    """Per element, the norm of psi in its highest degree over that in the degree below."""
    degree = flow.velocity_order - 1
    highest = below = 0.0
    for component in (component for psi in modes for component in psi):
        lower, lowest = (
            GridFunction(L2(flow.mesh, order=order)) for order in (degree - 1, degree - 2)
        )
        lower.Set(component)
        lowest.Set(component)
        highest += (component - lower) ** 2
        below += (lower - lowest) ** 2
    highest, below = (
        Integrate((part * r).Compile(), flow.mesh, element_wise=True, order=2 * degree).NumPy()
        for part in (highest, below)
    )
    ratio = np.sqrt(np.maximum(highest, 0.0) / np.maximum(below, np.finfo(float).tiny))
    return np.clip(ratio, SMOOTHEST, 1.0)


def _centres_and_sizes(mesh: ngsolve.Mesh) -> tuple[NDArray, NDArray]:
    """Centres (n, 2) of the elements, and the sides (n,) of equilateral triangles as large."""
    corners = np.array(
        [[mesh[vertex].point for vertex in element.vertices] for element in mesh.Elements()]
    )
    (z1, r1), (z2, r2) = (corners[:, n].T - corners[:, 0].T for n in (1, 2))
    return corners.mean(axis=1), np.sqrt(np.abs(z1 * r2 - z2 * r1) * 2 / np.sqrt(3))


