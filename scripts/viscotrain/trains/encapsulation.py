r"""What the encapsulation stage stores: beads in droplets for all conditions, and it in words.

If the channel ends in a droplet generator, the spheres are beads that are to be alone in a droplet
(`occupancy`). Trains are taken at each of their stations, conditions of the design map at their
first and last one, each as if the droplets were made there.

**The inverse.** By conservation beads of volume V_p pass at the rate phi_feed Q/V_p, so a rate that
is wanted asks at each flow rate for

    phi_feed = rate V_p/Q,    phi = phi_feed/(U_p/Ubar),    s* = U_p/(rate d).

Errors are those of sampling, 95 % confidence over repeats; errors of the model are not in them. How
droplets form, what the second liquid does to beads on their way, and beads that stick are left out.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
import xarray as xr

from viscotrain.fluid.units import MICROLITRES_PER_MINUTE, MILLIMETRES
from viscotrain.trains.occupancy import (
    EDGES,
    FEWEST_PASSAGES,
    FREQUENCY_RATIO,
    RANDOM_BEST,
    TOLERANCE,
    of_passages,
)
from viscotrain.trains.variables import rate_in_words, with_errors
from viscotrain.words import CONTACT

KEPT = ("injection", "channel")  # attributes of trains, the latter of those in ducts
COUNT = ("0", "1", "2+")  # beads in a droplet

RATIO = "droplet frequency over the rate of the beads that enter"
SHARES = "share of droplets with so many beads, mean over phases and repeats"
ENOUGH = f"with at least {100 * (1 - TOLERANCE):g} % of the largest share"
CONDITION = {  # by name: meaning
    "deborah": "Deborah number, as the study defines it",
    "volume_fraction": "volume fraction of spheres in the channel",
    "feed_volume_fraction": "volume fraction of spheres in what is poured in",
    "station": "position over channel diameter where droplets are made",
    "of_map": "1: a condition of the design map, 0: of the trains",
    "last_station": "1: the last station of its trains, 0: another one",
}
FOUND = {  # by name: dimensions besides the condition, meaning
    "occupancy_curve": (("count", "frequency_ratio"), SHARES),
    "best_single": ((), "largest share of droplets with one bead, over all frequencies"),
    "best_frequency_ratio": ((), f"{RATIO}, with the largest share of droplets with one bead"),
    "lowest_frequency_ratio": ((), f"{RATIO}, the lowest {ENOUGH}"),
    "highest_frequency_ratio": ((), f"{RATIO}, the highest {ENOUGH}"),
    "droplet_frequency_ratio": ((), f"{RATIO}, the one asked for, else the best"),
    "occupancy": (("count",), f"{SHARES}, at droplet_frequency_ratio"),
    "mean_count": ((), "mean number of beads in a droplet, at droplet_frequency_ratio"),
    "poisson_occupancy": (("count",), "the same of beads at random times, at mean_count"),
}
WITHOUT_ERROR = ("droplet_frequency_ratio", "mean_count", "poisson_occupancy")
INVERSE = {  # by name: units, meaning
    "flow_deborah": ("1", CONDITION["deborah"]),
    "wanted_flow_rate": ("uL min-1", "flow rate"),
    "wanted_feed_volume_fraction": ("1", "volume fraction to pour in for the wanted bead rate"),
    "wanted_volume_fraction": ("1", "volume fraction in the channel that follows"),
    "wanted_mean_spacing": ("1", "mean spacing that follows, centre to centre over diameter"),
    "possible": ("1", "1, or 0 where beads would have to be closer than contact"),
}


def _words(units: str, long_name: str) -> dict[str, str]:
    return {"long_name": long_name, "units": units}


def combine(
    trains: Sequence[xr.Dataset],
    points: Sequence[xr.Dataset],
    units: xr.Dataset,
    droplet_frequency: float | None = None,
    bead_rate: float | None = None,
) -> xr.Dataset:
    """Droplets of all trains and of all conditions of the design map.

    Args:
        trains: Results of `repeats.run_repeats`, with their Deborah numbers.
        points: The same, of the design map.
        units: Of the study, at all their Deborah numbers.
        droplet_frequency: In Hz; None for the best one of each condition.
        bead_rate: Beads that are wanted in a second, for the inverse; None for none.

    Returns:
        Dataset over `condition`, and over `flow` if there is a bead rate.
    """
    rows = [row for train in trains for row in _rows(train, units, droplet_frequency, of_map=0)]
    for point in points:
        ends = point.isel(station=sorted({0, point.sizes["station"] - 1}))
        rows += _rows(ends, units, droplet_frequency, of_map=1)
    described = {name: ((), text) for name, text in CONDITION.items()} | FOUND
    for name in FOUND.keys() - set(WITHOUT_ERROR):
        dims, text = FOUND[name]
        error = f"sampling error, half width of the 95 % confidence interval, of the {text}"
        described[f"{name}_halfwidth"] = (dims, error)
    variables = {
        name: (("condition", *dims), np.array([row[name] for row in rows]), _words("1", text))
        for name, (dims, text) in sorted(described.items())
    }
    rate = np.array([row["bead_rate"] for row in rows])
    variables["bead_rate"] = (("condition",), rate, _words("s-1", "beads that enter in a second"))
    found = xr.Dataset(
        variables,
        coords={
            "count": ("count", list(COUNT), {"long_name": "beads in a droplet"}),
            "frequency_ratio": ("frequency_ratio", FREQUENCY_RATIO, _words("1", RATIO)),
        },
        attrs={name: trains[0].attrs[name] for name in KEPT if name in trains[0].attrs},
    ).set_coords(list(CONDITION))
    if bead_rate is None:
        return found
    return found.merge(inverse(bead_rate, [*trains, *points], units))


def _rows(
    train: xr.Dataset, units: xr.Dataset, droplet_frequency: float | None, of_map: int
) -> Iterator[dict]:
    """What is found at each station of a train, with its condition."""
    seconds = float(units["time"].sel(deborah=float(train["deborah"])))
    rate, stations = float(train["injection_rate"]), train["station"].values
    asked = None if droplet_frequency is None else droplet_frequency * seconds / rate
    passages = train["passage_time"].transpose("station", "repeat", "passage").values
    for station, time in zip(stations, passages, strict=True):
        yield of_passages(time, rate, asked) | {
            "deborah": float(train["deborah"]),
            "volume_fraction": float(train["volume_fraction"]),
            "feed_volume_fraction": float(train["feed_volume_fraction"]),
            "station": float(station),
            "of_map": np.int8(of_map),
            "last_station": np.int8(station == stations[-1]),
            "bead_rate": rate / seconds,
        }


def inverse(bead_rate: float, trains: Sequence[xr.Dataset], units: xr.Dataset) -> xr.Dataset:
    """What has to be poured in at each flow rate for a rate of beads.

    Args:
        bead_rate: Beads in a second.
        trains: For the velocity of a single sphere at their Deborah numbers.
        units: Of the study, at these.

    Returns:
        Dataset over `flow`, without De = 0, which has no flow rate; `possible` is 0 where beads
        would have to be closer than contact.
    """
    velocity = {float(train["deborah"]): float(train["isolated_velocity"]) for train in trains}
    deborah = sorted(De for De in velocity if De > 0)
    U_p, scales = np.array([velocity[De] for De in deborah]), units.sel(deborah=deborah)
    d = float(units["particle_diameter"]) / MILLIMETRES
    Q = scales["flow_rate"].values / MICROLITRES_PER_MINUTE
    feed = bead_rate * math.pi / 6 * d**3 / Q
    spacing = U_p * scales["mean_velocity"].values / (bead_rate * d)
    values = {
        "flow_deborah": deborah,
        "wanted_flow_rate": scales["flow_rate"].values,
        "wanted_feed_volume_fraction": feed,
        "wanted_volume_fraction": feed / U_p,
        "wanted_mean_spacing": spacing,
        "possible": (spacing > CONTACT).astype("int8"),
    }
    wanted = _words("s-1", "beads that are wanted in a second")
    return xr.Dataset(
        {name: ("flow", values[name], _words(*how)) for name, how in INVERSE.items()}
        | {"wanted_bead_rate": ((), bead_rate, wanted)}
    ).set_coords("flow_deborah")


# ----------------------------------------------------------------------------------------- words


def table(found: xr.Dataset) -> pd.DataFrame:
    """The result of `combine` in the units of the bench: one row per condition and station."""
    rate = found["bead_rate"].values
    columns = {
        "deborah": found["deborah"].values,
        "volume_fraction_percent": 100 * found["volume_fraction"].values,
        "feed_volume_fraction_percent": 100 * found["feed_volume_fraction"].values,
        "station_D": found["station"].values,
        "of": np.where(found["of_map"].values, "design_map", "trains"),
        "beads_per_second": rate,
        "droplets_per_second": rate * found["droplet_frequency_ratio"].values,
        "beads_per_droplet": found["mean_count"].values,
    }
    for n, name in enumerate(("none", "one", "two_or_more")):
        for end in ("", "_halfwidth"):
            columns[f"{name}_percent{end}"] = 100 * found[f"occupancy{end}"].values[:, n]
        columns[f"{name}_percent_poisson"] = 100 * found["poisson_occupancy"].values[:, n]
    for end in ("", "_halfwidth"):
        columns[f"best_one_percent{end}"] = 100 * found[f"best_single{end}"].values
        for name in EDGES:
            ratio = found[f"{name}_frequency_ratio{end}"].values
            columns[f"{name}_droplets_per_bead{end}"] = ratio
            columns[f"{name}_droplets_per_second{end}"] = rate * ratio
    return pd.DataFrame(columns)


def inverse_table(found: xr.Dataset) -> pd.DataFrame:
    """What has to be poured in for the wanted rate of beads: a row per flow rate, none if none."""
    columns = {
        "deborah": ("flow_deborah", 1),
        "flow_rate_uL_per_min": ("wanted_flow_rate", 1),
        "beads_per_second": ("wanted_bead_rate", 1),
        "feed_volume_fraction_percent": ("wanted_feed_volume_fraction", 100),
        "volume_fraction_percent": ("wanted_volume_fraction", 100),
        "mean_spacing_d": ("wanted_mean_spacing", 1),
        "possible": ("possible", 1),
    }
    if "wanted_bead_rate" not in found:
        return pd.DataFrame(columns=list(columns))
    values = {name: factor * found[of].values for name, (of, factor) in columns.items()}
    return pd.DataFrame(values, index=range(found.sizes["flow"]))


def best_condition(found: xr.Dataset) -> xr.Dataset:
    """The one with the most droplets of one bead at its last station, at the frequency asked for.

    At their best frequencies where that means nothing, as in Hz at De = 0.
    """
    last = found["last_station"].values == 1
    single = found["occupancy"].values[:, 1]
    single = np.where(np.isfinite(single), single, found["best_single"].values - 1)
    single = np.where(last & np.isfinite(single), single, -math.inf)
    return found.isel(condition=int(single.argmax()))


def headline(found: xr.Dataset) -> list[str]:
    """The best condition, and the inverse, in lines of text."""
    own = best_condition(found)
    if not math.isfinite(own["best_single"]):
        return [f"not counted: fewer than {FEWEST_PASSAGES} passages"]
    rate = float(own["bead_rate"])
    scale = rate if math.isfinite(rate) else 1.0

    def droplets(name: str) -> str:
        return rate_in_words(scale * float(own[f"{name}_frequency_ratio"]))

    unit = "droplets/s" if math.isfinite(rate) else "droplets per bead"
    lines = [
        f"at De = {float(own['deborah']):g}, phi = {100 * float(own['volume_fraction']):.3g} %, "
        f"z = {float(own['station']):g} D, {found.attrs['injection']} injection: one bead in "
        f"{with_errors(own, 'best_single', 1, 100)} % of the droplets",
        f"at best (sampling error; at random {100 * RANDOM_BEST:.1f} %{_as_injected(found, own)}), "
        f"{droplets('best')} {unit}; within {100 * TOLERANCE:g} % of it from {droplets('lowest')} "
        f"to {droplets('highest')};",
    ]
    if math.isfinite(own["droplet_frequency_ratio"]):
        shares, random = (
            ", ".join(f"{100 * share:.1f}" for share in own[name].values)
            for name in ("occupancy", "poisson_occupancy")
        )
        lines.append(
            f"at {droplets('droplet')} {unit}: none, one, two or more in {shares} % "
            f"(at random {random} %)"
        )
    lines += [_flow_in_words(row) for row in inverse_table(found).itertuples()]
    return [*lines, *filter(None, [found.attrs.get("channel")])]


def _as_injected(found: xr.Dataset, own: xr.Dataset) -> str:
    """The largest P(1) of the same condition at the inlet, if there is a station."""
    same = ("deborah", "volume_fraction", "of_map")
    alike = np.all([found[name].values == own[name].values for name in same], axis=0)
    at_inlet = np.flatnonzero(alike & (found["station"].values == 0.0))
    if not at_inlet.size or float(own["station"]) == 0:
        return ""
    return f", as injected {100 * float(found['best_single'][at_inlet[0]]):.1f} %"


def _flow_in_words(row) -> str:
    """A row of `inverse_table`."""
    feed = f"{row.feed_volume_fraction_percent:.3g} % in the feed"
    apart = f"beads {row.mean_spacing_d:.3g} d apart"
    return (
        f"{rate_in_words(row.beads_per_second)} beads/s at De = {row.deborah:g}, "
        f"{row.flow_rate_uL_per_min:.3g} uL/min: {feed}, {apart}"
        + ("" if row.possible else ", not possible: closer than contact")
    )
