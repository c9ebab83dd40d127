"""The dns stage for one geometry: from settings to what is solved, logged and stored.

A point that does not converge is a result: NaN with a status and the reason, and the points above
it in De, which continuation cannot reach, are marked as not attempted. A point that is, by the
estimate of its error, not accurate keeps its velocities and has a status of its own. The
conformation exp(psi) is positive definite whatever psi is, so losing definiteness is no way to
fail; a number that is not finite is, and `newton` checks for it.
"""

import math
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import ngsolve
import numpy as np
import pandas as pd
import xarray as xr

from viscotrain.config.names import geometry_name, number_name
from viscotrain.config.settings import FlowSettings
from viscotrain.errors import FluidError, SolutionError
from viscotrain.flow import fields, quasi_steady
from viscotrain.flow.discretisation import Flow
from viscotrain.flow.geometry import Geometry
from viscotrain.flow.meshes import MeshOptions, Sizes, make_mesh
from viscotrain.fluid.pipe import PipeFlow, pipe_flow, polymer_stress
from viscotrain.table.attributes import ATTRIBUTES
from viscotrain.words import INACCURATE, NOT_ATTEMPTED, NOT_CONVERGED, PAIRS, PARTICLES, SOLVED

Report = Callable[[str], None]
OWN_ATTRIBUTES = {
    "pressure_gradient": {
        "long_name": "minus mean pressure gradient over the periodic length, "
        "over zero-shear viscosity times mean velocity over squared channel diameter",
        "units": "1",
    },
    "undisturbed_pressure_gradient": {
        "long_name": "the same of the flow without spheres",
        "units": "1",
    },
    "residual": {"long_name": "rms residual before the last update", "units": "1"},
    "iterations": {"long_name": "iterations since the Deborah number before", "units": "1"},
    "velocity_order": {"long_name": "polynomial order of the velocity", "units": "1"},
    "elements": {"long_name": "elements of the mesh", "units": "1"},
    "unknowns": {"long_name": "unknowns of the discrete problem", "units": "1"},
    "length": {"long_name": "periodic length over channel diameter", "units": "1"},
    "confinement": {"long_name": "sphere over channel diameter", "units": "1"},
    "reason": {"long_name": "why there is no solution, or none that is accurate"},
}

SPHERE_VELOCITY = {"long_name": "velocity of a sphere over mean velocity", "units": "1"}


def triplet(study: FlowSettings, sp: float, sf: float) -> Geometry:
    """The triplet in the periodic box that the study asks for."""
    return Geometry.triplet(study.confinement, sp, sf, study.dns.margin)


def mesh_options(study: FlowSettings) -> MeshOptions:
    """Sizes of the mesh that a simulation starts with."""
    sizes = study.dns
    return MeshOptions(
        sphere_elements=sizes.sphere_elements,
        axis_size=sizes.axis_size,
        wall_size=sizes.wall_size,
        gap_elements=sizes.gap_elements,
    )


def mesh_of(study: FlowSettings, geometry: Geometry, sizes: Sizes | None = None) -> ngsolve.Mesh:
    """Mesh of one geometry, with the sizes of the config or with others."""
    curves = max(study.dns.velocity_order, quasi_steady.NEWTONIAN_ORDER)
    return make_mesh(geometry, mesh_options(study), curves, sizes)


def make_flow(study: FlowSettings, geometry: Geometry) -> Flow:
    """Unknowns of one geometry on the mesh that a simulation starts with."""
    mesh = mesh_of(study, geometry)
    return Flow(geometry, mesh, study.known_fluid, study.dns.velocity_order)


def solver_options(study: FlowSettings) -> quasi_steady.SolverOptions:
    """The solver's part of the config."""
    return quasi_steady.SolverOptions(
        tolerance=study.dns.tolerance,
        max_iterations=study.dns.max_iterations,
        deborah_step=study.dns.deborah_step,
        accuracy=study.dns.accuracy,
        relative_accuracy=study.dns.relative_accuracy,
        max_velocity_order=study.dns.max_velocity_order,
        max_unknowns=study.dns.max_unknowns,
    )


def solutions(study: FlowSettings, geometry: Geometry, up_to: float = math.inf) -> Iterator:
    """(De of the config, `Solution`) of one geometry, ascending, up to a De of the config."""
    wanted = [De for De in study.deborah if De <= up_to]
    found = quasi_steady.solve(
        make_flow(study, geometry),
        [study.deborah_longest_mode(De) for De in wanted],
        solver_options(study),
        remesh=partial(mesh_of, study, geometry),
    )
    yield from zip(wanted, found, strict=False)


def solve_geometry(
    study: FlowSettings, sp: float, sf: float, report: Report, vtu_folder: Path | None = None
) -> tuple[xr.Dataset, pd.DataFrame]:
    """Solve one geometry at all Deborah numbers of the settings.

    Args:
        study: What its flows depend on.
        sp: Distance of the middle to the trailing sphere, in d, or infinite.
        sf: Distance of the leading to the middle sphere, in d, or infinite.
        report: Takes a line of text per Deborah number.
        vtu_folder: Where fields go as VTU; None for nowhere.

    Returns:
        Dataset (deborah, particle) and table of CPU seconds per Deborah number.
    """
    result = _empty(study, sp, sf)
    result.attrs = {"title": f"triplet {geometry_name(sp, sf)}"}
    seconds, last = [], None
    for De, solution in solutions(study, triplet(study, sp, sf)):
        reason = explanation(study, De, solution, last)
        report(_line(De, solution, reason))
        _insert(result, De, solution, reason)
        last = De
        seconds.append({"deborah": De, "cpu_seconds": round(solution.seconds, 3)})
        if solution.solved and vtu_folder is not None:
            fields.write_vtu(solution.flow, vtu_folder / f"De{number_name(De)}")
    timing = pd.DataFrame(seconds).assign(
        sp=sp, sf=sf, unknowns=[int(n) for n in result["unknowns"].values[: len(seconds)]]
    )
    return result, timing


def field(study: FlowSettings, sp: float, sf: float, report: Report) -> xr.Dataset:
    """Velocity, pressure and stress around one triplet at the Deborah numbers of the settings.

    Returns:
        Those of `fields.sample` over (deborah, r, z), with the mesh of the largest De, the
        velocities of the spheres, and the stress of the flow without spheres (deborah, r).

    Raises:
        SolutionError: A point did not converge.
    """
    layers, last = [], None
    for De, solution in solutions(study, triplet(study, sp, sf)):
        reason = explanation(study, De, solution, last)
        report(_line(De, solution, reason))
        if not solution.solved:
            raise SolutionError(f"{geometry_name(sp, sf)}: {reason}")
        last = De
        layer = fields.sample(solution.flow).assign_coords(deborah=De)
        layer["sphere_velocity"] = "sphere", list(solution.velocities.values()), SPHERE_VELOCITY
        layers.append(layer.assign(_undisturbed_stress(study, De, layer["r"])))
    same = ["edge_z", "edge_r", "sphere_position"]  # or that of the largest De
    return (
        xr.concat([layer.drop_vars(same) for layer in layers], "deborah")
        .assign({name: layers[-1][name].drop_vars("deborah") for name in same})
        .assign(sp=sp, sf=sf, confinement=study.confinement)
        .assign_attrs(title=f"fields, {geometry_name(sp, sf)}")
    )


def _undisturbed_stress(study: FlowSettings, De: float, r: xr.DataArray) -> dict:
    """Stress without spheres, by the names of `fields.NAMES`."""
    stress = polymer_stress(study.known_fluid, study.deborah_longest_mode(De), r.values)
    return {
        f"undisturbed_stress_{name}": (
            "r",
            values,
            {"long_name": f"{fields.NAMES[f'stress_{name}']}, without spheres", "units": "1"},
        )
        for name, values in stress._asdict().items()
    }


def explanation(
    study: FlowSettings, De: float, solution: quasi_steady.Solution, last: float | None = None
) -> str:
    """Why there is no solution and what might help, or why it is not accurate; else empty.

    Args:
        study: What its flows depend on.
        De: Deborah number of the solution, in the definition of the study.
        solution: What was found there.
        last: The Deborah number solved before; None if there is none.
    """
    elements = _resolution(solution)
    if solution.solved and solution.accurate:
        return ""
    if solution.solved and solution.error is None:
        return f"no estimate of the error, on {elements}"
    if solution.solved:
        return f"estimated error {solution.estimated_error:.1e} Ubar is too large, on {elements}"
    if math.isnan(undisturbed(study, De).centreline_velocity):
        return "no unique steady flow: shear stress of the undisturbed flow is not monotonic"
    why = solution.convergence.reason.replace("at De =", "at lambda_1 Ubar/D =")
    before = "" if last is None else f" (last solved: {last:g})"
    return f"not resolved at De = {De:g}{before}, on {elements}: {why}; {_remedy(why)}"


def _resolution(solution: quasi_steady.Solution) -> str:
    return f"{solution.flow.mesh.ne} elements of order {solution.flow.velocity_order}"


def _remedy(reason: str) -> str:
    """What might help an iteration that ended for this reason."""
    if "no convergence" in reason:
        return "more iterations may help (dns.max_iterations)"
    if "factorisation" in reason:
        return "fewer unknowns or more memory may help (dns.max_unknowns)"
    return "more unknowns (dns.max_unknowns) or a fluid with more solvent may help"


def _line(De: float, solution: quasi_steady.Solution, reason: str) -> str:
    convergence = solution.convergence
    text = f"De {De:g}: {solution.iterations} iterations, residual {convergence.residual:.1e}"
    if solution.solved:
        velocities = ", ".join(f"{name} {U:.7f}" for name, U in solution.velocities.items())
        text += f", U/Ubar {velocities}, estimated error {solution.estimated_error:.1e}"
        if solution.fallback:
            text += ", by the fall-back since the iteration was stuck"
        if not solution.accurate:
            text += f", NOT ACCURATE with {_resolution(solution)}"
    else:
        updates = " ".join(f"{update:.0e}" for update in convergence.updates)
        text += f", NOT SOLVED: {reason} (updates {updates})"
    return f"{text}, {solution.seconds:.1f} CPU s"


def _empty(study: FlowSettings, sp: float, sf: float) -> xr.Dataset:
    De = np.array(study.deborah, dtype=float)
    n, blank = De.size, np.full(De.size, np.nan)
    pipes = [undisturbed(study, value) for value in De]
    none = np.zeros(n, dtype=np.int32)
    result = xr.Dataset(
        {
            "velocity": (("deborah", "particle"), np.full((n, len(PARTICLES)), np.nan)),
            "pressure_gradient": ("deborah", blank.copy()),
            "undisturbed_pressure_gradient": (
                "deborah",
                [flow.pressure_gradient for flow in pipes],
            ),
            "centreline_velocity": ("deborah", [flow.centreline_velocity for flow in pipes]),
            "velocity_error": ("deborah", blank.copy()),
            "relative_velocity_error": (("deborah", "pair"), np.full((n, len(PAIRS)), np.nan)),
            "status": ("deborah", np.full(n, NOT_ATTEMPTED, dtype=np.int8)),
            "reason": ("deborah", np.array(["a smaller De was not solved"] * n, dtype=object)),
            "residual": ("deborah", blank.copy()),
            "iterations": ("deborah", none.copy()),
            "unknowns": ("deborah", none.copy()),
            "elements": ("deborah", none.copy()),
            "fallback": ("deborah", none.astype(np.int8)),
            "velocity_order": ("deborah", none.copy()),
            "length": ((), np.nan),
            "confinement": ((), study.confinement),
            "sp": ((), sp),
            "sf": ((), sf),
        },
        coords={
            "deborah": De,
            "particle": list(PARTICLES),
            "pair": list(PAIRS),
            "deborah_longest_mode": (
                "deborah",
                [study.deborah_longest_mode(value) for value in De],
            ),
            "deborah_mean_relaxation_time": (
                "deborah",
                [study.deborah_mean_relaxation_time(value) for value in De],
            ),
        },
    )
    for name, variable in result.variables.items():
        variable.attrs.update(OWN_ATTRIBUTES.get(str(name), ATTRIBUTES.get(str(name), {})))
    return result


def undisturbed(study: FlowSettings, De: float) -> PipeFlow:
    """Flow without spheres; NaN where a steady profile is not unique."""
    try:
        return pipe_flow(study.known_fluid, study.deborah_longest_mode(De))
    except FluidError:
        return PipeFlow(math.nan, math.nan)


def _status(solution: quasi_steady.Solution) -> int:
    if not solution.solved:
        return NOT_CONVERGED
    return SOLVED if solution.accurate else INACCURATE


def _insert(result: xr.Dataset, De: float, solution: quasi_steady.Solution, reason: str):
    """Write one solution into the dataset, in place."""
    at = {"deborah": De}
    flow = solution.flow
    for name, U in solution.velocities.items():
        result["velocity"].loc[at | {"particle": name}] = U
    result["pressure_gradient"].loc[at] = solution.pressure_gradient
    if solution.solved and solution.error is not None:
        result["velocity_error"].loc[at] = solution.error.velocity
        names = flow.geometry.spheres
        for behind, ahead, error in zip(names, names[1:], solution.error.relative, strict=False):
            result["relative_velocity_error"].loc[at | {"pair": f"{ahead}-{behind}"}] = error
    result["status"].loc[at] = _status(solution)
    result["reason"].loc[at] = reason
    result["residual"].loc[at] = solution.convergence.residual
    result["iterations"].loc[at] = solution.iterations
    result["unknowns"].loc[at] = flow.space.ndof
    result["elements"].loc[at] = flow.mesh.ne
    result["fallback"].loc[at] = int(solution.fallback)
    result["velocity_order"].loc[at] = flow.velocity_order
    result["length"][()] = flow.geometry.length
