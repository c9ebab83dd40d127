"""Several diameters beside each other: scaling of velocities, ordering lengths, what to choose.

All of it is made of what the stages have found for each diameter.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from viscotrain.config.settings import ConfinementSettings
from viscotrain.fluid.units import CENTIMETRES, MICROMETRES
from viscotrain.table import collapse
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.pairs import pair_velocity
from viscotrain.trains.variables import described, in_digits
from viscotrain.words import CONTACT

DISTANCES = 60  # between surfaces, at which velocities are compared
NAMED = (0.1, 0.3, 0.6, 1.0)  # about which the summary names, in D


def compare(
    tables: Sequence[VelocityTable], orders: Sequence[xr.Dataset], accuracy: float
) -> xr.Dataset:
    """All diameters in one dataset.

    Args:
        tables: Of velocities, by ascending diameter, at the same Deborah numbers.
        orders: Of `order.orders`, in the same sequence.
        accuracy: That simulations were asked for, in Ubar: errors are not taken to be smaller.

    Returns:
        `relative_velocity` and its `_error` over (deborah, confinement, surface_distance) of
        pairs; `exponent` and `exponent_halfwidth` over (deborah, largest_confinement,
        surface_distance), the `collapse_*` of them together; `shortest_ordering_length`,
        with its spacing and volume fraction, over (deborah, confinement).

    Raises:
        TableError: A table has holes.
    """
    beta = [table.confinement for table in tables]
    xi, U, error = _velocities(tables, accuracy)
    found = xr.Dataset(
        {
            "relative_velocity": described(U, ["deborah", "confinement", "surface_distance"], PAIR),
            "relative_velocity_error": described(
                error, ["deborah", "confinement", "surface_distance"], "estimated error of it"
            ),
        },
        coords={
            "deborah": described(list(tables[0].deborah), ["deborah"], "Deborah number"),
            "confinement": described(beta, ["confinement"], "sphere diameter over channel's, beta"),
            "surface_distance": described(
                xi, ["surface_distance"], "distance of surfaces over channel diameter, xi"
            ),
        },
    )
    return found.assign(_powers(found)).assign(_fastest(orders))


def _velocities(tables: Sequence[VelocityTable], accuracy: float):
    """Xi where all tables hold pairs, U and errors, shapes (deborah, diameter, xi)."""
    reach = [_reach(table) for table in tables]
    xi = np.geomspace(max(low for low, _ in reach), min(high for _, high in reach), DISTANCES)
    values = [_of_table(table, xi, accuracy) for table in tables]
    U, error = (np.stack(parts, axis=1) for parts in zip(*values, strict=True))
    return xi, U, error


def _reach(table: VelocityTable) -> tuple[float, float]:
    """Smallest and largest distance of surfaces in D."""
    farthest = float(table.dataset["pair_distance"].max())
    gaps = np.array([table.smallest_distance, farthest]) - CONTACT
    return tuple(table.confinement * gaps)


def _of_table(
    table: VelocityTable, xi: np.ndarray, accuracy: float
) -> tuple[np.ndarray, np.ndarray]:
    """Velocities of pairs and their errors, shape (deborah, xi)."""
    s = CONTACT + xi / table.confinement
    U = np.array([pair_velocity(table.at(De), s) for De in table.deborah])
    errors = table.dataset["pair_error"].transpose("deborah", "pair_distance").values
    nodes = table.dataset["pair_distance"].values
    own = np.array([np.interp(s, nodes, np.nan_to_num(row)) for row in errors])
    return U, np.maximum(own, accuracy)


def _powers(found: xr.Dataset) -> dict[str, xr.Variable]:
    """Powers of the diameter, fitted to the two smallest, the three smallest, ... diameters."""
    beta, xi = found["confinement"].values, found["surface_distance"].values
    numbers = range(2, beta.size + 1)
    at, together = [], []
    for U, error in zip(
        found["relative_velocity"].values, found["relative_velocity_error"].values, strict=True
    ):
        at.append([collapse.exponent(beta[:n], U[:n], error[:n]) for n in numbers])
        together.append([collapse.collapse(beta[:n], xi, U[:n], error[:n]) for n in numbers])
    dims, largest = ["deborah", "largest_confinement"], beta[1:]
    of_all = {
        "collapse_exponent": (lambda one: one.power.exponent, POWER),
        "collapse_exponent_halfwidth": (lambda one: one.power.halfwidth, HALFWIDTH),
        "collapse_nearest": (lambda one: one.nearest, f"smallest xi {RANGE}"),
        "collapse_farthest": (lambda one: one.farthest, f"largest xi {RANGE}"),
    }
    return {
        "largest_confinement": described(largest, dims[1:], "largest beta of the fit"),
        "exponent": described(np.array(at)[:, :, 0], [*dims, "surface_distance"], POWER),
        "exponent_halfwidth": described(
            np.array(at)[:, :, 1], [*dims, "surface_distance"], HALFWIDTH
        ),
    } | {
        name: described([[float(value(one)) for one in row] for row in together], dims, words)
        for name, (value, words) in of_all.items()
    }


def _fastest(orders: Sequence[xr.Dataset]) -> dict[str, xr.Variable]:
    """The shortest ordering length of each diameter, and where; infinite where nothing orders."""
    names = {"ordering_length": LENGTH, "spacing": SPACING, "volume_fraction": FRACTION}
    values: dict[str, list] = {name: [] for name in names}
    for order in orders:
        best = order.isel(spacing=order["ordering_length"].argmin("spacing"))
        orders_at_all = np.isfinite(best["ordering_length"].values)
        values["ordering_length"].append(best["ordering_length"].values)
        for name in ("spacing", "volume_fraction"):
            values[name].append(np.where(orders_at_all, best[name].values, np.nan))
    prefix = "shortest_ordering_length"
    return {
        prefix if name == "ordering_length" else f"{prefix}_{name}": described(
            np.array(values[name]).T, ["deborah", "confinement"], words
        )
        for name, words in names.items()
    }


def summary(
    study: str,
    found: xr.Dataset,
    units: Sequence[xr.Dataset],
    maps: Sequence[xr.Dataset],
    settings: ConfinementSettings,
) -> list[str]:
    """What was found in lines of text.

    Args:
        study: Its name.
        found: Of `compare`.
        units: Physical units of each diameter.
        maps: Design maps of each diameter, or none.
        settings: Of the stage.
    """
    return [
        f"{len(settings.diameters)} diameters of study {study}",
        *_of_powers(found),
        *_of_diameters(found, units, maps, settings.length),
        *(f"  of one: results/{study}/{name}/summary.txt" for name in settings.diameters),
    ]


def _of_powers(found: xr.Dataset) -> Iterator[str]:
    yield "relative velocities of pairs, over mean velocity, as powers n of d/D at one distance of"
    yield f"surfaces, +- 95 %; dilute spheres in the literature: n = {collapse.EXPECTED:g}"
    for De in found["deborah"].values[found["deborah"].values > 0]:
        for beta in found["largest_confinement"].values:
            one = found.sel(deborah=De, largest_confinement=beta)
            yield f"  De = {De:g}, d/D {float(found['confinement'][0]):g} to {beta:g}"
            named = [one.sel(surface_distance=xi, method="nearest") for xi in NAMED]
            words = [
                f"{_power(at, 'exponent')} at {float(at.surface_distance):.2g} D" for at in named
            ]
            yield f"    n = {', '.join(words)}"
            yield f"    {_range(one)}"


def _power(one: xr.Dataset, name: str) -> str:
    """A power with its error; a dash where velocities have none."""
    n, halfwidth = float(one[name]), float(one[f"{name}_halfwidth"])
    return "-" if math.isnan(n) else f"{n:.2f} +- {halfwidth:.2f}"


def _range(one: xr.Dataset) -> str:
    low, high = float(one["collapse_nearest"]), float(one["collapse_farthest"])
    what = f"n = {collapse.EXPECTED:g} within {100 * collapse.AGREEMENT:g} %"
    if math.isnan(low):
        return f"{what} nowhere"
    return (
        f"{what} from {low:.2g} to {high:.2g} D, fitted there: {_power(one, 'collapse_exponent')}"
    )


def rows(
    found: xr.Dataset, units: Sequence[xr.Dataset], maps: Sequence[xr.Dataset]
) -> Iterator[dict[str, str]]:
    """A line of the table of diameters and Deborah numbers, as text by the name of its column."""
    for n, beta in enumerate(found["confinement"].values):
        cm = CENTIMETRES * float(units[n]["channel_diameter"])
        for De in found["deborah"].values[found["deborah"].values > 0]:
            own = found.sel(deborah=De).isel(confinement=n)
            length = float(own["shortest_ordering_length"])
            orders = math.isfinite(length)
            phi = 100 * float(own["shortest_ordering_length_volume_fraction"])
            yield {
                "d/D": f"{beta:g}",
                "d [um]": f"{MICROMETRES * float(units[n]['particle_diameter']):.3g}",
                "De": f"{De:g}",
                "orders along [D]": in_digits(length, 3) if orders else "never",
                "[cm]": in_digits(cm * length, 3) if orders else "-",
                "at s [d]": f"{float(own['shortest_ordering_length_spacing']):.2f}"
                if orders
                else "-",
                "phi [%]": f"{phi:.3g}" if orders else "-",
                "ordered in the map": _ordered(maps[n], De) if maps else "-",
            }


def _ordered(design_map: xr.Dataset, deborah: float) -> str:
    """Conditions at a De that end ordered, of those that were simulated."""
    if not (design_map["deborah"] == deborah).any():
        return "-"
    position = design_map["ordered_position"].sel(deborah=deborah).values
    return f"{np.isfinite(position).sum()} of {(~np.isnan(position)).sum()}"


def _of_diameters(
    found: xr.Dataset, units: Sequence[xr.Dataset], maps: Sequence[xr.Dataset], length: float
) -> Iterator[str]:
    yield f"the shortest ordering length, of {length:g} D that there are, and conditions of the"
    yield "design map whose trains are ordered at the outlet"
    lines = list(rows(found, units, maps))
    width = {name: max(len(name), *(len(line[name]) for line in lines)) for name in lines[0]}
    for line in [{name: name for name in width}, *lines]:
        yield "  " + "  ".join(text.rjust(width[name]) for name, text in line.items())


PAIR = "velocity of the leading minus the trailing sphere of a pair over mean velocity"
POWER = "power n of beta with which relative velocities of pairs go, up to the largest beta"
HALFWIDTH = "halfwidth of its interval of 95 % confidence"
RANGE = "where velocities scaled with beta^4 agree within 20 %, over channel diameter"
LENGTH = "ordering length of the spacing that orders fastest, over channel diameter"
SPACING = "that spacing, centre to centre over sphere diameter"
FRACTION = "volume fraction of that spacing"
