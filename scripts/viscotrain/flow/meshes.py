"""Curved meshes of spheres in their periodic box.

The half plane 0 <= r <= 1/2 of a tube, periodic in z, less a half disk per sphere on the axis.
Lengths are in D. Boundaries have names: axis, wall, inlet, outlet, and one per sphere; elements
are small at the spheres, across the gaps, and along the axis, where strands of stretched fluid run.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import netgen.meshing
import ngsolve
import numpy as np
from netgen.occ import IdentificationType, OCCGeometry, WorkPlane, gp_Trsf, gp_Vec
from numpy.typing import NDArray

from viscotrain.flow.geometry import Geometry
from viscotrain.fluid.parameters import CHANNEL_RADIUS

FEWEST_ON_SPHERE = 6  # elements along the half circle where sizes are prescribed
LARGEST_SIZE = 1.5  # over the wall size, where sizes are prescribed


@dataclass(frozen=True)
class MeshOptions:
    """Element sizes; meaning and defaults stand in `config.models.DnsConfig`."""

    wall_size: float
    axis_size: float
    sphere_elements: int
    gap_elements: int


class Sizes(NamedTuple):
    """Sizes that a mesh should have: points (n, 2) as (z, r) and sizes (n,) there, in D."""

    points: NDArray
    sizes: NDArray


def make_mesh(
    geometry: Geometry, options: MeshOptions, order: int, sizes: Sizes | None = None
) -> ngsolve.Mesh:
    """Triangles, curved with polynomials of the given order on the spheres.

    Args:
        geometry: Spheres and periodic length.
        options: Sizes by the place.
        order: Of the curves.
        sizes: In place of `options`, but not across gaps.
    """
    if sizes is not None:
        largest = LARGEST_SIZE * options.wall_size
        options = replace(
            options, wall_size=largest, axis_size=largest, sphere_elements=FEWEST_ON_SPHERE
        )
    parameters = _sizes(geometry, options)
    if sizes is not None:
        for (z, r), size in zip(*sizes, strict=True):
            if size < options.wall_size:
                parameters.RestrictH(x=z, y=r, z=0, h=size)
    mesh = ngsolve.Mesh(_outline(geometry, options).GenerateMesh(mp=parameters))
    mesh.Curve(order)
    return mesh


def _outline(geometry: Geometry, options: MeshOptions) -> OCCGeometry:
    """The half plane with named boundaries, inlet and outlet identified."""
    plane = WorkPlane()
    for z in geometry.positions:
        plane.LineTo(z - geometry.radius, 0).Direction(0, 1).Arc(geometry.radius, -180)
        plane.Direction(1, 0)
    plane.LineTo(geometry.length, 0).LineTo(geometry.length, CHANNEL_RADIUS)
    face = plane.LineTo(0, CHANNEL_RADIUS).Close().Face()
    named = {}
    for edge in face.edges:
        edge.name = _boundary_name(geometry, edge.center.x, edge.center.y)
        named[edge.name] = edge
        if edge.name == "axis":
            edge.maxh = options.axis_size
        elif edge.name in geometry.spheres:
            edge.maxh = math.pi * geometry.radius / options.sphere_elements
    shift = gp_Trsf.Translation(gp_Vec(geometry.length, 0, 0))
    named["inlet"].Identify(named["outlet"], "periodic", IdentificationType.PERIODIC, shift)
    return OCCGeometry(face, dim=2)


def _boundary_name(geometry: Geometry, z: float, r: float) -> str:
    """Name of the edge whose centre of mass is (z, r)."""
    tiny = 1e-9
    if r < tiny:
        return "axis"
    if r > CHANNEL_RADIUS - tiny:
        return "wall"
    if z < tiny:
        return "inlet"
    if z > geometry.length - tiny:
        return "outlet"
    distances = np.abs(np.array(geometry.positions) - z)
    return geometry.spheres[int(np.argmin(distances))]


def _sizes(geometry: Geometry, options: MeshOptions) -> netgen.meshing.MeshingParameters:
    """Element size in the bulk and, at points along them, in the gaps."""
    parameters = netgen.meshing.MeshingParameters(maxh=options.wall_size, grading=0.3)
    for low, high in geometry.gaps:
        size = (high - low) / options.gap_elements
        if size < options.axis_size:
            for z in np.linspace(low, high, 2 * options.gap_elements + 1):
                parameters.RestrictH(x=z, y=0, z=0, h=size)
    return parameters
