"""What is wrong with a config: problems between its keys, and all problems in words.

Two kinds of problems end in the same form, `key: found ...; allowed: ...`:

- a key that the models in `config` refuse. `problem_of_key` rewords the validation error with the
  range that the JSON schema of the models gives for that key, so ranges are stated once.
- keys that do not agree. The functions in `_CHECKS` find these, each from the few keys it names. A
  check whose keys are missing or wrong themselves is left out; all the others still report.
"""

import contextlib
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence

from viscotrain.config.device_problems import (
    section_of,
    sides_suit_the_shape,
    sphere_fits_channel,
)
from viscotrain.config.readable import Check, Readable, Unreadable, conflict
from viscotrain.config.wording import Problem, shown
from viscotrain.words import FASTEST, FEWEST_TRAIN_SPHERES

CLOSEST_NODES = 1.0001  # ratio of neighbouring distances: closer ones make an interpolant of noise
INFINITY = math.inf  # the distance to a neighbour that does not exist


def disagreements(config: Readable) -> list[Problem]:
    """Problems between keys, as far as the keys themselves can be read."""
    return _found(_CHECKS, config)


def disagreements_of_verification(config: Readable) -> list[Problem]:
    """Those of the section `verification` with others: they matter once a verification is made."""
    return _found(_CHECKS_OF_VERIFICATION, config)


def _found(checks: Sequence[Check], config: Readable) -> list[Problem]:
    problems: list[Problem] = []
    for check in checks:
        with contextlib.suppress(Unreadable):
            problems.extend(check(config))
    return problems


def _ascending(key: str, ratio: float = 1.0):
    """Values that grow, by a factor of `ratio` at least if it is more than 1."""

    def check(config: Readable) -> Iterator[Problem]:
        for (_, before), (location, value) in itertools.pairwise(config.indexed(key)):
            if not value > before:
                allowed = f"more than the value before it, {shown(before)}"
                yield conflict(location, value, allowed)
            elif value < ratio * before:
                allowed = f"at least {ratio:g} times the value before it, {shown(before)}"
                yield conflict(location, value, allowed)

    return check


def _descending(key: str):
    def check(config: Readable) -> Iterator[Problem]:
        for (_, before), (location, value) in itertools.pairwise(config.indexed(key)):
            if not value < before:
                yield conflict(location, value, f"less than the value before it, {shown(before)}")

    return check


def _unrepeated(key: str):
    def check(config: Readable) -> Iterator[Problem]:
        seen = set()
        for location, value in config.indexed(key):
            if value in seen:
                yield Problem(location, f"found {shown(value)} again; allowed: every value once")
            seen.add(value)

    return check


def _closed(key: str):
    def check(config: Readable) -> Iterator[Problem]:
        items = config.items(key)
        if items and items[-1] not in (None, INFINITY):
            allowed = ".inf (no neighbour), so that the table needs no extrapolation"
            yield conflict(
                (*key.split("."), len(items) - 1), items[-1], f"as the last one {allowed}"
            )

    return check


def _member(key: str, of: str, default: str = ""):
    """Values that another list has; `default` is the list that stands for it if it is null."""

    def check(config: Readable) -> Iterator[Problem]:
        name = of if _given(config, of) or not default else default
        values = config.items(name)
        if None in values or not values:
            return
        for location, value in config.indexed(key):
            if value not in values:
                allowed = f"one of {name} ({', '.join(map(shown, values))})"
                yield conflict(location, value, allowed)

    return check


def _table_is_computed_or_given(config: Readable) -> Iterator[Problem]:
    table = config.value("table")
    if not isinstance(table, Mapping):
        return
    given = [name for name in ("sp", "sf", "pair") if table.get(name)]
    if table.get("line_spacing", 1) != 1:
        given.append("line_spacing")
    if table.get("file") is None:
        for name in [name for name in ("sp", "sf") if name not in given]:
            allowed = "list of distances, or table.file in its place"
            yield Problem(("table", name), f"missing; allowed: {allowed}")
        return
    for name in given:
        yield Problem(("table", name), "found with table.file; allowed: one of the two")


def _lines_are_checked(config: Readable) -> Iterator[Problem]:
    spacing = config.value("table.line_spacing")
    if isinstance(spacing, int) and spacing > 1 and config.value("table.check") == 0:
        allowed = "at least 1 with table.line_spacing above 1, whose error it measures"
        yield conflict(("table", "check"), 0, allowed)


def _fluid_is_written_or_fitted(config: Readable) -> Iterator[Problem]:
    fluid = config.value("fluid")
    if not isinstance(fluid, Mapping):
        return
    given = {name for name in ("solvent_viscosity", "modes", "data") if fluid.get(name) is not None}
    if "data" not in given:
        for name, allowed in (
            ("solvent_viscosity", "number > 0"),
            ("modes", "list of modes, or fluid.data in its place"),
        ):
            if name not in given:
                yield Problem(("fluid", name), f"missing; allowed: {allowed}")
    elif "modes" in given:
        yield Problem(("fluid", "data"), "found with fluid.modes; allowed: one of the two")
    if "data" not in given and fluid.get("fit"):
        yield Problem(("fluid", "fit"), "found without fluid.data; allowed: with it only")


def _of_fitted_modes(key: str):
    """Known numbers are of modes that there are."""

    def check(config: Readable) -> Iterator[Problem]:
        count = config.value("fluid.fit.modes")
        for location, value in config.indexed(key):
            if count is not None and location[-1] >= count:
                yield conflict(location, value, f"at most {count} in the list, fluid.fit.modes")

    return check


def _deborah_needs_modes(config: Readable) -> Iterator[Problem]:
    modes = config.value("fluid.modes")
    if modes is None or len(modes) > 0:
        return
    for location, De in config.indexed("deborah.values"):
        if De > 0:
            yield conflict(location, De, "0, because fluid.modes is empty: no relaxation time")


def _start_up_needs_modes(config: Readable) -> Iterator[Problem]:
    points = config.items("verification.transient")
    modes = config.value("fluid.modes")
    if points and modes is not None and len(modes) == 0:
        location = ("verification", "transient")
        yield conflict(location, len(points), "none, because fluid.modes is empty: no start-up")


def _switched_off(config: Readable, section: str) -> bool:
    """Whether a section makes nothing, because its list of Deborah numbers is empty."""
    with contextlib.suppress(Unreadable):
        found = config.value(f"{section}.deborah")
        return isinstance(found, Sequence) and len(found) == 0
    return False


def _if_made(section: str, check: Check) -> Check:
    def of_section(config: Readable) -> Iterator[Problem]:
        if not _switched_off(config, section):
            yield from check(config)

    return of_section


def _one_way_to_say_how_much(section: str, needed: bool):
    """Volume fractions of the channel or of the feed: both never, none only where not needed."""
    one, other = f"{section}.volume_fraction", f"{section}.feed_volume_fraction"

    def check(config: Readable) -> Iterator[Problem]:
        given = config.value(section)
        if not isinstance(given, Mapping):
            return
        found = [key for key in (one, other) if given.get(key.rpartition(".")[2]) is not None]
        if len(found) > 1:
            yield Problem(tuple(one.split(".")), f"found with {other}; allowed: one of the two")
        if needed and not found:
            yield Problem(
                tuple(one.split(".")),
                f"missing; allowed: list of numbers in (0, 1), or {other} in its place",
            )

    return check


def _movies_of_trains(config: Readable) -> Iterator[Problem]:
    keys = "trains.volume_fraction", "trains.feed_volume_fraction"
    given = [key for key in keys if _given(config, key)]
    for key in given[:1]:
        yield from _member("movies.volume_fraction", of=key)(config)


def _given(config: Readable, key: str) -> bool:
    with contextlib.suppress(Unreadable):
        return config.value(key) is not None
    return False


def _volume_fractions(config: Readable) -> Iterator[tuple[tuple, float, float]]:
    """Location and value of all that are simulated, and U_p/Ubar at most: 1 for the channel's."""
    sections = ("trains",) if _switched_off(config, "design_map") else ("trains", "design_map")
    for section in sections:
        for key, ratio in (("volume_fraction", 1.0), ("feed_volume_fraction", FASTEST)):
            with contextlib.suppress(Unreadable):
                for location, fraction in config.indexed(f"{section}.{key}"):
                    yield location, fraction, ratio


def _spheres_without_contact(config: Readable) -> Iterator[Problem]:
    _, D, section = section_of(config)
    beta = config.value("particle.diameter") / D
    if beta >= 1:
        return
    for location, phi, ratio in _volume_fractions(config):
        spacing = ratio * section.mean_spacing(beta, phi)
        if spacing <= 1:
            limit = ratio * section.mean_spacing(beta, 1)
            yield conflict(
                location,
                phi,
                f"less than {limit:.4g} for d/D = {beta:.4g}; the mean spacing would be "
                f"{spacing:.3g} d, below contact",
            )


def _channel_holds_train(config: Readable) -> Iterator[Problem]:
    length, (_, D, section) = config.value("channel.length"), section_of(config)
    beta = config.value("particle.diameter") / D
    fractions = [phi for _, phi, _ in _volume_fractions(config)]  # of the feed: phi is less
    if beta >= 1 or not fractions:
        return
    phi = min(fractions)
    shortest = FEWEST_TRAIN_SPHERES * section.mean_spacing(beta, phi) * beta
    if length < shortest:
        allowed = f"at least {shortest:.4g}, three mean spacings at volume fraction {shown(phi)}"
        yield conflict(("channel", "length"), length, allowed)


def _stations_in_channel(config: Readable) -> Iterator[Problem]:
    length = config.value("channel.length")
    for location, station in config.indexed("trains.stations"):
        if station > length:
            yield conflict(location, station, f"at most channel.length, {shown(length)}")


def _view_in_channel(config: Readable) -> Iterator[Problem]:
    length, key = config.value("channel.length"), "movies.field_of_view"
    for location, view in config.indexed(key):
        if view > length:
            yield conflict(location, view, f"at most channel.length, {shown(length)}")


_CHECKS: tuple[Check, ...] = (
    _fluid_is_written_or_fitted,
    _unrepeated("fluid.data"),
    _of_fitted_modes("fluid.fit.relaxation_times"),
    _of_fitted_modes("fluid.fit.mobilities"),
    _descending("fluid.fit.relaxation_times"),
    _deborah_needs_modes,
    sides_suit_the_shape,
    sphere_fits_channel,
    _channel_holds_train,
    _ascending("deborah.values"),
    _table_is_computed_or_given,
    _ascending("table.sp", ratio=CLOSEST_NODES),
    _ascending("table.sf", ratio=CLOSEST_NODES),
    _ascending("table.pair", ratio=CLOSEST_NODES),
    _lines_are_checked,
    _closed("table.sp"),
    _closed("table.sf"),
    _member("trains.deborah", of="deborah.values"),
    _unrepeated("trains.deborah"),
    _one_way_to_say_how_much("trains", needed=True),
    _unrepeated("trains.volume_fraction"),
    _unrepeated("trains.feed_volume_fraction"),
    _spheres_without_contact,
    _ascending("trains.stations"),
    _stations_in_channel,
    _member("figures.field.sp", of="table.sp"),
    _member("figures.field.sf", of="table.sf"),
    _member("figures.field.deborah", of="deborah.values"),
    _ascending("figures.field.deborah"),
    _member("movies.deborah", of="trains.deborah", default="deborah.values"),
    _unrepeated("movies.deborah"),
    _if_made("movies", _movies_of_trains),
    _unrepeated("movies.volume_fraction"),
    _if_made("movies", _view_in_channel),
    _member("design_map.deborah", of="deborah.values"),
    _ascending("design_map.deborah"),
    _one_way_to_say_how_much("design_map", needed=False),
    _ascending("design_map.volume_fraction"),
    _ascending("design_map.feed_volume_fraction"),
    _ascending("design.spacing"),
    _unrepeated("verification.closure.deborah"),
    _ascending("verification.closure.gaps"),
)
_CHECKS_OF_VERIFICATION: tuple[Check, ...] = (
    _member("verification.closure.deborah", of="deborah.values"),
    _start_up_needs_modes,
)
