"""The transient stage: spheres from rest, from settings to what is simulated, logged and stored.

Fluid at rest and free of stress at t = 0. The start-up is over after `dns.transient.duration`
relaxation times; then the velocities depend on the distances alone, as far as these change little
within a relaxation time. At De = 0 there is no start-up. A simulation that fails is a result: what
was reached is stored, with a status and the reason.
"""

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from viscotrain.config.settings import TransientSettings
from viscotrain.errors import SolutionError
from viscotrain.flow.discretisation import Flow
from viscotrain.flow.geometry import Geometry
from viscotrain.flow.moving_mesh import Profile, linear
from viscotrain.flow.time_stepping import Instant, TimeOptions, Transient
from viscotrain.fluid.parameters import NEWTONIAN
from viscotrain.studies.dns import Report, make_flow, triplet, undisturbed
from viscotrain.words import NOT_CONVERGED, SOLVED

ATTRIBUTES = {
    "time": {"long_name": "time times mean velocity over channel diameter", "units": "1"},
    "sphere": {"long_name": "sphere, named along the flow"},
    "gap": {"long_name": "number of the gap, the trailing one first", "units": "1"},
    "velocity": {"long_name": "velocity of the sphere over mean velocity", "units": "1"},
    "position": {
        "long_name": "position of the centre over channel diameter, in the frame of the wall",
        "units": "1",
    },
    "distance": {
        "long_name": "distance of neighbours, centre to centre over sphere diameter",
        "units": "1",
    },
    "pressure_gradient": {
        "long_name": "minus mean pressure gradient over the periodic length, "
        "over zero-shear viscosity times mean velocity over squared channel diameter",
        "units": "1",
    },
    "iterations": {"long_name": "Newton iterations of the step", "units": "1"},
    "remeshing_jump": {
        "long_name": "largest change of a relative velocity by remeshing before the step, "
        "over mean velocity; NaN where there was none",
        "units": "1",
    },
}


def time_options(study: TransientSettings, deborah: float) -> TimeOptions:
    """The time stepper's part of the config, in D/Ubar."""
    settings = study.transient
    relaxation_time = study.deborah_longest_mode(deborah)
    return TimeOptions(
        first_step=settings.first_step * (relaxation_time or 1.0),
        common_tolerance=settings.common_tolerance,
        relative_tolerance=settings.relative_tolerance,
        distance_tolerance=settings.distance_tolerance,
        tolerance=study.dns.tolerance,
        max_iterations=settings.max_iterations,
        max_stretch=settings.max_stretch,
    )


def start_up_time(study: TransientSettings, deborah: float) -> float:
    """When the start-up is over, in D/Ubar."""
    return study.transient.duration * study.deborah_longest_mode(deborah)


def flow_maker(study: TransientSettings, deborah: float) -> Callable[[Geometry], Flow]:
    """Meshes and unknowns as for the quasi-steady velocities at the same Deborah number."""

    def make(geometry: Geometry) -> Flow:
        flow = make_flow(study, geometry)
        return flow.variant(NEWTONIAN, flow.velocity_order) if deborah == 0 else flow

    return make


def follow_triplet(
    study: TransientSettings, sp: float, sf: float, deborah: float, **how
) -> tuple[xr.Dataset, pd.DataFrame]:
    """The start-up of one triplet (sp, sf), in d; `how` as for `follow_spheres`.

    Returns:
        Dataset (time, sphere) with sp and sf, and a row with the CPU seconds.
    """
    until = start_up_time(study, deborah)
    followed, steps = follow_spheres(study, triplet(study, sp, sf), deborah, until=until, **how)
    seconds = round(sum(step.seconds for step in steps), 3)
    row = {"sp": sp, "sf": sf, "deborah": deborah, "steps": len(steps), "cpu_seconds": seconds}
    return followed.assign({"sp": sp, "sf": sf}), pd.DataFrame([row])


def follow_spheres(
    study: TransientSettings,
    geometry: Geometry,
    deborah: float,
    *,
    until: float,
    report: Report,
    checkpoint: Path | None = None,
    code: str = "",
    developed: Flow | None = None,
    profile: Profile = linear,
) -> tuple[xr.Dataset, Sequence[Instant]]:
    """Follow spheres from rest, or from a developed stress.

    Args:
        study: What it depends on.
        geometry: The initial one.
        deborah: De in the definition of the study.
        until: Time to simulate, in D/Ubar.
        report: Takes a line of text per step.
        checkpoint: File (.npz) to continue from and to write after every step; None for neither.
        code: Digest of the program; a checkpoint of another one is not continued from.
        developed: Flow with the stress at the start, as for `Transient`; None = none.
        profile: Of the velocity of the mesh, as for `Transient`.

    Returns:
        Dataset (time, sphere) and the steps, with their CPU seconds.
    """
    simulation = Transient(
        geometry,
        flow_maker(study, deborah),
        study.deborah_longest_mode(deborah),
        time_options(study, deborah),
        developed,
        profile,
    )
    start = "rest" if developed is None else "developed"
    signature = _signature(study, geometry, deborah, start, profile.__name__, code)
    if checkpoint and checkpoint.exists() and simulation.load(checkpoint, signature):
        report(f"goes on from t = {simulation.instants[-1].time:g} D/Ubar")
    reason = ""
    try:
        for instant in simulation.run(until):
            report(_line(instant, geometry))
            if checkpoint:
                simulation.save(checkpoint, signature)
    except SolutionError as error:
        reason = str(error)
        report(f"NOT SOLVED: {reason}")
    return _dataset(study, geometry, deborah, simulation.instants, reason), simulation.instants


def _signature(study: TransientSettings, geometry: Geometry, deborah: float, *more: str) -> str:
    parts = [repr(study.stated()), repr(geometry), deborah, *more]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def _line(instant: Instant, geometry: Geometry) -> str:
    velocities = " ".join(f"{U:.6f}" for U in instant.velocities)
    distances = " ".join(f"{s:.5f}" for s in np.diff(instant.positions) / geometry.confinement)
    text = (
        f"t {instant.time:.5g} D/Ubar: U/Ubar {velocities}, distances/d {distances}, "
        f"{instant.iterations} iterations, {instant.seconds:.1f} CPU s"
    )
    if not math.isnan(instant.remeshing_jump):
        text += f", remeshed (jump {instant.remeshing_jump:.1e} Ubar)"
    return text


def _dataset(study, geometry, deborah, instants: Sequence[Instant], reason: str) -> xr.Dataset:
    shape = len(instants), len(geometry.spheres)
    position = np.array([instant.positions for instant in instants]).reshape(shape)
    velocity = np.array([instant.velocities for instant in instants]).reshape(shape)
    dataset = xr.Dataset(
        {
            "velocity": (("time", "sphere"), velocity),
            "position": (("time", "sphere"), position),
            "distance": (("time", "gap"), np.diff(position, axis=1) / geometry.confinement),
            "pressure_gradient": ("time", [instant.pressure_gradient for instant in instants]),
            "iterations": ("time", np.array([i.iterations for i in instants], dtype=np.int32)),
            "remeshing_jump": ("time", [instant.remeshing_jump for instant in instants]),
            "status": ((), np.int8(NOT_CONVERGED if reason else SOLVED)),
            "reason": ((), reason),
            "deborah": ((), deborah),
            "deborah_longest_mode": ((), study.deborah_longest_mode(deborah)),
            "deborah_mean_relaxation_time": ((), study.deborah_mean_relaxation_time(deborah)),
            "centreline_velocity": ((), undisturbed(study, deborah).centreline_velocity),
            "confinement": ((), geometry.confinement),
        },
        coords={
            "time": [instant.time for instant in instants],
            "sphere": list(geometry.spheres),
            "gap": np.arange(1, max(shape[1], 1)),
        },
        attrs={"title": f"{shape[1]} moving spheres at De = {deborah:g}"},
    )
    for name, variable in dataset.variables.items():
        variable.attrs.update(ATTRIBUTES.get(str(name), {}))
    return dataset
