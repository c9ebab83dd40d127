r"""Trains: many spheres in a long channel, each moved by its distances to its two neighbours.

**Motion.** Along the flow, sphere 1 trailing and N leading, with sp_i = (z_i - z_{i-1})/d and
sf_i = (z_{i+1} - z_i)/d,

    dz_1/dt = U_1(sp_2, sf_2),    dz_i/dt = U_2(sp_i, sf_i),    dz_N/dt = U_3(sp_{N-1}, sf_{N-1}),

where U_1, U_2, U_3 are the velocities of a triplet (`interpolation.TripletVelocities`). The two
spheres of a train of two are middle spheres with one neighbour at infinity, a single one with
both. Gaps below the table's smallest distance are lubricated over the whole chain: the two
velocities at one gap come from two different triplets, so a triplet's own limit would not stop
overlap.

**Injection.** A new sphere enters at z = 0 after random intervals, uniform in
[dt_eq - dt_r, dt_eq + dt_r], with dt_eq = V_p/(pi R^2 phi U_max) (`injection_law`).

**State.** y = (z_1, x_1, ..., x_{N-1}): the position of the trailing sphere, and the logarithms of
the gaps, x_j = log(s_j - 1). A gap in lubrication closes or opens exponentially, so its logarithm
changes evenly; it may close to less than the rounding of positions and open again, and never
reaches contact.

**Time.** Heun's method; steps end at every injection and every exit. Their length is controlled by
the difference between Heun's and Euler's state, which bounds the error of the latter. Within a step
y(t) is the parabola of the method's two slopes. The times at which spheres pass a station or the
outlet are roots, in closed form, of the parabola that has a sphere's velocity at the beginning and
its positions at both ends.

**Spacing at a station.** s* of a sphere is its distance, centre to centre in d, to the sphere
ahead at the moment it passes the station. Where the sphere ahead has left the channel by then
(stations within one distance of the outlet), it is the last distance of the two, at the moment it
left. So one definition holds from the inlet, where the new sphere has just entered, to the outlet.
It is NaN for a sphere that never shared the channel with the one ahead.

**Recording.** Once the first sphere has reached the outlet the whole train was injected: the next
spheres to enter are recorded, the same ones at every station.

Units: positions and times in D and D/Ubar, distances and snapshots in d, velocities in Ubar.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import stdtrit

from viscotrain.errors import TrainError
from viscotrain.table.interpolation import ROUND_OFF, ChainMotion, lubricate
from viscotrain.words import CONTACT, FEWEST_TRAIN_SPHERES, LEADING, MIDDLE, TRAILING

TOLERANCE = 1e-4  # of Euler's distances in one step, in d; Heun's are far better
LOGARITHM_TOLERANCE = 0.02  # of its gaps, relative: 1e-3 d when a gap leaves lubrication
LONGEST_STEP = 2.0  # D/Ubar
SAFETY, SHRINK, GROW = 0.8, 0.2, 2.0  # limits of the next step's length over the last one's
SNAPSHOTS = 8
TRACKED_SPHERES = 40
TRACK_STATIONS = 81  # evenly from inlet to outlet
COUNT_TIMES = 401  # of the number of spheres, evenly over a repeat
TOUCHING = 1.1  # distance in d below which two spheres count as touching
BIN_WIDTH = 0.25  # of the distribution of spacings, in d
WIDEST_BIN = 3.0  # the last bin ends at this multiple of the mean spacing
CONFIDENCE = 0.95
BALANCE = {
    "initial": "spheres in the channel at the start",
    "injected": "spheres that entered the channel",
    "removed": "spheres that left the channel",
    "remaining": "spheres in the channel at the end",
    "delayed": "injections that waited for room",
}


class Velocities(Protocol):
    """What a train needs to know; `interpolation.TripletVelocities` is one."""

    smallest_distance: float  # where lubrication begins, in d
    slowest: float  # smallest velocity, in Ubar
    isolated: float  # velocity of a single sphere, in Ubar

    def closure(self, sp: NDArray, sf: NDArray, particle: int | NDArray) -> NDArray:
        """U of one sphere of triplets at distances of shape (n,), in Ubar."""


def chain_motion(velocities: Velocities, gap: NDArray) -> ChainMotion:
    """Velocities of a train, shape (N,), from its gaps s - 1, shape (N - 1,), trailing first."""
    s = CONTACT + gap
    if s.size < 2:  # one or two spheres, each the middle one of a triplet with missing neighbours
        none = np.array([np.inf])
        sp, sf = np.concatenate([none, s]), np.concatenate([s, none])
        particle = MIDDLE
    else:
        sp = np.concatenate([s[:1], s[:-1], s[-2:-1]])
        sf = np.concatenate([s[1:2], s[1:], s[-1:]])
        particle = np.full(s.size + 1, MIDDLE)
        particle[0], particle[-1] = TRAILING, LEADING
    free = velocities.closure(sp, sf, particle)
    return lubricate(free, gap, velocities.smallest_distance - CONTACT)


# ------------------------------------------------------------------------------------ injection


@dataclass(frozen=True)
class InjectionLaw:
    """Intervals between injections in D/Ubar, uniform in mean -+ half_width."""

    mean: float
    half_width: float

    def draw(self, rng: np.random.Generator) -> float:
        """One interval."""
        return rng.uniform(self.mean - self.half_width, self.mean + self.half_width)


def injection_law(
    *, confinement: float, volume_fraction: float, centreline_velocity: float, slowest: float
) -> InjectionLaw:
    r"""The intervals that give a volume fraction, as random as they can be without overlap.

    In units of D/Ubar the mean is

        dt_eq = V_p/(pi R^2 phi U_max) = (2/3) beta^3/(phi U_max).

    The last sphere of the train must have moved by one diameter, beta D, when the next one
    enters. Its velocity in between is a mean of table entries with weights that add up to one
    (`lubricate`), so it is at least the slowest entry, and the shortest interval is beta/slowest.

    Raises:
        TrainError: The mean interval is below the shortest one.
    """
    mean = 2 / 3 * confinement**3 / (volume_fraction * centreline_velocity)
    shortest = confinement / slowest
    if mean < shortest:
        largest = volume_fraction * mean / shortest
        raise TrainError(
            f"volume fraction is {volume_fraction:g}; allowed: at most {largest:.4g}, above which "
            "spheres would enter the channel before there is room for them"
        )
    return InjectionLaw(mean, mean - shortest)


# --------------------------------------------------------------------------------------- motion


class Step(NamedTuple):
    """One step of Heun's method, of `duration` > 0, and the parabolas in between.

    Attributes:
        y: State at its beginning, shape (N,).
        start: dy/dt there.
        end: dy/dt at the end of a step of Euler's method.
        duration: Length of the step in D/Ubar.
    """

    y: NDArray
    start: NDArray
    end: NDArray
    duration: float

    def state(self, tau, item=slice(None)) -> NDArray:
        """The state, or items of it, a time `tau` after the beginning."""
        bend = (self.end[item] - self.start[item]) / (2 * self.duration)
        return self.y[item] + tau * (self.start[item] + tau * bend)

    def error(self, tolerance: float) -> float:
        """Largest error of Euler's gaps over what is allowed: above 1 the step is too long."""
        logarithm = np.abs(self.end[1:] - self.start[1:]) * (self.duration / 2)
        allowed = np.minimum(LOGARITHM_TOLERANCE, tolerance * np.exp(-self.y[1:]))
        return float(np.max(logarithm / allowed, initial=0.0))


@dataclass
class Channel:
    """What moves spheres, and how exactly.

    Args:
        velocities: Of triplets.
        confinement: d/D.
        tolerance: Of Euler's distances in one step, in d.
    """

    velocities: Velocities
    confinement: float
    tolerance: float = TOLERANCE

    def __post_init__(self):
        self._trial = LONGEST_STEP  # length of the next step

    def state(self, z: NDArray) -> NDArray:
        """State of a train, from its positions in D, trailing first."""
        gap = np.diff(z) / self.confinement - CONTACT
        return np.concatenate([z[:1], np.log(np.maximum(gap, ROUND_OFF))])

    def positions(self, y: NDArray) -> NDArray:
        """Positions of a train in D, trailing first."""
        distances = self.confinement * (CONTACT + np.exp(y[1:]))
        return np.concatenate([y[:1], distances]).cumsum()

    def motion(self, y: NDArray) -> tuple[NDArray, NDArray]:
        """Velocities of the spheres in Ubar, and dy/dt."""
        if not y.size:
            return y, y
        gap = np.exp(y[1:])
        U = chain_motion(self.velocities, gap)
        return U.velocity, np.concatenate([U.velocity[:1], U.relative / (self.confinement * gap)])

    def step(self, y: NDArray, longest: float) -> tuple[Step, NDArray]:
        """One step within the tolerance, not longer than `longest`, and velocities at its start."""
        velocity, start = self.motion(y)
        while True:
            duration = min(longest, self._trial)
            _, end = self.motion(y + duration * start)
            step = Step(y, start, end, duration)
            error = step.error(self.tolerance)
            factor = min(max(SAFETY / math.sqrt(error), SHRINK), GROW) if error > 0 else GROW
            if error > 1:
                self._trial = duration * factor
                continue
            # a step cut short by an event says little about the next one
            self._trial = min(LONGEST_STEP, max(duration * factor, self._trial))
            return step, velocity


def arrival(way: NDArray, speed: NDArray, whole_way: NDArray, duration: float) -> NDArray:
    """Time to cover `way`, of spheres that start with a speed and cover another way in `duration`.

    Their positions are taken as parabolas in time; the time is from 0 to `duration`.
    """
    bend = (whole_way / duration - speed) / duration
    tau = 2 * way / (speed + np.sqrt(speed**2 + 4 * bend * way))
    return np.minimum(np.maximum(tau, 0.0), duration)


# ----------------------------------------------------------------------------------- recording


@dataclass
class Record:
    """What one repeat leaves behind.

    Attributes:
        spacing: s* of recorded spheres at stations in d, shape (station, passage).
        passage_time: When they passed, in D/Ubar, shape (station, passage).
        snapshot_time: Times of the snapshots in D/Ubar.
        snapshots: Positions in d, trailing first, one array per snapshot.
        entry_time: When each sphere entered, in D/Ubar; the initial ones at 0.
        exit_time: When each sphere that left did so.
        remaining: Spheres in the channel at the end.
        delayed: Injections that had to wait for room, 0 by construction of `injection_law` but
            for overshoot of the interpolant.
        duration: Simulated time in D/Ubar.
    """

    spacing: NDArray
    passage_time: NDArray
    snapshot_time: list[float]
    snapshots: list[NDArray]
    entry_time: list[float]
    exit_time: list[float]
    remaining: int = 0
    delayed: int = 0
    duration: float = 0.0

    @property
    def initial(self) -> int:
        """Spheres at the start."""
        return FEWEST_TRAIN_SPHERES

    @property
    def injected(self) -> int:
        """Spheres that entered after the initial ones."""
        return len(self.entry_time) - self.initial

    @property
    def removed(self) -> int:
        """Spheres that left."""
        return len(self.exit_time)


class _Train:
    """Spheres in the channel and the record they leave; spheres are numbered as they enter."""

    def __init__(self, channel: Channel, stations: NDArray, passages: int, z: NDArray):
        self.channel, self.stations, self.z = channel, stations, z
        self.y = channel.state(z)
        self.time = 0.0
        self.passed = stations.searchsorted(z, side="right")  # stations behind each sphere
        self._next = np.append(stations, math.inf)  # the station that comes after so many
        self.last_distance = math.nan  # of the leading sphere to the one that left before it
        self.first_recorded: int | None = None
        self._missing = stations.size * passages
        shape = stations.size, passages
        self.record = Record(
            np.full(shape, np.nan), np.full(shape, np.nan), [], [], [0.0] * z.size, []
        )

    @property
    def complete(self) -> bool:
        """Whether every recorded sphere has passed every station, and all snapshots are taken."""
        return self._missing == 0 and len(self.record.snapshots) == len(self.record.snapshot_time)

    def advance(self, longest: float, outlet: float) -> bool:
        """Move on by a step, at most until the leading sphere leaves; whether it left."""
        step, velocity = self.channel.step(self.y, longest)
        tau, y = step.duration, step.state(step.duration)
        z = self.channel.positions(y)
        leaves = bool(z.size) and z[-1] >= outlet
        if leaves:
            tau = arrival(outlet - self.z[-1], velocity[-1], z[-1] - self.z[-1], step.duration)
            y = step.state(tau)
            z = self.channel.positions(y)
            z[-1] = outlet
        self._pass_stations(step, velocity, tau, z)
        self._take_snapshots(step, tau)
        self.y, self.z, self.time = y, z, self.time + float(tau)
        if leaves:
            self._remove_leading()
        return leaves

    def inject(self):
        """A new sphere at the inlet."""
        newcomer = self.channel.state(np.concatenate([[0.0], self.z[:1]]))
        self.y = np.concatenate([newcomer, self.y[1:]])
        self.z = np.concatenate([[0.0], self.z])
        self.passed = np.concatenate([[0], self.passed])
        self.record.entry_time.append(self.time)
        if self.stations[0] == 0.0:
            distance = CONTACT + np.exp(self.y[1]) if self.y.size > 1 else self.last_distance
            self._write(np.array([0]), np.array([0]), self.time, distance)
            self.passed[0] = 1

    def _remove_leading(self):
        self.last_distance = CONTACT + float(np.exp(self.y[-1])) if self.y.size > 1 else math.nan
        self.y, self.z, self.passed = self.y[:-1], self.z[:-1], self.passed[:-1]
        self.record.exit_time.append(self.time)

    def _pass_stations(self, step: Step, velocity: NDArray, duration: float, after: NDArray):
        """Record every station passed on the way to positions `after`."""
        while (i := (after >= self._next[self.passed]).nonzero()[0]).size:
            station = self.passed[i]
            way = self.stations[station] - self.z[i]
            tau = arrival(way, velocity[i], after[i] - self.z[i], duration)
            leading = i == self.z.size - 1
            ahead = np.where(
                leading, 0, i + 1
            )  # item of the state; any will do for the leading one
            distance = CONTACT + np.exp(step.state(tau, ahead))
            distance[leading] = self.last_distance
            self._write(station, i, self.time + tau, distance)
            self.passed[i] += 1

    def _write(self, station: NDArray, spheres: NDArray, time, distance):
        if self.first_recorded is None:
            return
        newest = len(self.record.entry_time) - 1
        passage = newest - spheres - self.first_recorded
        kept = (passage >= 0) & (passage < self.record.spacing.shape[1])
        where = station[kept], passage[kept]
        self.record.spacing[where] = np.broadcast_to(distance, kept.shape)[kept]
        self.record.passage_time[where] = np.broadcast_to(time, kept.shape)[kept]
        self._missing -= int(kept.sum())

    def _take_snapshots(self, step: Step, tau: float):
        taken = self.record.snapshots
        while len(taken) < len(self.record.snapshot_time):
            since = self.record.snapshot_time[len(taken)] - self.time
            if since > tau:
                return
            z = self.channel.positions(step.state(since))
            taken.append(z / self.channel.confinement)


def simulate(
    velocities: Velocities,
    *,
    confinement: float,
    volume_fraction: float,
    centreline_velocity: float,
    length: float,
    stations: Sequence[float],
    passages: int,
    rng: np.random.Generator,
    tolerance: float = TOLERANCE,
    snapshot_times: Sequence[float] | None = None,
) -> Record:
    """Simulate one train until `passages` spheres of the steady state have passed every station.

    Args:
        velocities: Velocities of triplets.
        confinement: beta = d/D.
        volume_fraction: phi.
        centreline_velocity: U_max in Ubar.
        length: Length of the channel in D.
        stations: Positions in D, ascending, in [0, length].
        passages: Spheres to record.
        rng: Source of the initial distances and the injection intervals, in this order.
        tolerance: Of the distances of Euler's method in one time step, in d.
        snapshot_times: When to take all positions, in D/Ubar after the beginning of the recording,
            ascending; by default `SNAPSHOTS` times, evenly over it. They do not change the train.

    Raises:
        TrainError: The train does not fit the channel, stations are not as above, or spheres
            were lost, which is a bug.
    """
    stations = np.asarray(stations, dtype=float)
    if not (np.all(np.diff(stations) > 0) and np.all((stations >= 0) & (stations <= length))):
        raise TrainError(f"stations are {stations.tolist()}; allowed: ascending, 0 to {length:g}")
    law = injection_law(
        confinement=confinement,
        volume_fraction=volume_fraction,
        centreline_velocity=centreline_velocity,
        slowest=velocities.slowest,
    )
    channel = Channel(velocities, confinement, tolerance)
    train = _Train(channel, stations, passages, _initial_positions(law, velocities, rng))
    if train.z[-1] >= length:
        raise TrainError(
            f"channel is {length:g} D long; allowed: more than {train.z[-1]:.3g} D, which three "
            f"spheres take at volume fraction {volume_fraction:g}"
        )
    if snapshot_times is None:
        snapshot_times = np.arange(SNAPSHOTS) * (passages * law.mean) / SNAPSHOTS
    injection = law.draw(rng)
    while not train.complete:
        if train.time < injection:
            left = train.advance(injection - train.time, length)
            if left and train.first_recorded is None:
                _begin_recording(train, snapshot_times)
        if train.time < injection:
            continue
        wait = _time_until_room(channel, train)
        if wait > 0:
            train.record.delayed += 1
            injection = train.time + wait
        else:
            train.inject()
            injection = train.time + law.draw(rng)
    return _closed(train)


def _initial_positions(law: InjectionLaw, velocities: Velocities, rng) -> NDArray:
    """The newest sphere at the inlet, the others where they would be had they been injected."""
    intervals = [law.draw(rng) for _ in range(FEWEST_TRAIN_SPHERES - 1)]
    return velocities.isolated * np.concatenate([[0.0], np.cumsum(intervals)])


def _begin_recording(train: _Train, snapshot_times: Iterable[float]):
    train.first_recorded = len(train.record.entry_time)
    train.record.snapshot_time = [train.time + float(after) for after in snapshot_times]


def _time_until_room(channel: Channel, train: _Train) -> float:
    """Time until the trailing sphere is one diameter away from the inlet; 0 if it is."""
    missing = channel.confinement - train.z[0] if train.z.size else 0.0
    return float(missing / channel.motion(train.y)[0][0]) if missing > ROUND_OFF else 0.0


def _closed(train: _Train) -> Record:
    """The record, after making sure that no sphere was lost."""
    record = train.record
    record.remaining, record.duration = train.z.size, train.time
    if record.initial + record.injected != record.removed + record.remaining:
        raise TrainError(
            f"{record.initial} initial and {record.injected} injected spheres, but "
            f"{record.removed} removed and {record.remaining} remaining ones: spheres were lost"
        )
    return record


# -------------------------------------------------------------------------------------- results


def run(
    velocities: Velocities,
    *,
    confinement: float,
    volume_fraction: float,
    centreline_velocity: float,
    length: float,
    stations: Sequence[float],
    passages: int,
    repeats: int,
    seed: int,
    factors: Iterable[tuple[str, float, str, str]] = (),
    attributes: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """Simulate all repeats at one Deborah number and volume fraction, with their statistics.

    Repeat n draws from a generator of its own, which depends on (seed, n) only: the same seed gives
    the same bits, and more repeats leave the earlier ones as they were.

    Args:
        velocities: Velocities of triplets.
        confinement: beta = d/D.
        volume_fraction: phi.
        centreline_velocity: U_max in Ubar.
        length: Length of the channel in D.
        stations: Positions in D, ascending, in [0, length].
        passages: Spheres to record in each repeat.
        repeats: Independent trains.
        seed: Seed of all of them.
        factors: Name, value, units and meaning of numbers to store as they are, such as the
            physical scales.
        attributes: Global attributes.
    """
    stations = np.asarray(stations, dtype=float)
    track_stations = np.linspace(0.0, length, TRACK_STATIONS)
    records = []
    for repeat in range(repeats):
        everywhere = np.union1d(stations, track_stations) if repeat == 0 else stations
        record = simulate(
            velocities,
            confinement=confinement,
            volume_fraction=volume_fraction,
            centreline_velocity=centreline_velocity,
            length=length,
            stations=everywhere,
            passages=passages,
            rng=np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(repeat,))),
        )
        if repeat == 0:
            track_time = record.passage_time[everywhere.searchsorted(track_stations)]
            asked = everywhere.searchsorted(stations)
            record.spacing, record.passage_time = record.spacing[asked], record.passage_time[asked]
        records.append(record)
    law = mean_spacing_law(confinement, volume_fraction)
    dataset = xr.merge(
        [
            _passages(records, stations),
            _snapshots(records),
            _numbers(records),
            _tracks(track_stations, track_time[:, :TRACKED_SPHERES], confinement),
            statistics(_passages(records, stations)["spacing"], law),
        ]
    )
    scalars = [
        ("confinement", confinement, "1", "sphere over channel diameter"),
        ("volume_fraction", volume_fraction, "1", "volume fraction of spheres"),
        ("centreline_velocity", centreline_velocity, "1", "U_max of the undisturbed flow"),
        ("isolated_velocity", velocities.isolated, "1", "velocity of a single sphere"),
        ("channel_length", length, "1", "length of the channel over its diameter"),
        ("mean_spacing_law", law, "1", "spacing of an equally spaced train, (2/3) beta^2/phi"),
        *factors,
    ]
    for name, value, units, long_name in scalars:
        dataset[name] = ((), value, {"long_name": long_name, "units": units})
    dataset.attrs = dict(attributes or {}) | {"seed": seed}
    return dataset


def mean_spacing_law(confinement: float, volume_fraction: float) -> float:
    """Spacing of an equally spaced train, s* = (2/3) beta^2/phi, in d."""
    return 2 / 3 * confinement**2 / volume_fraction


def _described(values, dims: Sequence[str], long_name: str, **attributes) -> xr.Variable:
    """A dimensionless variable."""
    return xr.Variable(dims, values, {"long_name": long_name, "units": "1", **attributes})


def _passages(records: Sequence[Record], stations: NDArray) -> xr.Dataset:
    dims = ("repeat", "station", "passage")
    return xr.Dataset(
        {
            "spacing": _described(
                np.stack([record.spacing for record in records]),
                dims,
                "distance to the sphere ahead over diameter, as the sphere passes the station",
                comment="where the sphere ahead has left, their last distance in the channel",
            ),
            "passage_time": _described(
                np.stack([record.passage_time for record in records]),
                dims,
                "time of passage times mean velocity of the flow over channel diameter",
            ),
        },
        coords={
            "station": _described(stations, ["station"], "position over channel diameter"),
            "repeat": _described(np.arange(len(records)), ["repeat"], "number of the train"),
        },
    )


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
            "snapshot_time": _described(
                time,
                ["repeat", "snapshot"],
                "time of the snapshot times mean velocity of the flow over channel diameter",
            ),
            "position": _described(
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
            "number_of_spheres": _described(
                np.stack(inside), ["repeat", "count_time"], "number of spheres in the channel"
            ),
            **{
                f"{name}_count": _described(
                    np.array([getattr(record, name) for record in records]), ["repeat"], text
                )
                for name, text in BALANCE.items()
            },
        },
        coords={
            "count_time": _described(
                time, ["count_time"], "time times mean velocity of the flow over channel diameter"
            )
        },
    )


def _tracks(stations: NDArray, time: NDArray, confinement: float) -> xr.Dataset:
    """Successive spheres of the first repeat: when they pass, and where, in the moving frame."""
    return xr.Dataset(
        {
            "track_time": _described(
                time.T,
                ["track_sphere", "track_station"],
                "time of passage times mean velocity of the flow over channel diameter",
            ),
            "track_position": _described(
                moving_frame(stations, time.T, confinement),
                ["track_sphere", "track_station"],
                "position over sphere diameter in the frame of the mean velocity of the spheres, "
                "as the sphere passes the station",
                comment="0 where the first of the spheres enters",
            ),
        },
        coords={
            "track_station": _described(
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
    velocity = (stations[-1] - stations[0]) / np.mean(time[:, -1] - time[:, 0])
    return (stations - stations[0] - velocity * (time - time[0, 0])) / confinement


# ----------------------------------------------------------------------------------- statistics


def confidence(values: NDArray) -> tuple[NDArray, NDArray]:
    """Mean over the first axis (repeats), and half the width of its 95 % confidence interval.

    Student's t over independent repeats; with a single repeat the half width is NaN.
    """
    count = len(values)
    mean = np.mean(values, axis=0)
    if count < 2:
        return mean, np.full_like(mean, np.nan)
    quantile = stdtrit(count - 1, (1 + CONFIDENCE) / 2)
    return mean, quantile * np.std(values, axis=0, ddof=1) / math.sqrt(count)


def statistics(spacing: xr.DataArray, mean_spacing: float) -> xr.Dataset:
    """Distribution of spacings at each station and its measures, over repeats.

    Args:
        spacing: s* in d, dims (repeat, station, passage).
        mean_spacing: That of an equally spaced train, which sets the range of the bins.

    Returns:
        spacing_density (station, spacing_bin), mean_spacing, spacing_mode, spacing_variation and
        touching_share (station), each with its `_halfwidth` of 95 % confidence.
    """
    s = spacing.transpose("repeat", "station", "passage").values
    bins = max(1, math.ceil((WIDEST_BIN * mean_spacing - CONTACT) / BIN_WIDTH))
    edges = CONTACT + BIN_WIDTH * np.arange(bins + 1)
    centres = (edges[1:] + edges[:-1]) / 2
    density = _density(s, edges)
    mean = np.nanmean(s, axis=-1)
    measures = {
        "spacing_density": (density, "probability density of the spacing"),
        "mean_spacing": (mean, "mean of the spacing"),
        "spacing_mode": (
            centres[density.argmax(axis=-1)],
            "most frequent spacing, centre of the highest bin",
        ),
        "spacing_variation": (
            np.nanstd(s, axis=-1) / mean,
            "coefficient of variation of the spacing",
        ),
        "touching_share": (
            _share(s < TOUCHING, s),
            f"share of spacings below {TOUCHING} sphere diameters",
        ),
    }
    variables = {}
    for name, (values, long_name) in measures.items():
        dims = ["station", "spacing_bin"] if values.ndim == 3 else ["station"]
        average, halfwidth = confidence(values)
        variables[name] = _described(average, dims, f"{long_name}, mean over repeats")
        variables[f"{name}_halfwidth"] = _described(
            halfwidth, dims, f"half width of the 95 % confidence interval of the {long_name}"
        )
    bin_centres = _described(
        centres, ["spacing_bin"], "spacing at the centre of the bin", bin_width=BIN_WIDTH
    )
    return xr.Dataset(variables, coords={"spacing_bin": bin_centres, "station": spacing["station"]})


def _density(spacing: NDArray, edges: NDArray) -> NDArray:
    """Density in bins, shape (repeat, station, bin); its integral lacks what is beyond the bins."""
    bins = len(edges) - 1
    bin_of = np.floor((np.maximum(spacing, CONTACT) - edges[0]) / BIN_WIDTH)
    inside = np.stack([_share(bin_of == n, spacing) for n in range(bins)], axis=-1)
    return inside / BIN_WIDTH


def _share(condition: NDArray, spacing: NDArray) -> NDArray:
    """Share of the known spacings that meet a condition, over passages."""
    return condition.sum(axis=-1) / np.isfinite(spacing).sum(axis=-1)


def summary(trains: xr.Dataset) -> str:
    """The result of `run` in a few lines of text."""
    counts = {name: int(trains[f"{name}_count"].sum()) for name in BALANCE}
    lines = [
        ", ".join(f"{count} {name}" for name, count in counts.items()),
        f"mean spacing of an equally spaced train: {float(trains['mean_spacing_law']):.3f} d",
        "station/D   mean spacing/d      most frequent/d     variation           touching",
    ]
    for n, station in enumerate(trains["station"].values):
        words = [
            f"{float(trains[name][n]):.3f} +- {float(trains[f'{name}_halfwidth'][n]):.3f}"
            for name in ("mean_spacing", "spacing_mode", "spacing_variation", "touching_share")
        ]
        lines.append(f"{station:<12g}" + "".join(f"{word:<20}" for word in words).rstrip())
    return "\n".join(lines)


def headline(trains: xr.Dataset) -> str:
    """The spacing at the last station in one line of text."""
    last = trains.isel(station=-1)
    return (
        f"at z = {float(last['station']):g} D: mean spacing {float(last['mean_spacing']):.2f} d, "
        f"most frequent {float(last['spacing_mode']):.2f} d, "
        f"coefficient of variation {float(last['spacing_variation']):.2f}, "
        f"touching {100 * float(last['touching_share']):.1f} %"
    )
