r"""Design: whether trains form in a device, at which flow rate and feed, and what limits them.

Trains of every condition (`design_conditions`) are simulated (`repeats`); beside them stand the
linear law (`order`, `tolerance`), the beads in droplets (`occupancy`) and the limits of validity
(`operating_conditions`).

**Verdict**, by the coefficient of variation (CV) of the spacing at the outlet with its errors of
sampling and model:

- yes: CV and both errors are at most the one that counts as ordered;
- partly: it is below `PARTLY` of that at the inlet, with errors;
- no: neither.

**Rank.** Conditions within all limits first; of these, those with the wanted rate of beads, if
there is one; then by the droplets with one bead where droplets are asked for, else by the CV.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
import xarray as xr

from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.size_response import size_response
from viscotrain.trains import order, tolerance
from viscotrain.trains.closures import CLOSURES
from viscotrain.trains.occupancy import RANDOM_BEST

PARTLY = 0.8
YES, PARTLY_YES, NO = "yes", "partly", "no"
BEST = 3  # conditions that an answer names
LONGER = "a channel twice as long"  # what might help
LARGER = 1.25  # of a diameter that might help
# l in D goes with beta to this power, from d/D = 0.1 to 0.4 at De = 5; at De = 1 it is -2.8
# (config/confinement.yaml, docs/confinement.md).
ORDERING_POWER = -2.1


def table(
    trains: Sequence[xr.Dataset],
    conditions: xr.Dataset,
    droplets: xr.Dataset,
    *,
    bead_rate: float | None,
    droplet_frequency: float | None,
    ordered_variation: float,
) -> pd.DataFrame:
    """A row for each condition, the best one first, in the units of the bench.

    Args:
        trains: Results of `repeats.run_repeats`, the last station at the outlet.
        conditions: Theirs, of `operating_conditions.operating_conditions`.
        droplets: Theirs, of `encapsulation.combine`.
        bead_rate: Beads that are wanted in a second; None: any.
        droplet_frequency: Droplets in a second; None: the best of each condition.
        ordered_variation: CV of a train that counts as ordered.
    """
    rows = [
        _row(train, _of(conditions, train), _at_outlet(droplets, train), ordered_variation)
        for train in trains
    ]
    found = pd.DataFrame(rows)
    matches = np.isclose(found["beads_per_second"], bead_rate or math.nan, rtol=1e-3)
    found["has_wanted_rate"] = matches
    asked = droplet_frequency is not None
    which = "asked" if asked else "best"
    for end in ("", "_sampling", "_random"):
        found[f"single{end}_percent"] = found[f"single{end}_{which}_percent"]
    droplets_decide = asked or bead_rate is not None
    order_by = found["single_percent"] if droplets_decide else -found["variation"]
    rank = found.assign(
        invalid=found["reason"] != "", other=~matches & matches.any(), last=-order_by
    )
    places = rank.sort_values(["invalid", "other", "last"], kind="stable").index
    return found.loc[places].reset_index(drop=True)


def _of(conditions: xr.Dataset, train: xr.Dataset) -> xr.Dataset:
    """The condition of a train."""
    same = (conditions["deborah"].values == float(train["deborah"])) & np.isclose(
        conditions["volume_fraction"].values, float(train["volume_fraction"]), rtol=1e-6
    )
    (where,) = np.flatnonzero(same)
    return conditions.isel(condition=int(where))


def _at_outlet(droplets: xr.Dataset, train: xr.Dataset) -> xr.Dataset:
    return _of(droplets.isel(condition=droplets["last_station"].values == 1), train)


def _row(train: xr.Dataset, own: xr.Dataset, droplets: xr.Dataset, ordered: float) -> dict:
    outlet = train.isel(station=-1)
    variation, sampling, model = (
        float(outlet[f"spacing_variation{end}"]) for end in ("", "_halfwidth", "_model_error")
    )
    at_inlet = float(train["spacing_variation_injected"])
    rate, best = float(own["sphere_rate"]), float(droplets["best_frequency_ratio"])
    error = np.nan_to_num(sampling) + np.nan_to_num(model)
    return {
        "deborah": float(own["deborah"]),
        "flow_rate_uL_per_min": float(own["flow_rate"]),
        "feed_percent": 100 * float(own["feed_volume_fraction"]),
        "volume_percent": 100 * float(own["volume_fraction"]),
        "beads_per_second": rate,
        "spacing_d": float(outlet["mean_spacing"]),
        "spacing_d_error": np.nan_to_num(float(outlet["mean_spacing_halfwidth"]))
        + np.nan_to_num(float(outlet["mean_spacing_model_error"])),
        "variation": variation,
        "variation_sampling": sampling,
        "variation_model": model,
        "variation_at_inlet": at_inlet,
        "even_percent": 100 * float(outlet["even_share"]),
        "touching_percent": 100 * float(outlet["touching_share"]),
        "single_best_percent": 100 * float(droplets["best_single"]),
        "single_sampling_best_percent": 100 * float(droplets["best_single_halfwidth"]),
        "single_random_best_percent": 100 * RANDOM_BEST,
        "best_droplets_per_second": best * rate,
        "single_asked_percent": 100 * float(droplets["occupancy"].values[1]),
        "single_sampling_asked_percent": 100 * float(droplets["occupancy_halfwidth"].values[1]),
        "single_random_asked_percent": 100 * float(droplets["poisson_occupancy"].values[1]),
        "none_asked_percent": 100 * float(droplets["occupancy"].values[0]),
        "pressure_bar": float(own["pressure_drop"]),
        "wall_shear_rate_per_second": float(own["wall_shear_rate"]),
        "reynolds_number": float(own["reynolds_number"]),
        "elasticity_number": float(own["elasticity_number"]),
        "settling_D": float(own["settling"]),
        "memory_number": float(own["memory_number"]),
        "forms": verdict(variation, error, at_inlet, ordered),
        "reason": str(own["reason"].values),
    }


def verdict(variation: float, error: float, at_inlet: float, ordered: float) -> str:
    """Whether a train forms, by the CV at the outlet, its error, and the CV at the inlet."""
    if variation + error <= ordered:
        return YES
    return PARTLY_YES if variation + error < PARTLY * at_inlet else NO


def with_linear_law(
    found: pd.DataFrame, velocities: VelocityTable, wanted: tolerance.Wanted, variation: float
) -> pd.DataFrame:
    """Rows with the ordering length in D, and the CV at the outlet by the linear law.

    Args:
        found: Of `table`.
        velocities: Of the study, at all its Deborah numbers.
        wanted: Of the trains.
        variation: Of the beads' diameters.
    """
    columns = list(zip(*_linear(found, velocities, wanted, variation), strict=True))
    names = ("ordering_length_D", "variation_by_linear_law", "largest_bead_variation_percent")
    return found.assign(**dict(zip(names, columns, strict=True)))


def remedies(
    best: pd.Series, velocities: VelocityTable, wanted: tolerance.Wanted, variation: float
) -> dict[str, float]:
    """CV at the outlet by the linear law, for the same flow and spacing in other devices.

    Args:
        best: A row of `with_linear_law`.
        velocities: Of the study.
        wanted: Of the trains.
        variation: Of the beads' diameters.

    Returns:
        By what is other. That of larger beads is an estimate: their l is `LARGER` to
        `ORDERING_POWER` times this one.
    """
    beta, initial = velocities.confinement, best["variation_at_inlet"]
    model = CLOSURES[wanted.closure](velocities.at(best["deborah"]))
    train = order.response(model, best["spacing_d"])
    response = size_response(velocities, best["deborah"]).value
    here, longer = (
        tolerance.law(train, beta, response, factor * wanted.length) for factor in (1, 2)
    )
    found = {
        LONGER: longer.variation(initial, variation),
        "beads that enter evenly, behind a device that spaces them": here.variation(0.0, variation),
    }
    if variation > 0:
        found["beads that vary half as much"] = here.variation(initial, variation / 2)
    ordering = best["ordering_length_D"]
    if math.isfinite(ordering):
        now, then = (
            order.law(wanted.length, ordering * LARGER**power) for power in (0, ORDERING_POWER)
        )
        name = f"beads {LARGER:g} times as large, at the same De (l ~ (d/D)^{ORDERING_POWER:g})"
        found[name] = here.variation(initial * then / now, variation)
    return {name: float(value) for name, value in found.items()}


def _linear(
    found: pd.DataFrame, velocities: VelocityTable, wanted: tolerance.Wanted, variation: float
) -> Iterator[tuple[float, float, float]]:
    beta = velocities.confinement
    for row in found.itertuples():
        model = CLOSURES[wanted.closure](velocities.at(row.deborah))
        answer = order.response(model, row.spacing_d)
        response = size_response(velocities, row.deborah).value
        own = tolerance.law(answer, beta, response, wanted.length)
        initial = row.variation_at_inlet
        stable = order.stability(answer, beta) >= 0
        yield (
            order.ordering_length(answer, beta),
            float(own.variation(initial, variation)),
            100 * float(own.largest(initial, wanted.ordered_variation)) if stable else 0.0,
        )
