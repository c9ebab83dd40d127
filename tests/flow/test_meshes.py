"""Geometry of the triplet and what its meshes promise."""

import itertools
import math

import ngsolve
import numpy as np
import pytest

from viscotrain.errors import GeometryError
from viscotrain.flow.geometry import Geometry
from viscotrain.flow.meshes import MeshOptions, make_mesh

OPTIONS = MeshOptions(wall_size=0.2, axis_size=0.07, sphere_elements=14, gap_elements=3)


@pytest.mark.parametrize(
    ("sp", "sf", "spheres"),
    [
        (1.5, 2.5, ("trailing", "middle", "leading")),
        (math.inf, 2.5, ("middle", "leading")),
        (1.5, math.inf, ("trailing", "middle")),
        (math.inf, math.inf, ("middle",)),
    ],
)
def test_distances_place_the_spheres(sp, sf, spheres):
    geometry = Geometry.triplet(0.2, sp, sf, margin=2.0)
    z = dict(zip(geometry.spheres, geometry.positions, strict=True))
    assert geometry.spheres == spheres
    if math.isfinite(sp):
        assert z["middle"] - z["trailing"] == pytest.approx(sp * 0.2)
    if math.isfinite(sf):
        assert z["leading"] - z["middle"] == pytest.approx(sf * 0.2)
    assert geometry.positions[0] == pytest.approx(2.0)
    assert geometry.length - geometry.positions[-1] == pytest.approx(2.0)


@pytest.mark.parametrize(("sp", "sf"), [(0.9, 2.0), (2.0, 1.0)])
def test_overlap_is_refused(sp, sf):
    with pytest.raises(GeometryError, match="overlap"):
        Geometry.triplet(0.2, sp, sf, margin=2.0)


def test_volume_of_the_fluid_is_exact_on_curved_elements():
    """Integral of r: tube less three spheres. Fifth-order edges, to 1e-9."""
    geometry = Geometry.triplet(0.2, 1.5, 2.5, margin=2.0)
    mesh = make_mesh(geometry, OPTIONS, order=5)
    tube, sphere = geometry.length / 8, 4 / 3 * 0.1**3 / 2
    assert ngsolve.Integrate(ngsolve.y, mesh, order=10) == pytest.approx(
        tube - 3 * sphere, abs=1e-9
    )


@pytest.mark.parametrize("confinement", [0.1, 0.2, 0.5])
@pytest.mark.parametrize("distance", [1.05, 1.2, 3.0])
def test_every_gap_holds_three_elements(confinement, distance):
    geometry = Geometry.triplet(confinement, distance, 1.5, margin=2.0)
    mesh = make_mesh(geometry, OPTIONS, order=2)
    axis = sorted(
        z
        for element in mesh.Boundaries("axis").Elements()
        for z in [np.mean([mesh[vertex].point[0] for vertex in element.vertices])]
    )
    for low, high in geometry.gaps:
        assert sum(low < z < high for z in axis) >= 3


def test_periodic_ends_have_the_same_points():
    mesh = make_mesh(Geometry.triplet(0.2, 1.5, 1.5, margin=1.5), OPTIONS, order=2)
    ends = [
        sorted(
            {
                round(mesh[vertex].point[1], 12)
                for element in mesh.Boundaries(name).Elements()
                for vertex in element.vertices
            }
        )
        for name in ("inlet", "outlet")
    ]
    assert ends[0] == pytest.approx(ends[1])
    assert all(later > earlier for earlier, later in itertools.pairwise(ends[0]))


def test_train_of_any_length_and_moved():
    train = Geometry.train(0.2, [1.5, 2.0, 3.0], margin=1.0)
    assert train.spheres == ("sphere1", "sphere2", "sphere3", "sphere4")
    assert train.reference == "sphere2"
    assert train.positions == pytest.approx([1.0, 1.3, 1.7, 2.3])
    assert train.length == pytest.approx(3.3)
    moved = train.moved([7.0, 7.5, 8.0, 9.0])
    assert moved.positions == pytest.approx([1.0, 1.5, 2.0, 3.0])
    assert (moved.spheres, moved.reference, moved.length) == (train.spheres, "sphere2", 4.0)
