r"""Operating conditions: numbers of each condition, and the limits beyond which it is not valid.

With rho, rho_p the densities of fluid and spheres, U_p the velocity of a single sphere, L the
length of the channel, and eta_w the viscosity at the largest shear rate at the wall,

    Re  = rho Ubar D/eta_0,
    El  = De/Re = lambda_1 eta_0/(rho D^2)      (elasticity number, of fluid and channel alone),
    Re_p = Re beta^2 eta_0/eta_w                (of the sphere, with the smallest viscosity),
    settling/D = v_s L/(U_p D),    v_s = |rho_p - rho| g d^2/(18 eta_0)    (Stokes),
    polymer share = 1 - eta_s/eta_w.

**Limits**, each with its reason; a condition beyond one is calculated all the same, and marked.

- Re_p above 0.1: the equations have no inertia. It moves spheres across the channel where Re_p is
  of order one, and viscous drag dominates well below (Di Carlo, Irimia, Tompkins & Toner, PNAS 104,
  2007, 18892).
- El below 1: elasticity centres spheres where it dominates inertia, El >> 1 (D'Avino, Greco &
  Maffettone, Annu. Rev. Fluid Mech. 49, 2017, 341). All spheres are taken to be on the axis.
- beta below 0.1 or above 0.5: the simulations are compared with exact solutions in this range
  (README, Accuracy); below, interactions fall as beta^4 (Jeyasountharan et al., Phys. Fluids 34,
  2022, 042015), and relative velocities reach the accuracy of the simulations.
- settling above 0.1 D over the residence time: at 0.1 D from the axis the fluid of a Newtonian tube
  is 4 % slower, a hundred times the relative velocities in a train. The migration that brings
  spheres to the axis, taken to be finished, opposes it; it is not computed, so this is what it must
  make good for.
- pressure drop above 3 bar: plasma bonds of PDMS part at about 300 kPa (Eddings, Johnson & Gale, J.
  Micromech. Microeng. 18, 2008, 067001). Harder chips stand more.
- polymer share below 0.1: at the wall the solvent carries more than 90 % of the stress; the fluid
  is hardly elastic there, and the viscosity there rests on the tail of the fitted modes.
- memory number above 0.1: velocities are those of distances that are held (`table.memory`).
- mean spacing below 1.5 d: at gaps of 0.5 d velocities by triplets miss up to 8 % of the largest
  relative velocity (README, Verification), and the injection law leaves little to order.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from viscotrain.fluid.channel import ROUND, CrossSection
from viscotrain.fluid.parameters import Fluid
from viscotrain.table.memory import largest
from viscotrain.words import QUASI_STEADY_LIMIT

GRAVITY = 9.81  # m/s^2
METRES, BAR = 1e-3, 1e-5  # of one mm, of one Pa
ROUND_OFF = 1e-9  # d/D of 10 um and 100 um is not below 0.1


class Limit(NamedTuple):
    """Up to where, or, if `least`, from where a quantity is valid, and what is not beyond."""

    quantity: str
    value: float
    reason: str
    least: bool = False


LIMITS = (
    Limit("particle_reynolds_number", 0.1, "inertia, which is left out, moves spheres"),
    Limit("elasticity_number", 1.0, "inertia rivals elasticity, which centres spheres", least=True),
    Limit("confinement", 0.1, "spheres hardly act on each other in so wide a channel", least=True),
    Limit("confinement", 0.5, "the simulations are not verified for so large spheres"),
    Limit("settling", 0.1, "spheres sink away from the axis unless migration holds them"),
    Limit("pressure_drop", 3.0, "bonded PDMS parts"),
    Limit("polymer_share", 0.1, "at the wall the fluid is its solvent, not elastic", least=True),
    Limit("memory_number", QUASI_STEADY_LIMIT, "velocities are those of distances that are held"),
    Limit("mean_spacing", 1.5, "spheres are closer than the model is good for", least=True),
)
NAMES = {  # quantity: units, meaning
    "deborah": ("1", "Deborah number, as the study defines it"),
    "volume_fraction": ("1", "volume fraction of spheres in the channel"),
    "feed_volume_fraction": ("1", "volume fraction of spheres in what is poured in"),
    "mean_spacing": ("1", "spacing of an equally spaced train over diameter"),
    "flow_rate": ("uL min-1", "flow rate"),
    "mean_velocity": ("mm s-1", "mean velocity of the flow"),
    "centreline_velocity": ("mm s-1", "largest velocity of the flow without spheres"),
    "sphere_rate": ("s-1", "spheres that enter in a second"),
    "residence_time": ("s", "time that a single sphere is in the channel"),
    "reynolds_number": ("1", "Reynolds number, density Ubar D over zero-shear viscosity"),
    "particle_reynolds_number": (
        "1",
        "Reynolds number of the sphere, with the viscosity at the wall",
    ),
    "elasticity_number": ("1", "Deborah number of the longest mode over Reynolds number"),
    "confinement": ("1", "sphere over channel diameter"),
    "settling": ("1", "way that a sphere settles in the residence time over channel diameter"),
    "pressure_drop": ("bar", "pressure drop of the channel without spheres"),
    "wall_shear_rate": ("s-1", "largest shear rate at the wall"),
    "mean_wall_shear_rate": ("s-1", "shear rate at the wall, mean over its perimeter"),
    "polymer_share": ("1", "share of the viscosity at the wall that is not the solvent's"),
    "memory_number": ("1", "diameters that a gap changes in a relaxation time, at most"),
}


def operating_conditions(
    trains: Sequence[xr.Dataset],
    *,
    units: xr.Dataset,
    flow: xr.Dataset,
    fluid: Fluid,
    fluid_density: float,
    particle_density: float | None = None,
    section: CrossSection = ROUND,
) -> xr.Dataset:
    """All conditions that were simulated, with their numbers and the limits that they exceed.

    Args:
        trains: Results of `repeats.run_repeats` with their memory numbers; of two at the same
            condition the larger memory number counts.
        units: Result of `units.physical_units`.
        flow: Without spheres, of `channel_flow.channel_flow`.
        fluid: In physical units.
        fluid_density: In kg/m^3.
        particle_density: In kg/m^3; None: not known, `settling` is NaN.
        section: Of the channel.

    Returns:
        Dataset over `condition` with the variables of `NAMES`, NaN where a velocity is not known,
        `reason`, empty for a condition within all limits, and `beyond` (condition, limit).
    """
    rows: dict[tuple[float, float], dict[str, float]] = {}
    for train in trains:
        De = float(train["deborah"])
        at_De = units.sel(deborah=De), flow.sel(deborah=De)
        row = _numbers(train, *at_De, fluid, fluid_density, particle_density)
        where = De, float(f"{row['volume_fraction']:.9g}")
        before = rows.get(where, row)
        row["memory_number"] = max(row["memory_number"], before["memory_number"])
        rows[where] = row
    table = pd.DataFrame([rows[where] for where in sorted(rows)], columns=list(NAMES))
    beyond = np.array([[_is_beyond(row, limit) for limit in LIMITS] for _, row in table.iterrows()])
    found = xr.Dataset(
        {
            name: ("condition", table[name].values, {"units": unit, "long_name": text})
            for name, (unit, text) in NAMES.items()
        },
        attrs=section.attributes,
    )
    found["beyond"] = (("condition", "limit"), beyond.astype(np.int8), BEYOND)
    found["limit"] = ("limit", [in_words(limit) for limit in LIMITS], {"long_name": "limits"})
    reasons = [_reason(row, hit) for (_, row), hit in zip(table.iterrows(), beyond, strict=True)]
    found["reason"] = ("condition", reasons, {"long_name": "limits that it exceeds, and why"})
    return found


BEYOND = {"units": "1", "long_name": "1 where a condition is beyond the limit"}


def _numbers(
    train: xr.Dataset,
    units: xr.Dataset,
    flow: xr.Dataset,
    fluid: Fluid,
    fluid_density: float,
    particle_density: float | None,
) -> dict[str, float]:
    """The numbers of one condition; `units` and `flow` are those at its De."""
    D, d = (METRES * float(units[f"{name}_diameter"]) for name in ("channel", "particle"))
    seconds, Ubar = float(units["time"]), float(units["mean_velocity"])
    eta_0, length = fluid.zero_shear_viscosity, float(train["channel_length"])
    beta, thinned = float(train["confinement"]), float(flow["wall_viscosity"])
    Re = fluid_density * Ubar * D / eta_0
    De = float(units["deborah_longest_mode"])
    residence = seconds * length / float(train["isolated_velocity"])
    heavier = np.nan if particle_density is None else abs(particle_density - fluid_density)
    own = {
        name: float(train[name])
        for name in ("deborah", "volume_fraction", "feed_volume_fraction", "confinement")
    }
    return own | {
        "mean_spacing": float(train["mean_spacing_law"]),
        "flow_rate": float(units["flow_rate"]),
        "mean_velocity": Ubar / METRES,
        "centreline_velocity": Ubar / METRES * float(flow["centreline_velocity"]),
        "sphere_rate": float(train["injection_rate"]) / seconds,
        "residence_time": residence,
        "reynolds_number": Re,
        "particle_reynolds_number": Re * beta**2 / thinned,
        "elasticity_number": De / Re,
        "settling": heavier * GRAVITY * d**2 / (18 * eta_0) * residence / D,
        "pressure_drop": BAR * float(flow["pressure_gradient"]) * float(units["stress"]) * length,
        "wall_shear_rate": float(flow["largest_wall_shear_rate"]) / seconds,
        "mean_wall_shear_rate": float(flow["mean_wall_shear_rate"]) / seconds,
        "polymer_share": 1 - fluid.solvent_viscosity / (eta_0 * thinned) if De else np.nan,
        "memory_number": largest(train),
    }


def _is_beyond(row: pd.Series, limit: Limit) -> bool:
    """Whether a number is known and beyond a limit."""
    value = row[limit.quantity]
    if limit.least:
        return bool(value < limit.value * (1 - ROUND_OFF))
    return bool(value > limit.value * (1 + ROUND_OFF))


def in_words(limit: Limit) -> str:
    """Quantity, limit and reason."""
    side = "below" if limit.least else "above"
    return f"{_name(limit)} {side} {limit.value:g}{_unit(limit)}: {limit.reason}"


def _name(limit: Limit) -> str:
    return "d/D" if limit.quantity == "confinement" else limit.quantity.replace("_", " ")


def _unit(limit: Limit) -> str:
    own = {"settling": " D", "mean_spacing": " d", "pressure_drop": " bar"}
    return own.get(limit.quantity, "")


def _reason(row: pd.Series, hit: np.ndarray) -> str:
    """Why a condition is beyond the limits that it exceeds."""
    return "; ".join(
        f"{_name(limit)} {row[limit.quantity]:.3g}{_unit(limit)}, "
        f"{'below' if limit.least else 'above'} {limit.value:g}: {limit.reason}"
        for limit, beyond in zip(LIMITS, hit, strict=True)
        if beyond
    )


def table(found: xr.Dataset) -> pd.DataFrame:
    """The conditions as rows, with the units in the names of columns."""
    units = {name: unit.replace(" ", "_") for name, (unit, _) in NAMES.items() if unit != "1"}
    columns = {
        f"{name}_{units[name]}" if name in units else name: found[name].values
        for name in (*NAMES, "reason")
    }
    return pd.DataFrame(columns)


COLUMNS = {  # of the summary: quantity, factor, format
    "De": ("deborah", 1, "g"),
    "phi/%": ("volume_fraction", 100, ".3g"),
    "feed/%": ("feed_volume_fraction", 100, ".3g"),
    "s*/d": ("mean_spacing", 1, ".3g"),
    "d/D": ("confinement", 1, ".3g"),
    "uL/min": ("flow_rate", 1, ".3g"),
    "Re": ("reynolds_number", 1, ".2g"),
    "El": ("elasticity_number", 1, ".3g"),
    "settling/D": ("settling", 1, ".2g"),
    "bar": ("pressure_drop", 1, ".3g"),
    "wall 1/s": ("wall_shear_rate", 1, ".3g"),
    "memory": ("memory_number", 1, ".2g"),
}


def summary(found: xr.Dataset) -> list[str]:
    """A small table of all conditions, and below it what is beyond which limit, as lines."""
    count = found.sizes["condition"]
    cells = {
        title: [_shown(factor * value, form) for value in found[name].values]
        for title, (name, factor, form) in COLUMNS.items()
    }
    widths = {title: max(map(len, (title, *cells[title]))) for title in COLUMNS}
    lines = ["  ".join(title.rjust(widths[title]) for title in COLUMNS)]
    for n in range(count):
        lines.append("  ".join(cells[title][n].rjust(widths[title]) for title in COLUMNS))
    if found["settling"].isnull().all():
        lines.append("settling: not known without particle.density, or at De = 0")
    for n, limit in enumerate(found["limit"].values):
        hit = np.flatnonzero(found["beyond"].values[:, n])
        if hit.size:
            of_all = "all conditions" if hit.size == count else _named(found, hit)
            lines.append(f"beyond the limits: {limit} ({of_all})")
    return [*lines, *filter(None, [found.attrs.get("channel")])]


def _named(found: xr.Dataset, hit: np.ndarray) -> str:
    """Conditions by their De, or by De and phi where not all of a De are among them."""
    De, phi = found["deborah"].values, 100 * found["volume_fraction"].values
    words = []
    for each in np.unique(De[hit]):
        own = hit[De[hit] == each]
        some = own.size < np.count_nonzero(De == each)
        at = " at phi " + ", ".join(f"{phi[n]:.3g} %" for n in own) if some else ""
        words.append(f"De {each:g}{at}")
    return "; ".join(words)


def _shown(value: float, form: str) -> str:
    """A number, never as a power of ten; a dash where it is not known."""
    if not np.isfinite(value):
        return "-"
    text = f"{value:{form}}"
    return text if "e" not in text else f"{value:.0f}" if abs(value) >= 1 else f"{value:.6f}"
