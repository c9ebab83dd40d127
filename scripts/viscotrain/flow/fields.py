"""Fields of one solution: sampled on the curved elements for figures, or as VTU for ParaView."""

import itertools
from pathlib import Path

import ngsolve
import numpy as np
import xarray as xr
from ngsolve import ET, VOL, IntegrationRule, VTKOutput

from viscotrain.flow import giesekus
from viscotrain.flow.axisymmetry import Tensor, r, z
from viscotrain.flow.discretisation import Flow

SUBDIVISION = 4  # pieces of an element's edge in a figure
VTU_SUBDIVISION = 2  # levels of refinement in a VTU file

NAMES = {  # CF long names; lengths in D, velocities in Ubar, stresses in eta_0 Ubar/D
    "z": "position along the channel over channel diameter",
    "r": "distance to the axis over channel diameter",
    "velocity_z": "axial velocity relative to the wall over mean velocity",
    "velocity_r": "radial velocity over mean velocity",
    "pressure": "pressure over stress scale, zero mean",
    "stress_zz": "axial normal polymer stress over stress scale",
    "stress_rr": "radial normal polymer stress over stress scale",
    "stress_tt": "azimuthal normal polymer stress over stress scale",
    "stress_zr": "polymer shear stress over stress scale",
}


def quantities(flow: Flow) -> dict[str, ngsolve.CoefficientFunction]:
    """Velocity relative to the wall, pressure and polymer stress, summed over the modes."""
    state = flow.fields()
    total = [ngsolve.CoefficientFunction(0.0)] * len(Tensor._fields)
    for mode, psi in zip(flow.fluid.modes, state.psi, strict=True):
        tau = giesekus.polymer_stress(psi, mode.viscosity, flow.deborah * mode.relaxation_time)
        total = [sum_ + part for sum_, part in zip(total, tau, strict=True)]
    area = ngsolve.Integrate(1.0, flow.mesh)
    return {
        "velocity_z": state.u.z - flow.wall_speed(),
        "velocity_r": state.u.r,
        "pressure": state.p - ngsolve.Integrate(state.p, flow.mesh) / area,
        **{f"stress_{name}": tau for name, tau in zip(Tensor._fields, total, strict=True)},
    }


def sample(flow: Flow) -> xr.Dataset:
    """Values on a lattice of `SUBDIVISION` pieces per element edge, elements apart.

    Returns:
        Dataset with the variables of `NAMES` (point), `triangles` (triangle, corner) between
        points, and `edges` (edge, edge_point), the polylines of the element edges.
    """
    lattice = [(i, j) for i in range(SUBDIVISION + 1) for j in range(SUBDIVISION + 1 - i)]
    index = {node: k for k, node in enumerate(lattice)}
    reference = IntegrationRule(
        points=[(i / SUBDIVISION, j / SUBDIVISION) for i, j in lattice],
        weights=[0.0] * len(lattice),
    )
    points = flow.mesh.MapToAllElements({ET.TRIG: reference}, VOL)
    values = {"z": z, "r": r} | quantities(flow)
    offsets = len(lattice) * np.arange(flow.mesh.ne)[:, None, None]
    triangles = np.array(
        [[index[n] for n in corners] for corners in _small_triangles()], dtype=np.int32
    )
    n = SUBDIVISION
    sides = [[(k, 0) for k in range(n + 1)], [(0, k) for k in range(n + 1)]]
    sides.append([(k, n - k) for k in range(n + 1)])
    edges = np.array([[index[node] for node in side] for side in sides], dtype=np.int32)
    return xr.Dataset(
        {
            name: ("point", np.asarray(f(points)).ravel(), _attributes(name))
            for name, f in values.items()
        }
        | {
            "triangles": (
                ("triangle", "corner"),
                (offsets + triangles).reshape(-1, 3).astype(np.int32),
                {"long_name": "points at the corners of triangles"},
            ),
            "edges": (
                ("edge", "edge_point"),
                (offsets + edges).reshape(-1, n + 1).astype(np.int32),
                {"long_name": "points along the edges of the elements"},
            ),
            "sphere_position": (
                "sphere",
                list(flow.geometry.positions),
                {"long_name": "position of the centre over channel diameter", "units": "1"},
            ),
        },
        coords={"sphere": list(flow.geometry.spheres)},
    )


def _small_triangles():
    """Lattice nodes at the corners of the pieces of a triangle."""
    for i, j in itertools.product(range(SUBDIVISION), repeat=2):
        if i + j < SUBDIVISION:
            yield (i, j), (i + 1, j), (i, j + 1)
        if i + j < SUBDIVISION - 1:
            yield (i + 1, j), (i + 1, j + 1), (i, j + 1)


def _attributes(name: str) -> dict[str, str]:
    return {"long_name": NAMES[name], "units": "1"}


def write_vtu(flow: Flow, path: Path):
    """Write the fields of `quantities` as a VTU file (PATH.vtu), x = z and y = r."""
    path.parent.mkdir(parents=True, exist_ok=True)
    fields = quantities(flow)
    VTKOutput(
        flow.mesh,
        coefs=list(fields.values()),
        names=list(fields),
        filename=str(path),
        subdivision=VTU_SUBDIVISION,
        legacy=False,
    ).Do()
