"""Error of the velocities of the spheres, by the order above, and meshes that reduce it.

A goal is a number J(x) = j . x of the unknowns x: the velocity U of a sphere, or the relative
velocity of two neighbours. U counts, too: relative velocities of triplets are interpolated from U
of pairs, and those in a train are differences of U of triplets, whose errors are common in part.

The solution x_k of order k is embedded in the space of the order above. A few updates of its
iteration there, with one matrix, change J by what that order adds: a distance with a sign
(hierarchical estimate; R. E. Bank & R. K. Smith, SIAM J. Numer. Anal. 30, 1993, 921). It can be
small by chance, and says nothing of what further orders add. With the residual R and the adjoint
solution z of that order, (dR/dx)^T z = j, the first of them is a sum over elements K,

    J(x_k+1) - J(x_k) = -z . R(x_k) + second order = sum over K of eta_K

(dual-weighted residual; R. Becker & R. Rannacher, Acta Numerica 10, 2001, 1). Most of it cancels,
since errors are transported; as if the signs were random,

    error of J = `SEEN` |J(x_k+1) - J(x_k)| + `UNSEEN` [sum over K of eta_K^2]^(1/2).

Both factors are fitted to true errors (docs/accuracy.md). One more order divides the contribution
of K by what the solution and the adjoint solution gain, each as the conformation in K decays from
the degree below the highest to the highest, by r_K and s_K: about 1/4 where the solution is smooth,
about one in a layer that the mesh does not resolve. So it multiplies the error by about the mean of
r_K s_K, weighted with |eta_K|, to the power `GAIN_POWER`. Where orders gain little, as at high De,
a result is taken from the order that was looked at, whose matrix there is (`promised`): its error
is about half, and known as well.

The new mesh has elements of such sizes h that all contribute the same, each to the goal that it
contributes most to: what is fine enough for one velocity need not be so for another. What comes
from one element goes like h^(2 + q), with q between that of an unresolved layer and that of a
smooth solution, `RATES`, by how far r_K s_K is between 1 and 1/16.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import ngsolve
import numpy as np
from ngsolve import GridFunction
from numpy.typing import NDArray

from viscotrain.flow.discretisation import Flow
from viscotrain.flow.meshes import Sizes
from viscotrain.flow.newton import ModifiedNewton

SEEN, UNSEEN = 5.0, 1.0  # fitted to true errors (docs/accuracy.md)
OF_VELOCITY = 0.5  # what an error of U counts in a triplet, beside those of relative velocities
UPDATES = 4  # in the order above: goals settle well before the rest does
SMOOTHEST = 0.02  # r_K and s_K are not below; numerical noise decays no faster
RATES = 0.5, 3.0
SMOOTH = 1 / 16  # product of the decays of a smooth solution
FINEST, COARSEST = 0.4, 1.0  # change of the size of an element in one refinement
MESHED = 1.07  # sizes of the triangles that Netgen makes, over those asked for
RESERVE = 3.0  # error on a new mesh over what its sizes promise
LEAST_REDUCTION = 2.0  # of an error that remains too large, for which a new mesh is made
LEAST_GAIN = 1.3  # the same, for which a higher order is solved
ANOTHER_MESH = 1.5  # cost on a new mesh, which may not keep its promise, over that on the same
GAIN_POWER = 0.5  # of the mean of r_K s_K: what one more order has been seen to gain
SLOW_GAIN = 0.45  # from which on one more order has been seen to gain the root of this
ORDERS_BELOW = 3  # on a new mesh, that are solved before the one to end with
LOWEST_ORDER = 3  # that a new mesh is solved in first
ABOUT = 1.1  # unknowns that there may be, over those that a mesh is made for
MANY_ELEMENTS = 50  # an unknown that belongs to more is no unknown of an element


class Limits(NamedTuple):
    """Highest order of the velocity, and number of unknowns, that may be used, about."""

    order: int
    unknowns: float


@dataclass(frozen=True)
class Estimate:
    """Estimated errors of one solution.

    Attributes:
        order: Of the velocity.
        velocity: Of the velocity of the reference sphere, in Ubar.
        relative: Of the relative velocities of neighbours, along the flow, in Ubar.
        contributions: (elements,) to the error that counts, `decisive`; empty if they are not
            known.
        rates: (elements,) exponents q of the size with which these fall.
        gain: Error in the next order over that in this one, about.
    """

    order: int
    velocity: float
    relative: tuple[float, ...]
    contributions: NDArray
    rates: NDArray
    gain: float

    @property
    def decisive(self) -> float:
        """The error that counts: of relative velocities and of U, that by half in triplets."""
        totals = [self.velocity, *self.relative]
        return float(max(_counts(len(totals)) * totals))

    def ahead(self, order: int) -> float:
        """What `decisive` is in this order or a higher one on the same mesh, about."""
        return self.decisive * self.gain ** (order - self.order)


class Plan(NamedTuple):
    """How to become more accurate: an order, and sizes of another mesh unless it is fine enough."""

    order: int
    sizes: Sizes | None


def estimate(flow: Flow, above: Flow, iteration: ModifiedNewton) -> Estimate:
    """Estimate the errors of a solution.

    Args:
        flow: Its state is the solution.
        above: The same in the order above; its state is the solution, embedded.
        iteration: Of the viscoelastic flow in that order; begins there.

    Raises:
        FactorisationError: Its matrix is singular.
    """
    residual, change = iteration.look(above.state, UPDATES)
    elements, decays = _Elements(above), _Decays(above)
    decay = _Decays(flow).of(flow.fields().psi)
    z = GridFunction(above.space)
    totals, found = [], []
    for goal in _goals(above):
        z.vec.data = iteration.adjoint(goal)
        shares = np.abs(elements.sums(z.vec.FV().NumPy() * residual.FV().NumPy()))
        gains = decay * decays.of(above.grouped(z.components).psi)
        found.append((shares, gains))
        seen = abs(ngsolve.InnerProduct(goal, change))
        totals.append(SEEN * seen + UNSEEN * float(np.linalg.norm(shares)))
    counts = _counts(len(totals))
    shares, gains = np.array(found).swapaxes(0, 1)
    decisive = int(np.argmax(counts * totals))
    mean_gain = float(shares[decisive] @ gains[decisive] / shares[decisive].sum())
    largest = np.argmax(counts[:, None] * shares, axis=0), np.arange(flow.mesh.ne)
    smoothness = np.minimum(np.log(gains[largest]) / np.log(SMOOTH), 1.0)
    return Estimate(
        order=flow.velocity_order,
        velocity=totals[0],
        relative=tuple(totals[1:]),
        contributions=(counts[:, None] * shares)[largest],
        rates=RATES[0] + (RATES[1] - RATES[0]) * smoothness,
        gain=mean_gain**GAIN_POWER,
    )


def compared(flow: Flow, below: Flow) -> Estimate:
    """The distance from the order below, in place of an estimate; without contributions."""
    differences = np.subtract(flow.relative_velocities(), below.relative_velocities())
    reference = flow.geometry.reference
    assert reference is not None  # there are spheres
    U, U_below = (each.sphere_velocities()[reference] for each in (flow, below))
    none = np.array([])
    return Estimate(
        flow.velocity_order, abs(U - U_below), tuple(np.abs(differences)), none, none, math.nan
    )


def promised(error: Estimate | None, limits: Limits) -> Estimate | None:
    """Errors of the order that was looked at, where orders gain so little that they can be told.

    Where one gains more, the next is often better by far than what can be promised.
    """
    if error is None or error.order >= limits.order or not error.gain >= SLOW_GAIN:
        return None
    factor = math.sqrt(error.gain)
    return replace(
        error,
        order=error.order + 1,
        velocity=factor * error.velocity,
        relative=tuple(factor * each for each in error.relative),
        contributions=factor * error.contributions,
    )


def plan(
    flow: Flow, error: Estimate, allowed: float, limits: Limits, remesh: bool = True
) -> Plan | None:
    """The order and the mesh that promise the accuracy, or to come closest, at the least cost.

    Args:
        flow: On the present mesh.
        error: In the present order.
        allowed: Error to reach.
        limits: Of orders and unknowns.
        remesh: Whether another mesh may be made.

    Returns:
        None if nothing within the limits promises to be much more accurate.
    """
    orders = range(error.order, max(limits.order, error.order) + 1)
    plans = [_same_mesh(order, flow, error, allowed, limits) for order in orders[1:]]
    if remesh:
        plans += [_another_mesh(order, flow, error, allowed, limits) for order in orders]
    promising = [each for each in plans if each is not None]
    if not promising:
        return None
    return min(promising, key=lambda each: each[0])[-1]


# How much too large the error remains, and the cost; and the plan.
_Valued = tuple[tuple[float, float], Plan]


def _same_mesh(
    order: int, flow: Flow, error: Estimate, allowed: float, limits: Limits
) -> _Valued | None:
    """A plan with a higher order on the same mesh."""
    modes, left = len(flow.fluid.modes), error.ahead(order)
    if flow.mesh.ne * unknowns_per_element(order, modes) > ABOUT * limits.unknowns:
        return None
    if left > max(allowed, error.decisive / LEAST_GAIN):
        return None
    orders = range(error.order + 2, order + 2)
    return (max(left / allowed, 1.0), _cost(flow.mesh.ne, orders, modes)), Plan(order, None)


def _another_mesh(
    order: int, flow: Flow, error: Estimate, allowed: float, limits: Limits
) -> _Valued | None:
    """A plan with this order on a new mesh."""
    modes = len(flow.fluid.modes)
    most = limits.unknowns / unknowns_per_element(order, modes)
    sizes, elements, left = refined(flow.mesh, error, order, allowed, most)
    if left > max(allowed, error.decisive / LEAST_REDUCTION) or elements > 1.01 * most:
        return None
    cost = ANOTHER_MESH * _cost(elements, range(first_order(order), order + 2), modes)
    return (max(left / allowed, 1.0), cost), Plan(order, sizes)


def _cost(elements: float, orders: Iterable[int], modes: int) -> float:
    """About: of factorisations in these orders."""
    return elements * sum(unknowns_per_element(k, modes) ** 1.5 for k in orders)


def first_order(order: int) -> int:
    """In which a new mesh is solved first, if it is made for this order."""
    return min(max(LOWEST_ORDER, order - ORDERS_BELOW), order - 1)


def unknowns_per_element(order: int, modes: int) -> float:
    """About; continuous polynomials of degree k have k^2/2 an element, u two, psi four a mode."""
    return (2 * order**2 + (1 + 4 * modes) * (order - 1) ** 2) / 2


def refined(
    mesh: ngsolve.Mesh, error: Estimate, order: int, allowed: float, most: float
) -> tuple[Sizes, float, float]:
    """A mesh with elements of such sizes that the error in some order is smaller.

    Args:
        mesh: The present one.
        error: On it.
        order: To be solved in.
        allowed: Error to reach.
        most: Elements that the new mesh may have, about.

    Returns:
        Sizes, number of elements, and the error to expect.
    """
    centres, sizes = _centres_and_sizes(mesh)
    contributions = np.maximum(error.contributions, 1e-12 * error.contributions.max())
    rates, wanted = error.rates, min(allowed, error.decisive / LEAST_REDUCTION)

    def attempt(level: float) -> tuple[NDArray, float, float]:
        """Changes of the sizes, number of elements and error, if all contribute the same."""
        factor = np.clip((level / contributions) ** (1 / (2 + rates)), FINEST, COARSEST)
        norm = np.linalg.norm(contributions * factor ** (1 + rates))
        left = error.ahead(order) * RESERVE * norm / np.linalg.norm(contributions)
        return factor, float((factor**-2).sum()), float(left)

    low, high = np.log([contributions.min(), contributions.max()])
    low -= 10.0
    for _ in range(50):
        _, count, left = attempt(np.exp((low + high) / 2))
        if left > wanted and count < most:
            high = (low + high) / 2
        else:
            low = (low + high) / 2
    factor, count, left = attempt(np.exp(low))  # of the two ends the one that is accurate enough
    return Sizes(centres, sizes * factor / MESHED), count, left


def _goals(flow: Flow) -> list[ngsolve.BaseVector]:
    """U of the reference sphere, then the relative velocities along the flow."""
    names = flow.geometry.spheres
    assert flow.geometry.reference is not None  # there are spheres
    pairs = [(flow.geometry.reference, "wall"), *zip(names[1:], names, strict=False)]
    return [_difference(flow, one, other) for one, other in pairs]


def _counts(goals: int) -> NDArray:
    """What errors of goals count: those of U and of the relative velocities."""
    counts = np.ones(goals)
    counts[0] = OF_VELOCITY if goals > 2 else 1.0
    return counts


def _difference(flow: Flow, one: str, other: str) -> ngsolve.BaseVector:
    """The vector j of the goal u_z on one boundary minus u_z on another."""
    goal = flow.state.vec.CreateVector()
    goal[:] = 0.0
    for boundary, sign in ((one, 1.0), (other, -1.0)):
        if boundary != flow.fixed:
            goal[flow.unknown_of(boundary)] = sign
    return goal


class _Elements:
    """Sums over unknowns per element.

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

    def sums(self, values: NDArray) -> NDArray:
        """Sum over the unknowns of each element."""
        weights = values[self._unknowns] * self._shares
        return np.bincount(self._elements, weights=weights, minlength=self._size)


class _Decays:
    """How fast psi falls with the degree, per element."""

    def __init__(self, flow: Flow):
        self._degree, self._size = flow.velocity_order - 1, flow.mesh.ne
        rule = ngsolve.IntegrationRule(ngsolve.TRIG, 2 * self._degree)
        self._points = flow.mesh.MapToAllElements(rule, ngsolve.VOL)
        self._transform, self._degrees = _orthonormal(rule, self._degree)

    def of(self, modes) -> NDArray:
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
