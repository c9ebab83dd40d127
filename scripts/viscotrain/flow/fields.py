"""Fields of one solution: sampled on an even grid for figures, or as VTU for ParaView."""

from pathlib import Path

import ngsolve
import numpy as np
import xarray as xr
from ngsolve import ET, VOL, IntegrationRule, VTKOutput

from viscotrain.flow import giesekus
from viscotrain.flow.axisymmetry import Tensor, r, z
from viscotrain.flow.discretisation import Flow
from viscotrain.fluid.parameters import CHANNEL_RADIUS

STEP = 0.005  # of the grid, in D, about
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
    "edge_z": "z of points along the edges of the elements",
    "edge_r": "r of points along the edges of the elements",
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
    """Values on an even grid of about `STEP`, from end to end and from the axis to the wall.

    Returns:
        Dataset over (r, z) with the variables of `NAMES`, NaN in the spheres, `edge_z` and `edge_r`
        (edge, edge_point), the polylines of the element edges, and `sphere_position` (sphere).
    """
    length = flow.geometry.length
    places = {
        "r": np.linspace(0.0, CHANNEL_RADIUS, round(CHANNEL_RADIUS / STEP) + 1),
        "z": np.linspace(0.0, length, round(length / STEP) + 1),
    }
    radius, along = np.meshgrid(*places.values(), indexing="ij")
    points = flow.mesh(along.ravel(), radius.ravel())
    found = points["nr"] >= 0  # the others are in spheres
    sampled = {}
    for name, f in quantities(flow).items():
        values = np.full(found.size, np.nan)
        values[found] = np.asarray(f(points[found])).ravel()
        sampled[name] = (("r", "z"), values.reshape(along.shape), _attributes(name))
    return xr.Dataset(
        sampled
        | {
            name: (("edge", "edge_point"), values, _attributes(name))
            for name, values in zip(("edge_z", "edge_r"), _edges(flow.mesh), strict=True)
        }
        | {
            "sphere_position": (
                "sphere",
                list(flow.geometry.positions),
                {"long_name": "position of the centre over channel diameter", "units": "1"},
            ),
        },
        coords={name: (name, values, _attributes(name)) for name, values in places.items()}
        | {"sphere": list(flow.geometry.spheres)},
    )


def _edges(mesh: ngsolve.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Z and r of points along the three edges of every element, shape (edge, edge_point)."""
    share = np.linspace(0.0, 1.0, SUBDIVISION + 1)
    sides = np.concatenate(
        [np.stack(side, axis=1) for side in ((share, 0 * share), (0 * share, share))]
        + [np.stack([share, 1 - share], axis=1)]
    )
    rule = IntegrationRule(points=[tuple(point) for point in sides], weights=[0.0] * len(sides))
    points = mesh.MapToAllElements({ET.TRIG: rule}, VOL)
    shape = -1, SUBDIVISION + 1
    return np.asarray(z(points)).reshape(shape), np.asarray(r(points)).reshape(shape)


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
