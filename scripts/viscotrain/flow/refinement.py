"""Error of the velocities of the spheres, estimated element by element, and meshes that reduce it.

A goal is a number J(x) = j . x of the unknowns x: the velocity of a sphere, or the relative
velocity of two neighbours. With the solution x_l of the order below, embedded in the space of the
order k, the residual R of order k and the adjoint solution z, (dR/dx)^T z = j,

    J(x_k) - J(x_l) = -z . R(x_l) + second order = sum over elements K of eta_K

(dual-weighted residual in a hierarchical basis; R. Becker & R. Rannacher, Acta Numerica 10, 2001,
1; R. E. Bank & R. K. Smith, SIAM J. Numer. Anal. 30, 1993, 921). Only the unknowns that order k
adds contribute, because x_l makes the others vanish. So eta_K is the share of K in the error of the
order below. In the order k itself it is smaller by what one more order gains in both factors, the
solution and the adjoint one, each measured by how the conformation in K decays from degree k - 2 to
degree k - 1, by r_K and s_K: about 1/4 where the solution is smooth, about one in a layer that the
mesh does not resolve. The contributions e_K = eta_K r_K s_K cancel in part. Their sum, if all had
the same sign, is sum |e_K|, and if the signs were independent (sum e_K^2)^(1/2); in between

    error of J = `SAFETY` [sum |e_K| (sum e_K^2)^(1/2)]^(1/2).

The new mesh has elements of such sizes h that all contribute the same. What comes from a region
goes like h^q there, what comes from one of its elements like h^(2 + q), with q between that of an
unresolved layer and that of a smooth solution, `RATES`, by how far r_K s_K is between 1 and 1/16.
"""

from collections.abc import Callable
from dataclasses import dataclass

import ngsolve
import numpy as np
from ngsolve import GridFunction
from numpy.typing import NDArray

from viscotrain.flow.discretisation import Flow
from viscotrain.flow.meshes import Sizes

SAFETY = 2.5  # measured: tests/flow/test_refinement.py
SMOOTHEST = 0.02  # r_K and s_K are not below; numerical noise decays no faster
RATES = 2.0, 4.0
SMOOTH = 1 / 16  # product of the decays of a smooth solution
FINEST, COARSEST = 0.4, 1.1  # change of the size of an element in one refinement
MESHED = 1.07  # sizes of the triangles that Netgen makes, over those asked for
MANY_ELEMENTS = 50  # an unknown that belongs to more is no unknown of an element


@dataclass(frozen=True)
class Estimate:
    """Estimated errors of one solution.

    Attributes:
        velocity: Of the velocity of the reference sphere, in Ubar.
        relative: Of the relative velocities of neighbours, along the flow, in Ubar.
        contributions: (elements,) to the error that counts: the largest of `relative`, or
            `velocity` for a single sphere.
        rates: (elements,) exponents q of the size with which these contributions fall.
    """

    velocity: float
    relative: tuple[float, ...]
    contributions: NDArray
    rates: NDArray

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
    weights[~np.fromiter(flow.free, bool, len(flow.free))] = 0.0
    elements = _Elements(flow)
    decay = elements.decay(flow.fields().psi)
    z = GridFunction(flow.space)
    found, gains = [], []
    for goal in _goals(flow):
        z.vec.data = adjoint(goal)
        gains.append(decay * elements.decay(flow.grouped(z.components).psi))
        shares = np.abs(elements.sums(z.vec.FV().NumPy() * weights))
        found.append(shares * gains[-1] ** (1 + ahead))
    totals = [SAFETY * float(np.sqrt(each.sum() * np.linalg.norm(each))) for each in found]
    relative = tuple(totals[1:])
    decisive = int(np.argmax(relative)) + 1 if relative else 0
    smoothness = np.minimum(np.log(gains[decisive]) / np.log(SMOOTH), 1.0)
    rates = RATES[0] + (RATES[1] - RATES[0]) * smoothness
    return Estimate(totals[0], relative, found[decisive], rates)


def compared(flow: Flow, below: Flow) -> Estimate:
    """The distance from the order below, in place of an estimate; without contributions."""
    differences = np.subtract(flow.relative_velocities(), below.relative_velocities())
    U, U_below = (each.sphere_velocities()[flow.geometry.reference] for each in (flow, below))
    return Estimate(abs(U - U_below), tuple(np.abs(differences)), np.array([]), np.array([]))


def refined(mesh: ngsolve.Mesh, error: Estimate, reduction: float, most: float) -> Sizes:
    """Sizes of a mesh whose error is smaller.

    Args:
        mesh: The present one.
        error: On it.
        reduction: Present error over the wanted one.
        most: Elements that the new mesh may have, about.
    """
    centres, sizes = _centres_and_sizes(mesh)
    contributions = np.maximum(error.contributions, 1e-12 * error.contributions.max())

    def factors(level: float) -> NDArray:
        return np.clip((level / contributions) ** (1 / (2 + error.rates)), FINEST, COARSEST)

    low, high = np.log([contributions.min(), contributions.max()])
    low -= 10.0
    for _ in range(50):
        factor = factors(np.exp((low + high) / 2))
        too_large = contributions @ factor**error.rates > contributions.sum() / reduction
        if too_large and (factor**-2).sum() < most:
            high = (low + high) / 2
        else:
            low = (low + high) / 2
    return Sizes(centres, sizes * factor / MESHED)


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


class _Elements:
    """Sums over unknowns, and norms, per element.

    An unknown on a side belongs to both elements by halves, and so on.
    """

    def __init__(self, flow: Flow):
        elements, unknowns = [], []
        for element in flow.mesh.Elements():
            own = [n for n in flow.space.GetDofNrs(ngsolve.ElementId(element)) if n >= 0]
            elements += [element.nr] * len(own)
            unknowns += own
        self._elements, self._unknowns = np.array(elements), np.array(unknowns)
        count = np.bincount(self._unknowns, minlength=flow.space.ndof)
        share = np.where(count <= MANY_ELEMENTS, 1 / np.maximum(count, 1), 0.0)
        self._shares, self._size = share[self._unknowns], flow.mesh.ne
        self._degree = flow.velocity_order - 1
        rule = ngsolve.IntegrationRule(ngsolve.TRIG, 2 * self._degree)
        self._points = flow.mesh.MapToAllElements(rule, ngsolve.VOL)
        self._transform, self._degrees = _orthonormal(rule, self._degree)

    def sums(self, values: NDArray) -> NDArray:
        """Sum over the unknowns of each element."""
        weights = values[self._unknowns] * self._shares
        return np.bincount(self._elements, weights=weights, minlength=self._size)

    def decay(self, modes) -> NDArray:
        """Norm of psi in its highest degree over that in the degree below, at most one."""
        components = tuple(component for psi in modes for component in psi)
        values = ngsolve.CoefficientFunction(components)(self._points)
        values = values.reshape(self._size, -1, len(components))
        coefficients = np.einsum("cp,epk->eck", self._transform, values)
        highest, below = (
            np.linalg.norm(coefficients[:, self._degrees == degree], axis=(1, 2))
            for degree in (self._degree, self._degree - 1)
        )
        return np.clip(highest / np.maximum(below, np.finfo(float).tiny), SMOOTHEST, 1.0)


def _orthonormal(rule: ngsolve.IntegrationRule, degree: int) -> tuple[NDArray, NDArray]:
    """From values at the points to coefficients of orthonormal polynomials, and their degrees."""
    x, y = np.array([point[:2] for point in rule.points]).T
    powers = [(n - j, j) for n in range(degree + 1) for j in range(n + 1)]
    root = np.sqrt(rule.weights)
    orthonormal, _ = np.linalg.qr(np.stack([root * x**i * y**j for i, j in powers], axis=1))
    return orthonormal.T * root, np.array([i + j for i, j in powers])


def _centres_and_sizes(mesh: ngsolve.Mesh) -> tuple[NDArray, NDArray]:
    """Centres (n, 2) of the elements, and the sides (n,) of equilateral triangles as large."""
    corners = np.array(
        [[mesh[vertex].point for vertex in element.vertices] for element in mesh.Elements()]
    )
    (z1, r1), (z2, r2) = (corners[:, n].T - corners[:, 0].T for n in (1, 2))
    return corners.mean(axis=1), np.sqrt(np.abs(z1 * r2 - z2 * r1) * 2 / np.sqrt(3))
