"""A mesh that follows spheres along the axis (ALE), and the transfer of fields to a new one.

In the frame of the reference sphere the mesh is displaced along z by what the gaps have changed:
linearly across each gap and between the outer spheres and the periodic ends, which keep their
distance. The displacement is linear on each triangle, so every sphere is displaced rigidly. Points
of the mesh move with

    w = sum_i W_i phi_i,      W_i = U_i - U_reference,      phi_i = 1 on sphere i, 0 on all others.

What spheres do must not depend on w in between: any profile that rises from 0 to 1 will do.
"""

from collections.abc import Callable, Sequence

import ngsolve
import numpy as np
from ngsolve import H1, Periodic, VectorH1, dx
from ngsolve.comp import IntegrationRuleSpace
from numpy.typing import NDArray

from viscotrain.errors import SolutionError
from viscotrain.flow.axisymmetry import Velocity, r, z
from viscotrain.flow.discretisation import Flow

PLACED = 1e-11  # accuracy of places in the undeformed mesh, in D
PLACING_STEPS = 100

Profile = Callable[[NDArray], NDArray]  # from [0, 1] to [0, 1], rising


def linear(t: NDArray) -> NDArray:
    """The profile that stretches a gap evenly."""
    return t


def smooth_step(t: NDArray) -> NDArray:
    """A profile without kinks at the spheres."""
    return t * t * (3 - 2 * t)


class MovingMesh:
    """Displaces the mesh of a flow.

    Args:
        flow: Its geometry is that of the undeformed mesh.
        profile: How phi rises to a sphere, from the ones beside it or from the periodic ends.
    """

    def __init__(self, flow: Flow, profile: Profile = linear):
        self.flow, self._profile = flow, profile
        geometry = flow.geometry
        names = list(geometry.spheres)
        self._reference = None if geometry.reference is None else names.index(geometry.reference)
        self._moving = [k for k in range(len(names)) if k != self._reference]
        self._shapes = [self._shape(k) for k in self._moving]
        self._displacement = ngsolve.GridFunction(VectorH1(flow.mesh, order=1))

    def _shape(self, k: int) -> ngsolve.GridFunction:
        """Shape phi of sphere k: linear on triangles, the profile in z at the vertices."""
        shape = ngsolve.GridFunction(H1(self.flow.mesh, order=1))
        at_vertices = np.array([vertex.point[0] for vertex in self.flow.mesh.vertices])
        only_k = _around(np.eye(len(self.flow.geometry.spheres))[k])
        line = np.interp(at_vertices, np.ravel(self.flow.geometry.free_axis), only_k)
        shape.vec.FV().NumPy()[:] = self._profile(line)
        return shape

    @property
    def reference_position(self) -> float:
        """Of the reference sphere in the box, in D."""
        assert self._reference is not None  # without spheres nothing is asked
        return self.flow.geometry.positions[self._reference]

    def velocity(self, speeds: Sequence) -> Velocity:
        """Velocity w of the mesh from the speeds of the moving spheres."""
        w = 0.0
        for speed, shape in zip(speeds, self._shapes, strict=True):
            w = w + speed * shape
        return Velocity(z=w, r=0.0)

    def _changes(self, positions: NDArray) -> NDArray:
        """By how much the spheres are farther from the reference sphere than in the mesh."""
        changes = positions - np.array(self.flow.geometry.positions)
        return changes - changes[self._reference] if changes.size else changes

    def displace(self, positions: NDArray):
        """Bring the mesh to the distances of these positions, in D, in any frame."""
        along = self._displacement.components[0].vec.FV().NumPy()
        along[:] = 0.0
        for change, shape in zip(self._changes(positions)[self._moving], self._shapes, strict=True):
            along += change * shape.vec.FV().NumPy()
        self.flow.mesh.SetDeformation(self._displacement)

    def stretch(self, positions: NDArray) -> float:
        """Largest factor, or inverse factor, of a piece of the free axis over the undeformed one.

        Infinite if spheres overlap.
        """
        axis = self.flow.geometry.free_axis
        factors = 1 + np.diff(_around(self._changes(positions)))[::2] / np.diff(axis).ravel()
        return max(max(factor, 1 / factor) if factor > 0 else np.inf for factor in factors)

    def places(self, positions: NDArray, z_now: NDArray, r_now: NDArray):
        """Points of the undeformed mesh that come to (z_now, r_now) with these positions.

        Args:
            positions: Of the spheres, in D, in any frame.
            z_now: In the box of the mesh, or a period away from it.
            r_now: Distance to the axis.

        Raises:
            SolutionError: They are not found.
        """
        geometry = self.flow.geometry
        self.displace(positions)
        self.flow.mesh.UnsetDeformation()
        knots = np.ravel(geometry.free_axis)
        changes = _around(self._changes(positions))
        slopes = np.diff(changes) / np.diff(knots)
        goal = np.mod(z_now, geometry.length)
        at = np.interp(goal, knots + changes, knots)
        for _ in range(PLACING_STEPS):
            found = np.ravel(self._displacement.components[0](self.flow.mesh(at, r_now)))
            missed = goal - at - found
            if np.abs(missed).max() < PLACED:
                return self.flow.mesh(at, r_now)
            at += missed / (1 + slopes[np.searchsorted(knots, at).clip(1, slopes.size) - 1])
        raise SolutionError("remeshing: places in the old mesh were not found")


def _around(on_spheres: NDArray) -> NDArray:
    """Values at both ends of each piece of the free axis."""
    return np.concatenate([[0.0], np.repeat(on_spheres, 2), [0.0]])


def transfer_stress(old: MovingMesh, new: MovingMesh, positions: NDArray):
    """Set psi of the new flow to that of the old one at the same places, by L2 projection.

    c_zr stays 0 on the axis: values there are no unknowns, so that no later step would mend them.

    Args:
        old: The state of its flow is read; its mesh is left undeformed.
        new: The psi of the state of its flow is set; its mesh is left at the positions.
        positions: Of the spheres at the time of that state, in D.
    """
    new.displace(positions)
    mesh, order = new.flow.mesh, new.flow.velocity_order - 1
    points = IntegrationRuleSpace(mesh, order=2 * order)
    rules, values = points.GetIntegrationRules(), ngsolve.GridFunction(points)
    now = []
    for coordinate in (z, r):
        values.Interpolate(coordinate)
        now.append(values.vec.FV().NumPy().copy())
    shift = old.reference_position - new.reference_position
    places = old.places(positions, now[0] + shift, now[1])
    space = Periodic(H1(mesh, order=order))
    trial, test = space.TnT()
    mass = ngsolve.BilinearForm(trial * test * dx).Assemble()
    for source, target in zip(
        [part for psi in old.flow.fields().psi for part in psi],
        [part for psi in new.flow.fields().psi for part in psi],
        strict=True,
    ):
        values.vec.FV().NumPy()[:] = np.ravel(source(places))
        load = ngsolve.LinearForm(values * test * dx(intrules=rules)).Assemble()
        inverse = mass.mat.Inverse(target.space.FreeDofs(), inverse="umfpack")
        target.vec.data = inverse * load.vec
