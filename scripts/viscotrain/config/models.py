"""What a config may say about fluid, channel, table and simulations of the flow.

The pydantic models here and in `outputs` are the only place where a key's meaning, unit, range and
default stand. What a single key may hold stands in the models, what keys must agree on in
`problems`.

Nothing in this room imports NGSolve or numpy: the workflow reads it for every job.
"""

from typing import Any, Literal

from pydantic import model_serializer

from viscotrain.config.keys import (
    LONGEST_TIME,
    SHORTEST_TIME,
    DeborahNumber,
    Distance,
    FiniteDistance,
    KnownMobility,
    KnownTime,
    ListOf,
    PathText,
    Section,
    key,
)
from viscotrain.errors import FluidError
from viscotrain.fluid.parameters import Fluid, Mode


class ModeConfig(Section):
    """One Giesekus mode of the fluid."""

    viscosity: float = key(
        "polymer viscosity of the mode", symbol="eta_k", unit="Pa s", ge=1e-6, le=10**8
    )
    relaxation_time: float = key(
        "relaxation time of the mode",
        symbol="lambda_k",
        unit="s",
        ge=SHORTEST_TIME,
        le=LONGEST_TIME,
    )
    mobility: float = key(
        "Giesekus mobility of the mode; 0 is Oldroyd-B", symbol="alpha_k", unit="1", ge=0, lt=1
    )


class FluidFitConfig(Section):
    """How a fluid is fitted to measured data, and how far its uncertainty is followed."""

    modes: int | None = key(
        "number of modes; null = chosen, up to 4, by the Bayesian information criterion",
        default=None,
        ge=0,
        le=6,
    )
    relaxation_times: ListOf[KnownTime | None] = key(
        "known relaxation times, not fitted, the longest first, null = fitted; as many modes are "
        "fitted at least. The longest one is what extensional rheometry measures, lambda_E",
        symbol="lambda_k",
        unit="s",
        default=(),
        rule="descending, at most fluid.fit.modes",
    )
    mobilities: ListOf[KnownMobility | None] = key(
        "known mobilities, not fitted, of the modes in the order of their relaxation times, the "
        "longest first; null = fitted",
        symbol="alpha_k",
        unit="1",
        default=(),
        rule="at most fluid.fit.modes",
    )
    draws: int = key(
        "fluids drawn from the uncertainty of the fit, which show in `fit_spread` how far it "
        "reaches; 0 = none",
        default=20,
        ge=0,
        le=200,
    )


class FluidConfig(Section):
    """The fluid: a Newtonian solvent and Giesekus modes, written here or fitted to `data`."""

    solvent_viscosity: float | None = key(
        "viscosity of the solvent; with `data` it may be left out, and is fitted then",
        symbol="eta_s",
        unit="Pa s",
        default=None,
        ge=1e-6,
        le=10**8,
        rule="required unless data are given",
    )
    modes: ListOf[ModeConfig] | None = key(
        "Giesekus modes in any order; an empty list is a Newtonian fluid",
        default=None,
        max_length=10,
        rule="required unless data are given",
    )
    data: ListOf[PathText] | None = key(
        "CSV files of measured moduli, viscosities and normal stress differences, relative to the "
        "config file, to which the fluid is fitted; columns below",
        default=None,
        min_length=1,
        allowed="list of paths without braces, at least 1, none twice, in place of modes",
    )
    fit: FluidFitConfig = FluidFitConfig()
    density: float = key(
        "density of the fluid, for its Reynolds number; the default is that of water",
        symbol="rho",
        unit="kg/m^3",
        default=1000.0,
        gt=0,
    )

    @model_serializer(mode="wrap")
    def _as_written(self, serialize) -> dict[str, Any]:
        """Without the keys of the other way to give the fluid."""
        unused = {name for name, value in self if value is None}
        if self.data is None and self.fit == FluidFitConfig():
            unused.add("fit")
        return {name: value for name, value in serialize(self).items() if name not in unused}

    def physical(self) -> Fluid:
        """The fluid in physical units.

        Raises:
            FluidError: It is not fitted yet.
        """
        if self.modes is None:
            raise FluidError("the fluid is not fitted yet; `fluid_fit` and `with_fluid` do it")
        assert self.solvent_viscosity is not None  # as `problems` demands, or fitted with the modes
        modes = (Mode(**mode.model_dump()) for mode in self.modes)
        return Fluid(self.solvent_viscosity, tuple(modes))


class DeborahConfig(Section):
    """The Deborah numbers of the study."""

    values: ListOf[DeborahNumber] = key(
        "Deborah numbers of the table; 0 is the Newtonian limit, and the only one without modes",
        symbol="De",
        unit="1",
        min_length=1,
        max_length=100,
        rule="ascending",
    )
    definition: Literal["longest_mode", "mean_relaxation_time"] = key(
        "relaxation time in De = time * Ubar/D: the longest one, or the mean over the modes "
        "weighted by their viscosities. It holds for every De in this file",
        default="longest_mode",
    )


class TableConfig(Section):
    """The grid of triplets whose velocities are computed, or a finished table.

    A geometry is one pair of distances (sp, sf); a point is a geometry at one Deborah number. Nodes
    are the points of the grid; a hole is a point that could not be solved.
    """

    file: PathText | None = key(
        "a finished velocity_table.nc, relative to the config file, in place of simulations; it "
        "must be of the same fluid and d/D, and have the Deborah numbers",
        default=None,
        allowed="path without braces, in place of the distances",
    )
    sp: ListOf[Distance] = key(
        "distances of the middle sphere to the trailing one, centre to centre; "
        ".inf = no trailing neighbour",
        symbol="sp",
        unit="d",
        default=(),
        min_length=2,
        max_length=128,
        rule="ascending, the last one .inf; required without file",
    )
    sf: ListOf[Distance] = key(
        "distances of the leading sphere to the middle one, centre to centre; "
        ".inf = no leading neighbour",
        symbol="sf",
        unit="d",
        default=(),
        min_length=2,
        max_length=128,
        rule="ascending, the last one .inf; required without file",
    )
    pair: ListOf[FiniteDistance] | None = key(
        "distances of two spheres alone, besides those of sp and sf; null = one between any two of "
        "these, and beyond them to at least 12",
        symbol="s",
        unit="d",
        default=None,
        rule="ascending",
    )
    line_spacing: int = key(
        "triplets are simulated where sp or sf is one of every so many distances, the first but "
        "not the last finite one among them; from these lines of the grid follow all others",
        default=1,
        ge=1,
        le=64,
        rule="more than 1 needs table.check",
    )
    check: int = key(
        "geometries between the nodes that are solved to measure the interpolation error, each in "
        "a cell of its own (so never more than the grid has cells); 0 switches it off",
        default=3,
        ge=0,
        le=10_000,
    )
    max_holes: int = key(
        "points (De, sp, sf) that may be missing from the table before the table step fails",
        default=0,
        ge=0,
        le=1_000_000,
    )


class BudgetConfig(Section):
    """What a run may take before it is refused, with the estimate, in place of being begun."""

    core_hours: float = key(
        "time on one core, of all simulations, trains, maps and movies together, or of what is "
        "made on request, up to which a study is run",
        unit="h",
        default=200.0,
        gt=0,
        le=10_000_000,
    )
    gigabytes: float = key(
        "size of all results, up to which a study is run",
        unit="GB",
        default=50.0,
        gt=0,
        le=1_000_000,
    )


class TransientConfig(Section):
    """Start-up from fluid at rest, with spheres that move."""

    duration: float = key(
        "time after which the start-up is over", unit="lambda_1", default=10.0, gt=0, le=1000
    )
    first_step: float = key("first time step", unit="lambda_1", default=1e-3, ge=1e-9, le=1)
    common_tolerance: float = key(
        "error of one time step in the velocity that all spheres share",
        unit="Ubar",
        default=2e-4,
        ge=1e-9,
        le=0.1,
    )
    relative_tolerance: float = key(
        "error of one time step in relative velocities",
        unit="Ubar",
        default=2e-5,
        ge=1e-9,
        le=0.1,
    )
    distance_tolerance: float = key(
        "error of one time step in the distances of neighbours",
        unit="d",
        default=1e-5,
        ge=1e-9,
        le=0.1,
    )
    max_stretch: float = key(
        "factor by which a gap may change, either way, before it is meshed anew",
        unit="1",
        default=1.5,
        ge=1.05,
        le=10,
    )
    max_iterations: int = key(
        "iterations of one time step before a shorter one is tried", default=12, ge=1, le=1000
    )


class Resolution(Section):
    """Resolution and solution of the flow around spheres."""

    velocity_order: int = key(
        "lowest polynomial order of the velocity that results are taken from; pressure and "
        "conformation are one order below. De = 0 is solved in order 6",
        default=4,
        ge=3,
        le=6,
    )
    sphere_elements: int = key(
        "elements along the half circle of a sphere", default=10, ge=4, le=200
    )
    axis_size: float = key(
        "size of the elements on the axis", unit="D", default=0.1, ge=0.002, le=0.5
    )
    gap_elements: int = key("elements across the gap between two spheres", default=3, ge=3, le=20)
    wall_size: float = key(
        "size of the elements far from the spheres", unit="D", default=0.2, ge=0.01, le=0.5
    )
    margin: float = key(
        "distance of the outer spheres' centres to the periodic ends",
        unit="D",
        default=2.0,
        ge=1,
        le=50,
    )
    accuracy: float = key(
        "estimated error of relative velocities, and of the velocity itself (half of it for "
        "triplets), down to which the order is raised and the mesh refined",
        unit="Ubar",
        default=1e-5,
        ge=1e-12,
        le=1,
    )
    relative_accuracy: float = key(
        "the same as a share of the largest relative velocity; the larger one of both counts",
        unit="1",
        default=0.02,
        ge=0,
        lt=1,
    )
    max_velocity_order: int = key(
        "highest order that the accuracy may raise it to; without effect below dns.velocity_order",
        default=7,
        ge=3,
        le=8,
    )
    max_unknowns: int = key(
        "unknowns that a simulation may have, about, in the order and on the mesh that its error "
        "is estimated of; the order above, which that takes, has about twice as many at most",
        default=100_000,
        ge=1,
        le=10_000_000,
    )
    tolerance: float = key(
        "update, rms over the unknowns, at which an iteration has converged",
        default=1e-7,
        ge=1e-12,
        le=1e-4,
    )
    max_iterations: int = key(
        "iterations of one De step before it is given up", default=40, ge=1, le=1000
    )
    deborah_step: float = key(
        "largest ratio of successive De on the way up from 0, where each solution starts from the "
        "one before (continuation)",
        default=3.0,
        ge=1.05,
        le=100,
    )


class DnsConfig(Resolution):
    """Resolution and solution of the flow around one triplet."""

    method: Literal["quasi_steady", "transient"] = key(
        "quasi_steady: velocities at distances that are held, all De in one job; transient: those "
        "after the start-up from rest, one job per De, as the original study did",
        default="quasi_steady",
    )
    transient: TransientConfig = TransientConfig()
    save_fields: bool = key(
        "also write velocity, pressure and stress of every point as VTU", default=False
    )
    geometries_per_job: int | None = key(
        "how many geometries a job solves, one after the other; null = as many as are twenty "
        "seconds of work by the measured costs, or what the profile says: half an hour on a "
        "cluster",
        default=None,
        ge=1,
    )
