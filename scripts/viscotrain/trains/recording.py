"""Recording of one train: spheres enter and leave the channel, and stations write down spacings.

**Recording.** Once the first sphere has reached the outlet the whole train was injected: the next
spheres to enter are recorded, the same ones at every station.

**Spacing at a station.** s* of a sphere is its distance, centre to centre in d, to the sphere
ahead at the moment it passes the station. Where the sphere ahead has left the channel by then
(stations within one distance of the outlet), it is the last distance of the two, at the moment it
left. So one definition holds from the inlet, where the new sphere has just entered, to the outlet.
It is NaN for a sphere that never shared the channel with the one ahead.

Units: positions and times in D and D/Ubar, distances and snapshots in d, velocities in Ubar.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from viscotrain.errors import TrainError
from viscotrain.fluid.channel import ROUND, CrossSection
from viscotrain.table.lubrication import ROUND_OFF
from viscotrain.trains.closures import Closure
from viscotrain.trains.far_field import FarField
from viscotrain.trains.injection import InjectionLaw, initial_positions, injection_law
from viscotrain.trains.motion import TOLERANCE, Channel, Step, arrival, logarithm, parabola
from viscotrain.trains.sizes import EQUAL, Sizes, contact
from viscotrain.words import FEWEST_TRAIN_SPHERES

SNAPSHOTS = 8


@dataclass
class Record:
    """What one repeat leaves behind.

    Attributes:
        spacing: s* of recorded spheres at stations in d, shape (station, passage).
        contact: Distance in d at which they touch the sphere ahead, shape (passage,).
        deviation: (d_i - d)/d of all spheres, in the order in which they entered.
        passage_time: When they passed, in D/Ubar, shape (station, passage).
        snapshot_time: Times of the snapshots in D/Ubar.
        snapshots: Positions in d, trailing first, one array per snapshot.
        snapshot_deviations: (d_i - d)/d of these spheres.
        entry_time: When each sphere entered, in D/Ubar; the initial ones at 0.
        exit_time: When each sphere that left did so.
        remaining: Spheres in the channel at the end.
        delayed: Injections that had to wait for room, which `injection_law` makes rare.
        first_recorded: Number of the first recorded sphere in this order.
        duration: Simulated time in D/Ubar.
        fastest: Largest relative velocity of neighbours at any time, in Ubar.
    """

    spacing: NDArray
    contact: NDArray
    deviation: list[float]
    passage_time: NDArray
    snapshot_time: list[float]
    snapshots: list[NDArray]
    snapshot_deviations: list[NDArray]
    entry_time: list[float]
    exit_time: list[float]
    first_recorded: int = 0
    remaining: int = 0
    delayed: int = 0
    duration: float = 0.0
    fastest: float = 0.0

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

    def __init__(
        self,
        channel: Channel,
        stations: NDArray,
        passages: int,
        z: NDArray,
        diameters: Iterator[float],
    ):
        self.channel, self.stations, self.z = channel, stations, z
        self._diameters = diameters
        entered = [next(diameters) for _ in z]  # the leading one first
        self.newcomer = next(diameters)  # that of the sphere which enters next
        self._hold(np.array(entered[::-1]))
        self.y = channel.state(z)
        start = channel.distances(self.y)
        self.far = FarField(channel.closure, channel.confinement, channel.tolerance, start)
        self.time = 0.0
        self.passed = stations.searchsorted(z, side="right")  # stations behind each sphere
        self.last_distance = math.nan  # of the leading sphere to the one that left before it
        self.first_recorded: int | None = None
        self._missing = stations.size * passages
        shape = stations.size, passages
        self.record = Record(
            spacing=np.full(shape, np.nan),
            contact=np.full(passages, np.nan),
            deviation=entered,
            passage_time=np.full(shape, np.nan),
            snapshot_time=[],
            snapshots=[],
            snapshot_deviations=[],
            entry_time=[0.0] * z.size,
            exit_time=[],
        )

    def _hold(self, deviation: NDArray):
        self.deviation, self.contact = deviation, self.channel.hold(deviation)

    @property
    def complete(self) -> bool:
        """Whether every recorded sphere has passed every station, and all snapshots are taken."""
        return self._missing == 0 and len(self.record.snapshots) == len(self.record.snapshot_time)

    def advance(self, longest: float, outlet: float) -> bool:
        """Move on by a step, at most until the leading sphere leaves; whether it left."""
        step, velocity = self.channel.step(self.y, longest, self.far)
        tau, y = step.duration, step.state(step.duration)
        distance = self.channel.distances(y)
        z = self.channel.positions(y, distance)
        leaves = bool(z.size) and z[-1] >= outlet
        if leaves:
            way = z[-1] - self.z[-1]
            tau = float(arrival(outlet - self.z[-1], velocity[-1], way, step.duration))
            y = step.state(tau)
            distance = self.channel.distances(y)
            z = self.channel.positions(y, distance)
            z[-1] = outlet
        self._pass_stations(step, velocity, tau, z)
        self._take_snapshots(step, tau)
        self.y, self.z, self.time = y, z, self.time + tau
        self.far.advance(tau, distance)
        if leaves:
            self._remove_leading()
        return leaves

    def inject(self):
        """A new sphere at the inlet."""
        self._hold(np.concatenate([[self.newcomer], self.deviation]))
        self.record.deviation.append(self.newcomer)
        self.newcomer = next(self._diameters)
        gap = self.z[:1] / self.channel.confinement - self.contact[:1]
        self.y = np.concatenate([[0.0], logarithm(gap), self.y[1:]])
        self.far.enter(self.channel.distances(self.y))
        self.z = np.concatenate([[0.0], self.z])
        self.passed = np.concatenate([[0], self.passed])
        self.record.entry_time.append(self.time)
        if self.stations[0] == 0.0:
            self.passed[0] = 1
            if self.y.size > 1:
                self._write_newest(self.contact[0] + math.exp(self.y[1]))
            else:
                self._write_newest(self.last_distance)

    def _write_newest(self, distance: float):
        """Record the sphere that has just entered at the first station."""
        passage = self._newest_passage
        if 0 <= passage < self.record.contact.size:
            self.record.spacing[0, passage] = distance
            self.record.passage_time[0, passage] = self.time
            self._missing -= 1

    def _remove_leading(self):
        self.last_distance = math.nan
        if self.y.size > 1:
            self.last_distance = float(self.contact[-1] + np.exp(self.y[-1]))
        self.far.leave(self.channel.distances(self.y))
        self._hold(self.deviation[:-1])
        self.y, self.z, self.passed = self.y[:-1], self.z[:-1], self.passed[:-1]
        self.record.exit_time.append(self.time)

    def _pass_stations(self, step: Step, velocity: NDArray, duration: float, after: NDArray):
        """Record every station passed on the way to positions `after`."""
        written = _pass_stations(
            self.passed,
            self.stations,
            (self.z, velocity, after, duration),
            step,
            (self.contact, self.last_distance),
            (self._newest_passage, self.record.spacing, self.record.passage_time, self.time),
        )
        self._missing -= written

    @property
    def _newest_passage(self) -> int:
        """Number among recorded spheres of the one that entered last; negative of none."""
        if self.first_recorded is None:
            return -1
        return len(self.record.entry_time) - 1 - self.first_recorded

    def _take_snapshots(self, step: Step, tau: float):
        taken = self.record.snapshots
        while len(taken) < len(self.record.snapshot_time):
            since = self.record.snapshot_time[len(taken)] - self.time
            if since > tau:
                return
            z = self.channel.positions(step.state(since))
            taken.append(z / self.channel.confinement)
            self.record.snapshot_deviations.append(self.deviation)


def record_train(
    closure: Closure,
    *,
    confinement: float,
    volume_fraction: float,
    injection: str = "uniform",
    length: float,
    stations: Sequence[float] | NDArray,
    passages: int,
    rng: np.random.Generator,
    tolerance: float = TOLERANCE,
    snapshot_times: Sequence[float] | NDArray | None = None,
    sizes: Sizes = EQUAL,
    section: CrossSection = ROUND,
) -> Record:
    """Simulate one train until `passages` spheres of the steady state have passed every station.

    Args:
        closure: Velocities of trains.
        confinement: beta = d/D.
        volume_fraction: phi, in the channel.
        injection: Name of one of `injection.INJECTIONS`.
        length: Length of the channel in D.
        stations: Positions in D, ascending, in [0, length].
        passages: Spheres to record.
        rng: Source of the initial distances and the injection intervals, in this order; a child of
            it is that of diameters.
        tolerance: Of the distances of Euler's method in one time step, in d.
        snapshot_times: When to take all positions, in D/Ubar after the beginning of the recording,
            ascending; by default `SNAPSHOTS` times, evenly over it. They do not change the train.
        sizes: How diameters vary.
        section: Of the channel.

    Raises:
        TrainError: The train does not fit the channel, stations are not as above, or spheres
            were lost, which is a bug.
    """
    places = _checked(stations, length)
    law = injection_law(
        injection=injection,
        confinement=confinement,
        volume_fraction=volume_fraction,
        velocity=closure.isolated,
        slowest=closure.slowest,
        section=section,
    )
    channel = Channel(closure, confinement, tolerance, sizes.response)
    (own,) = rng.spawn(1)
    diameters = (sizes.draw(own) for _ in itertools.count())
    z = initial_positions(law, closure.isolated, rng)
    train = _Train(channel, places, passages, z, diameters)
    _refuse_short_channel(train, length, volume_fraction)
    if snapshot_times is None:
        snapshot_times = np.arange(SNAPSHOTS) * (passages * law.mean) / SNAPSHOTS
    _flow_through(train, length, law, rng, snapshot_times)
    return _closed(train)


def _checked(stations: Sequence[float] | NDArray, length: float) -> NDArray:
    """Stations that ascend within the channel."""
    places = np.asarray(stations, dtype=float)
    if not (np.all(np.diff(places) > 0) and np.all((places >= 0) & (places <= length))):
        raise TrainError(f"stations are {places.tolist()}; allowed: ascending, 0 to {length:g}")
    return places


def _refuse_short_channel(train: _Train, length: float, volume_fraction: float):
    if train.z[-1] >= length:
        raise TrainError(
            f"channel is {length:g} D long; allowed: more than {train.z[-1]:.3g} D, which three "
            f"spheres take at volume fraction {volume_fraction:g}"
        )


def _flow_through(
    train: _Train,
    length: float,
    law: InjectionLaw,
    rng: np.random.Generator,
    snapshot_times: Sequence[float] | NDArray,
):
    """Inject spheres and move them on until the record is complete."""
    injection = law.draw(rng)
    while not train.complete:
        if train.time < injection:
            left = train.advance(injection - train.time, length)
            if left and train.first_recorded is None:
                _begin_recording(train, snapshot_times)
        if train.time < injection:
            continue
        wait = _time_until_room(train)
        if wait > 0:
            train.record.delayed += 1
            injection = train.time + wait
        else:
            train.inject()
            injection = train.time + law.draw(rng)


def _begin_recording(train: _Train, snapshot_times: Iterable):
    train.first_recorded = len(train.record.entry_time)
    train.record.snapshot_time = [train.time + float(after) for after in snapshot_times]


def _time_until_room(train: _Train) -> float:
    """Time until the next sphere has room at the inlet; 0 if it has."""
    channel = train.channel
    if not train.z.size:
        return 0.0
    touching = contact(np.array([train.newcomer, train.deviation[0]]))[0]
    missing = channel.confinement * touching - train.z[0]
    if missing <= ROUND_OFF:
        return 0.0
    velocity, _ = channel.motion(train.y, train.far.after(0.0))
    return float(missing / velocity[0])


def _closed(train: _Train) -> Record:
    """The record, after making sure that no sphere was lost."""
    record = train.record
    record.remaining, record.duration = train.z.size, train.time
    record.fastest = train.channel.fastest
    assert train.first_recorded is not None  # or it would not be complete
    record.first_recorded = first = train.first_recorded
    record.contact = contact(np.array(record.deviation[first - 1 : first + record.contact.size]))
    if record.initial + record.injected != record.removed + record.remaining:
        raise TrainError(
            f"{record.initial} initial and {record.injected} injected spheres, but "
            f"{record.removed} removed and {record.remaining} remaining ones: spheres were lost"
        )
    return record


@numba.njit(cache=True, error_model="numpy")
def _pass_stations(passed, stations, motion, step, neighbours, record):
    """Record every station that spheres pass in a step; how many entries of the record are new.

    Args:
        passed: Stations behind each sphere; changed.
        stations: In D, ascending.
        motion: Positions and velocities of spheres at the beginning of the step, positions after a
            duration, and this.
        step: The items of the `Step`.
        neighbours: Distances at which neighbours touch, and the last one of the leading sphere.
        record: Passage of the trailing sphere, the arrays that are written, the time.
    """
    z, velocity, after, duration = motion
    y, start, end, whole = step
    contact, last_distance = neighbours
    trailing, spacing, passage_time, time = record
    written = 0
    for i in range(z.size):
        while passed[i] < stations.size and after[i] >= stations[passed[i]]:
            station, passage = passed[i], trailing - i
            passed[i] += 1
            if passage < 0 or passage >= spacing.shape[1]:
                continue
            tau = arrival(stations[station] - z[i], velocity[i], after[i] - z[i], duration)
            if i < z.size - 1:
                x = parabola(y[i + 1], start[i + 1], end[i + 1], whole, tau)
                spacing[station, passage] = contact[i] + math.exp(x)
            else:
                spacing[station, passage] = last_distance
            passage_time[station, passage] = time + tau
            written += 1
    return written
