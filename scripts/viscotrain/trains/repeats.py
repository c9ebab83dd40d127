"""What the trains stage stores: all repeats of one condition as a dataset, and it in words."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from viscotrain.fluid.channel import ROUND, CrossSection
from viscotrain.table.attributes import ATTRIBUTES
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.memory import largest, memory_number, remark
from viscotrain.table.size_response import UNKNOWN, SizeResponse
from viscotrain.trains import model_error
from viscotrain.trains.closures import Velocities, make_closure
from viscotrain.trains.condition import Condition, baseline, model_errors
from viscotrain.trains.injection import channel_volume_fraction, feed_volume_fraction
from viscotrain.trains.recording import SNAPSHOTS, Record
from viscotrain.trains.sizes import Sizes
from viscotrain.trains.statistics import MODE, statistics
from viscotrain.trains.variables import (
    amounts_in_words,
    described,
    rate_in_words,
    unequal,
    with_errors,
)
from viscotrain.words import DEBORAH_NUMBERS, repeated

TRACKED_SPHERES = 40
TRACK_STATIONS = 81  # evenly from inlet to outlet
COUNT_TIMES = 401  # of the number of spheres, evenly over a repeat
BALANCE = {
    "initial": "spheres in the channel at the start",
    "injected": "spheres that entered the channel",
    "removed": "spheres that left the channel",
    "remaining": "spheres in the channel at the end",
    "delayed": "injections that waited for room",
}
VARIATION, RESPONSE = "diameter_variation", "size_response"
FEED, CHANNEL = "feed_volume_fraction", "volume_fraction"
SCALARS = {
    "confinement": "sphere over channel diameter",
    CHANNEL: "volume fraction of spheres in the channel",
    FEED: "volume fraction of spheres in what is poured in",
    "injection_rate": "spheres that enter in a time of channel diameter over mean velocity",
    "centreline_velocity": "U_max of the undisturbed flow",
    "isolated_velocity": "velocity of a single sphere",
    "channel_length": "length of the channel over its diameter",
    "mean_spacing_law": "spacing of an equally spaced train, (2/3) beta^2/phi in a tube",
    VARIATION: "coefficient of variation of the diameters of the spheres",
    RESPONSE: "change of a sphere's velocity with the logarithm of its diameter, over mean "
    "velocity; 0 where all are equal",
}


def run_repeats(
    velocities: Velocities,
    *,
    closure: str = "every_sphere",
    injection: str = "uniform",
    memory_strength: float = 0.0,
    confinement: float,
    volume_fraction: float,
    feed: bool = False,
    centreline_velocity: float,
    length: float,
    stations: Sequence[float],
    passages: int,
    repeats: int,
    seed: int,
    diameter_variation: float = 0.0,
    size_response: SizeResponse = UNKNOWN,
    interpolation_error: float = math.nan,
    section: CrossSection = ROUND,
    attributes: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """Simulate all repeats at one Deborah number and volume fraction, with their statistics.

    Args:
        velocities: Velocities of triplets.
        closure: Name of one of `CLOSURES`, which makes velocities of trains of them.
        injection: Name of one of `INJECTIONS`, the law of the intervals.
        memory_strength: c De/beta of `closures.WithMemory`, in 1/Ubar.
        confinement: beta = d/D.
        volume_fraction: phi in the channel, or phi_feed.
        feed: Whether the volume fraction is that of what is poured in.
        centreline_velocity: U_max in Ubar.
        length: Length of the channel in D.
        stations: Positions in D, ascending, in [0, length].
        passages: Spheres to record in each repeat.
        repeats: Independent trains.
        seed: Of all of them.
        diameter_variation: Coefficient of variation of the diameters.
        size_response: U' and its error; not looked at where all spheres are equal.
        interpolation_error: That of `model_error.interpolation_error`, in Ubar; NaN: not known.
        section: Of the channel.
        attributes: Global attributes.
    """
    closed = make_closure(closure, velocities, memory_strength)
    phi = channel_volume_fraction(volume_fraction, closed.isolated) if feed else volume_fraction
    equal = Condition(closed, injection, confinement, phi, length, passages, seed, section=section)
    own = equal.with_sizes(Sizes(diameter_variation, size_response.value))
    dataset = _recorded(own, np.asarray(stations, dtype=float), repeats)
    wrong = model_error.variants(velocities, closure, closed, interpolation_error, memory_strength)
    others = own.a_little_wrong(wrong, size_response.error)
    scalars = _scalars(own, centreline_velocity)
    dataset = dataset.assign(model_errors(own, dataset, others)).assign(baseline(own) | scalars)
    dataset[FEED if feed else CHANNEL].values = np.array(volume_fraction)  # not rounded
    words = model_error.in_words(interpolation_error, repeated(repeats), "sizes" in others)
    chosen = {"seed": seed, "closure": closure, "memory_strength": memory_strength}
    given = {"injection": injection, "given": FEED if feed else CHANNEL, "model_error": words}
    return dataset.assign_attrs({**(attributes or {}), **section.attributes, **chosen, **given})


def _recorded(own: Condition, stations: NDArray, repeats: int) -> xr.Dataset:
    """What all repeats have recorded, with its statistics, and tracks of the first one."""
    track_stations = np.linspace(0.0, own.length, TRACK_STATIONS)
    everywhere = np.union1d(stations, track_stations)
    records = [own.record(n, stations if n else everywhere) for n in range(repeats)]
    time = _apart(records[0], stations, track_stations)
    tracks = _tracks(track_stations, time, own.confinement)
    return xr.merge([_results(records, stations, own.mean_spacing), tracks])


def _scalars(own: Condition, centreline_velocity: float) -> dict[str, xr.Variable]:
    """What does not vary within a train."""
    values = {
        "confinement": own.confinement,
        CHANNEL: own.volume_fraction,
        FEED: feed_volume_fraction(own.volume_fraction, own.closure.isolated),
        "injection_rate": 1 / own.law.mean,
        "centreline_velocity": centreline_velocity,
        "isolated_velocity": own.closure.isolated,
        "channel_length": own.length,
        "mean_spacing_law": own.mean_spacing,
        VARIATION: own.sizes.variation,
        RESPONSE: own.sizes.response,
    }
    return {name: described(value, [], SCALARS[name]) for name, value in values.items()}


def deborah_numbers(table: VelocityTable, deborah: float) -> dict[str, xr.Variable]:
    """Deborah numbers of a flow of the table, in all definitions, as variables of a train."""
    flow = table.dataset.isel(deborah=table.index(deborah))
    return {name: described(flow[name].values, [], text) for name, text in DEBORAH_NUMBERS.items()}


def with_memory_numbers(trains: xr.Dataset) -> xr.Dataset:
    """Trains with `memory_number` (repeat), the largest of all gaps at all times.

    Args:
        trains: Result of `run_repeats`, with its Deborah numbers.
    """
    M = memory_number(
        float(trains["deborah_longest_mode"]),
        trains["largest_relative_velocity"].values,
        float(trains["confinement"]),
    )
    return trains.assign(memory_number=(["repeat"], M, ATTRIBUTES["memory_number"]))


def _results(records: Sequence[Record], stations: NDArray, law: float) -> xr.Dataset:
    """What all repeats have recorded, and its statistics."""
    passages = _passages(records, stations)
    measures = statistics(passages["spacing"], law, passages["contact_distance"])
    return xr.merge([passages, _snapshots(records), _numbers(records), measures])


def _apart(record: Record, stations: NDArray, track_stations: NDArray) -> NDArray:
    """Take the passages of `track_stations` out of a record that holds both; their times."""
    everywhere = np.union1d(stations, track_stations)
    time = record.passage_time[everywhere.searchsorted(track_stations)]
    asked = everywhere.searchsorted(stations)
    record.spacing, record.passage_time = record.spacing[asked], record.passage_time[asked]
    return time


def _passages(records: Sequence[Record], stations: NDArray) -> xr.Dataset:
    dims = ("repeat", "station", "passage")
    return xr.Dataset(
        {
            "spacing": described(
                np.stack([record.spacing for record in records]),
                dims,
                "distance to the sphere ahead over diameter, as the sphere passes the station",
                comment="where the sphere ahead has left, their last distance in the channel",
            ),
            "diameter": described(
                np.stack([_diameters(record) for record in records]),
                (dims[0], dims[2]),
                "diameter of the sphere over the mean of all",
            ),
            "contact_distance": described(
                np.stack([record.contact for record in records]),
                (dims[0], dims[2]),
                "distance at which it touches the sphere ahead, centre to centre over diameter",
            ),
            "passage_time": described(
                np.stack([record.passage_time for record in records]),
                dims,
                "time of passage times mean velocity of the flow over channel diameter",
            ),
        },
        coords={
            "station": described(stations, ["station"], "position over channel diameter"),
            "repeat": described(np.arange(len(records)), ["repeat"], "number of the train"),
        },
    )


def _diameters(record: Record) -> NDArray:
    """Of the recorded spheres over the mean diameter, shape (passage,)."""
    first, passages = record.first_recorded, record.contact.size
    return 1 + np.array(record.deviation[first : first + passages])


def _snapshots(records: Sequence[Record]) -> xr.Dataset:
    spheres = max((z.size for record in records for z in record.snapshots), default=0)
    time = np.full((len(records), SNAPSHOTS), np.nan)
    position = np.full((*time.shape, spheres), np.nan)
    for r, record in enumerate(records):
        for n, z in enumerate(record.snapshots):
            time[r, n] = record.snapshot_time[n]
            position[r, n, : z.size] = z
    return xr.Dataset(
        {
            "snapshot_time": described(
                time,
                ["repeat", "snapshot"],
                "time of the snapshot times mean velocity of the flow over channel diameter",
            ),
            "position": described(
                position,
                ["repeat", "snapshot", "sphere"],
                "position over sphere diameter, the trailing sphere first",
                comment="NaN after the leading sphere",
            ),
        }
    )


def _numbers(records: Sequence[Record]) -> xr.Dataset:
    """Number of spheres against time, and the balance."""
    time = np.linspace(0.0, min(record.duration for record in records), COUNT_TIMES)
    inside = [
        np.searchsorted(record.entry_time, time, side="right")
        - np.searchsorted(record.exit_time, time, side="right")
        for record in records
    ]
    return xr.Dataset(
        {
            "largest_relative_velocity": described(
                np.array([record.fastest for record in records]),
                ["repeat"],
                "largest relative velocity of neighbours at any time, over mean velocity",
            ),
            "number_of_spheres": described(
                np.stack(inside), ["repeat", "count_time"], "number of spheres in the channel"
            ),
            **{
                f"{name}_count": described(
                    np.array([getattr(record, name) for record in records]), ["repeat"], text
                )
                for name, text in BALANCE.items()
            },
        },
        coords={
            "count_time": described(
                time, ["count_time"], "time times mean velocity of the flow over channel diameter"
            )
        },
    )


def _tracks(stations: NDArray, time: NDArray, confinement: float) -> xr.Dataset:
    """Successive spheres of the first repeat: when they pass, and where, in the moving frame."""
    time = time[:, :TRACKED_SPHERES]
    return xr.Dataset(
        {
            "track_time": described(
                time.T,
                ["track_sphere", "track_station"],
                "time of passage times mean velocity of the flow over channel diameter",
            ),
            "track_position": described(
                moving_frame(stations, time.T, confinement),
                ["track_sphere", "track_station"],
                "position over sphere diameter in the frame of the mean velocity of the spheres, "
                "as the sphere passes the station",
                comment="0 where the first of the spheres enters",
            ),
        },
        coords={
            "track_station": described(
                stations, ["track_station"], "position over channel diameter"
            )
        },
    )


def moving_frame(stations: NDArray, time: NDArray, confinement: float) -> NDArray:
    """Positions of spheres, as they pass stations, in a frame that moves at their mean velocity.

    Args:
        stations: Positions in D, ascending, shape (station,).
        time: Times of passage in D/Ubar, shape (sphere, station), spheres in order of passage.
        confinement: d/D.

    Returns:
        Positions in d, shape (sphere, station); 0 where the first sphere passes the first station.
    """
    velocity = _mean_velocity(stations, time)
    return (stations - stations[0] - velocity * (time - time[0, 0])) / confinement


def tracked_velocity(train: xr.Dataset) -> float:
    """Mean velocity, over that of the flow, of the tracked spheres from inlet to outlet."""
    return float(_mean_velocity(train["track_station"].values, train["track_time"].values))


def _mean_velocity(stations: NDArray, time: NDArray) -> float:
    """Way from the first to the last station over the mean time that spheres took for it."""
    return (stations[-1] - stations[0]) / np.mean(time[:, -1] - time[:, 0])


IN_WORDS = {  # by column: statistic, decimals, factor
    "mean spacing/d": ("mean_spacing", 2, 1.0),
    "most frequent/d": (MODE, 1, 1.0),
    "variation": ("spacing_variation", 3, 1.0),
    "within 20 %/%": ("even_share", 1, 100.0),
    "touching/%": ("touching_share", 1, 100.0),
}


def amount(trains: xr.Dataset) -> str:
    """How much enters, and how, in words."""
    channel, feed = amounts_in_words(trains)
    return (
        f"phi = {channel} % in the channel, {feed} % in the feed, "
        f"{trains.attrs['injection']} injection"
        f"{unequal(trains)}"
    )


def summary(trains: xr.Dataset) -> str:
    """The result of `run_repeats` in a few lines of text."""
    counts = {name: int(trains[f"{name}_count"].sum()) for name in BALANCE}
    memory = f"memory number: {largest(trains):.2g} {remark(trains)}"
    lines = [
        ", ".join(f"{count} {name}" for name, count in counts.items()),
        f"{amount(trains)}: {float(trains['injection_rate']):.3g} Ubar/D",
        memory.rstrip(),
        *filter(None, [trains.attrs.get("channel")]),
        f"mean spacing of an equally spaced train: {float(trains['mean_spacing_law']):.3f} d",
        "each +- sampling error (95 %) +- model error",
        f"model error from {trains.attrs['model_error']}",
        "station/D   " + "".join(f"{words:<28}" for words in IN_WORDS).rstrip(),
    ]
    for n, station in enumerate(trains["station"].values):
        own = trains.isel(station=n)
        words = [with_errors(own, *how) for how in IN_WORDS.values()]
        lines.append(f"{station:<12g}" + "".join(f"{word:<28}" for word in words).rstrip())
    return "\n".join(lines)


def headline(trains: xr.Dataset, seconds: float = math.nan) -> list[str]:
    """How much enters, and the spacing at the last station, in lines of text.

    Args:
        trains: Result of `run_repeats`.
        seconds: D/Ubar in s, if there is a velocity.
    """
    last, rate = trains.isel(station=-1), float(trains["injection_rate"])
    own = {how[0]: with_errors(last, *how) for how in IN_WORDS.values()}
    per_second = f"{rate_in_words(rate / seconds)} spheres/s"
    enter = per_second if math.isfinite(seconds) else f"{rate:.3g} Ubar/D"
    return [
        f"{amount(trains)}, {enter}",
        f"at z = {float(last['station']):g} D, +- sampling +- model error: "
        f"mean spacing {own['mean_spacing']} d, most frequent {own[MODE]}"
        f"{' d' if math.isfinite(float(last[MODE])) else ''},",
        f"CV {own['spacing_variation']}, within 20 % of the mean {own['even_share']} %, "
        f"touching {own['touching_share']} % of the spheres "
        f"({100 * float(last['touching_share_injected']):.1f} % by the injection)",
        *filter(None, [remark(trains), trains.attrs.get("channel")]),
    ]
