"""What is wrong with a config: problems between its keys, and all problems in words.

Two kinds of problems end in the same form, `key: found ...; allowed: ...`:

- a key that the models in `config` refuse. `problem_of_key` rewords the validation error with the
  range that the JSON schema of the models gives for that key, so ranges are stated once.
- keys that do not agree. The functions in `_CHECKS` find these, each from the few keys it names. A
  check whose keys are missing or wrong themselves is left out; all the others still report.
"""

import contextlib
import difflib
import itertools
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import yaml

from viscotrain.fluid.parameters import mean_spacing
from viscotrain.words import FEWEST_TRAIN_SPHERES

INFINITY = math.inf  # the distance to a neighbour that does not exist
LONGEST_FOUND = 60  # characters of a wrong value that a message repeats


class Problem(NamedTuple):
    """What is wrong with one key."""

    location: tuple
    text: str

    def __str__(self) -> str:
        return f"{dotted(self.location)}: {self.text}" if self.location else self.text


class _Unreadable(Exception):
    """A check needs a key that is missing or wrong itself."""


class Readable:
    """The part of a config that can be checked although other parts are wrong."""

    def __init__(self, data: Any, wrong: Collection[tuple] = ()):
        self._data = data
        self._wrong = wrong

    def value(self, key: str) -> Any:
        """The value of a dotted key, or `_Unreadable`."""
        path = tuple(key.split("."))
        value = self._data
        for depth in range(len(path) + 1):
            if path[:depth] in self._wrong:
                raise _Unreadable(key)
            if depth:
                try:
                    value = value[path[depth - 1]]
                except (KeyError, TypeError) as error:
                    raise _Unreadable(key) from error
        return value

    def items(self, key: str) -> list:
        """The items of a list, None in the place of a wrong one."""
        path = tuple(key.split("."))
        items = enumerate(self.value(key))
        return [None if (*path, index) in self._wrong else item for index, item in items]

    def indexed(self, key: str) -> list[tuple[tuple, Any]]:
        """Location and value of the items of a list that are right, or of a single value.

        None of a key that is left to the default, null.
        """
        path = tuple(key.split("."))
        if self.value(key) is None:
            return []
        if not isinstance(self.value(key), Sequence):
            return [(path, self.value(key))]
        return [((*path, i), item) for i, item in enumerate(self.items(key)) if item is not None]


def disagreements(config: Readable) -> list[Problem]:
    """Problems between keys, as far as the keys themselves can be read."""
    problems: list[Problem] = []
    for check in _CHECKS:
        with contextlib.suppress(_Unreadable):
            problems.extend(check(config))
    return problems


def _conflict(location: tuple, found: Any, allowed: str) -> Problem:
    return Problem(location, f"found {_show(found)}; allowed: {allowed}")


def _ascending(key: str):
    def check(config: Readable) -> Iterator[Problem]:
        for (_, before), (location, value) in itertools.pairwise(config.indexed(key)):
            if not value > before:
                allowed = f"more than the value before it, {_show(before)}"
                yield _conflict(location, value, allowed)

    return check


def _unrepeated(key: str):
    def check(config: Readable) -> Iterator[Problem]:
        seen = set()
        for location, value in config.indexed(key):
            if value in seen:
                yield Problem(location, f"found {_show(value)} again; allowed: every value once")
            seen.add(value)

    return check


def _closed(key: str):
    def check(config: Readable) -> Iterator[Problem]:
        items = config.items(key)
        if items[-1] not in (None, INFINITY):
            allowed = ".inf (no neighbour), so that the table needs no extrapolation"
            yield _conflict(
                (*key.split("."), len(items) - 1), items[-1], f"as the last one {allowed}"
            )

    return check


def _member(key: str, of: str):
    def check(config: Readable) -> Iterator[Problem]:
        values = config.items(of)
        if None in values:
            return
        for location, value in config.indexed(key):
            if value not in values:
                allowed = f"one of {of} ({', '.join(map(_show, values))})"
                yield _conflict(location, value, allowed)

    return check


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


def _deborah_needs_modes(config: Readable) -> Iterator[Problem]:
    modes = config.value("fluid.modes")
    if modes is None or len(modes) > 0:
        return
    for location, De in config.indexed("deborah.values"):
        if De > 0:
            yield _conflict(location, De, "0, because fluid.modes is empty: no relaxation time")


def _start_up_needs_modes(config: Readable) -> Iterator[Problem]:
    points = config.items("verification.transient")
    modes = config.value("fluid.modes")
    if points and modes is not None and len(modes) == 0:
        location = ("verification", "transient")
        yield _conflict(location, len(points), "none, because fluid.modes is empty: no start-up")


def _sphere_fits_tube(config: Readable) -> Iterator[Problem]:
    d, D = config.value("particle.diameter"), config.value("channel.diameter")
    if d >= D:
        yield _conflict(("particle", "diameter"), d, f"less than channel.diameter, {_show(D)}")


def _volume_fractions(config: Readable) -> Iterator[tuple[tuple, float]]:
    """Location and value of all that are simulated."""
    for key in ("trains.volume_fraction", "design_map.volume_fraction"):
        with contextlib.suppress(_Unreadable):
            yield from config.indexed(key)


def _spheres_without_contact(config: Readable) -> Iterator[Problem]:
    beta = config.value("particle.diameter") / config.value("channel.diameter")
    if beta >= 1:
        return
    for location, phi in _volume_fractions(config):
        spacing = mean_spacing(beta, phi)
        if spacing <= 1:
            limit = mean_spacing(beta, 1)
            yield _conflict(
                location,
                phi,
                f"less than {limit:.4g} for d/D = {beta:.4g}; the mean spacing would be "
                f"{spacing:.3g} d, below contact",
            )


def _channel_holds_train(config: Readable) -> Iterator[Problem]:
    length = config.value("channel.length")
    beta = config.value("particle.diameter") / config.value("channel.diameter")
    fractions = [phi for _, phi in _volume_fractions(config)]
    if beta >= 1 or not fractions:
        return
    phi = min(fractions)
    shortest = FEWEST_TRAIN_SPHERES * mean_spacing(beta, phi) * beta
    if length < shortest:
        allowed = f"at least {shortest:.4g}, three mean spacings at volume fraction {_show(phi)}"
        yield _conflict(("channel", "length"), length, allowed)


def _stations_in_channel(config: Readable) -> Iterator[Problem]:
    length = config.value("channel.length")
    for location, station in config.indexed("trains.stations"):
        if station > length:
            yield _conflict(location, station, f"at most channel.length, {_show(length)}")


def _view_in_channel(config: Readable) -> Iterator[Problem]:
    length, key = config.value("channel.length"), "movies.field_of_view"
    for location, view in config.indexed(key):
        if view > length:
            yield _conflict(location, view, f"at most channel.length, {_show(length)}")


_CHECKS: tuple[Callable[[Readable], Iterator[Problem]], ...] = (
    _fluid_is_written_or_fitted,
    _unrepeated("fluid.data"),
    _deborah_needs_modes,
    _sphere_fits_tube,
    _channel_holds_train,
    _ascending("deborah.values"),
    _ascending("table.sp"),
    _ascending("table.sf"),
    _closed("table.sp"),
    _closed("table.sf"),
    _member("trains.deborah", of="deborah.values"),
    _unrepeated("trains.deborah"),
    _unrepeated("trains.volume_fraction"),
    _spheres_without_contact,
    _ascending("trains.stations"),
    _stations_in_channel,
    _member("figures.field.sp", of="table.sp"),
    _member("figures.field.sf", of="table.sf"),
    _member("figures.field.deborah", of="deborah.values"),
    _member("movies.deborah", of="trains.deborah"),
    _unrepeated("movies.deborah"),
    _member("movies.volume_fraction", of="trains.volume_fraction"),
    _unrepeated("movies.volume_fraction"),
    _view_in_channel,
    _member("design_map.deborah", of="deborah.values"),
    _ascending("design_map.deborah"),
    _ascending("design_map.volume_fraction"),
    _member("verification.closure.deborah", of="deborah.values"),
    _unrepeated("verification.closure.deborah"),
    _ascending("verification.closure.gaps"),
    _start_up_needs_modes,
)


def inlined(schema: Mapping[str, Any]) -> dict[str, Any]:
    """A JSON schema with its references, and its alternatives to null, filled in."""
    definitions = schema.get("$defs", {})

    def fill(part: Any) -> Any:
        if isinstance(part, list):
            return [fill(item) for item in part]
        if not isinstance(part, Mapping):
            return part
        part = {name: inside for name, inside in part.items() if name != "$defs"}
        for option in part.pop("anyOf", []):
            if option.get("type") != "null":
                part = {**option, **part}
        if "$ref" in part:
            target = definitions[part.pop("$ref").rpartition("/")[2]]
            part = {**target, **part}
        return {name: fill(inside) for name, inside in part.items()}

    return fill(schema)


def range_in_words(fragment: Mapping[str, Any]) -> str:
    """What a piece of the schema allows: `number in [0, 1)`, `list of numbers > 0`, ..."""
    words = fragment.get("allowed") or _WORDS[fragment["type"]](fragment)
    return f"{words}, {fragment['rule']}" if "rule" in fragment else words


def _number_in_words(fragment: Mapping[str, Any]) -> str:
    noun = "whole number" if fragment["type"] == "integer" else "number"
    low = fragment.get("minimum", fragment.get("exclusiveMinimum"))
    high = fragment.get("maximum", fragment.get("exclusiveMaximum"))
    if low is None:
        return noun
    if high is None:
        return f"{noun} {'>=' if 'minimum' in fragment else '>'} {_show(low)}"
    left = "[" if "minimum" in fragment else "("
    right = "]" if "maximum" in fragment else ")"
    return f"{noun} in {left}{_show(low)}, {_show(high)}{right}"


def _list_in_words(fragment: Mapping[str, Any]) -> str:
    items = range_in_words(fragment["items"])
    for noun in ("number", "section"):
        items = items.replace(noun, f"{noun}s", 1)
    least = fragment.get("minItems", 0)
    return f"list of {items}" + (f", at least {least}" if least else "")


def _section_in_words(fragment: Mapping[str, Any]) -> str:
    return f"section with the keys {', '.join(fragment['properties'])}"


def _text_in_words(fragment: Mapping[str, Any]) -> str:
    return f"one of {', '.join(fragment['enum'])}" if "enum" in fragment else "text"


_WORDS = {
    "number": _number_in_words,
    "integer": _number_in_words,
    "array": _list_in_words,
    "object": _section_in_words,
    "string": _text_in_words,
    "boolean": lambda fragment: "true or false",
}


def problem_of_key(error: Mapping[str, Any], schema: Mapping[str, Any]) -> Problem:
    """A validation error of pydantic in our words; `schema` has its references inlined."""
    location = error["loc"]
    if error["type"] in ("extra_forbidden", "invalid_key"):
        return Problem(location, f"unknown key; {_right_key(location, schema)}")
    fragment = _fragment(schema, location)
    allowed = range_in_words(fragment)
    if error["type"] == "missing":
        return Problem(location, f"missing; allowed: {allowed}")
    if error["type"] == "finite_number":
        allowed = f"finite {allowed}"
    found = _show(error["input"])
    if isinstance(error["input"], str) and fragment["type"] in ("number", "integer"):
        found += _as_number(error["input"])
    return Problem(location, f"found {found}; allowed: {allowed}")


def order_of_sections(schema: Mapping[str, Any]) -> Callable[[Problem], int]:
    """Sorting key that puts problems in the order of the config's sections, unknown ones last."""
    sections = list(schema["properties"])

    def position(problem: Problem) -> int:
        first = problem.location[0] if problem.location else None
        return sections.index(first) if first in sections else len(sections)

    return position


def _fragment(schema: Mapping[str, Any], location: tuple) -> Mapping[str, Any]:
    """The piece of an inlined schema that describes a location."""
    for part in location:
        schema = schema["items"] if isinstance(part, int) else schema["properties"][part]
    return schema


def _right_key(location: tuple, schema: Mapping[str, Any]) -> str:
    """The key that an unknown one was meant to be, else the keys there are."""
    *section, name = location
    keys = list(_fragment(schema, tuple(section))["properties"])
    near = difflib.get_close_matches(str(name), keys, n=1)
    if near:
        return f"did you mean {dotted((*section, near[0]))}?"
    elsewhere = [
        f"{outer}.{name}"
        for outer, fragment in schema["properties"].items()
        if name in fragment.get("properties", {})
    ]
    if elsewhere:
        return f"did you mean {' or '.join(elsewhere)}?"
    return f"allowed: {', '.join(keys)}"


def dotted(location: tuple) -> str:
    """('fluid', 'modes', 0) as fluid.modes[0]."""
    parts = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return "".join(parts).removeprefix(".")


def _show(value: Any) -> str:
    """A value as a message repeats it: the way YAML spells it, not too long."""
    if value is None:
        return "nothing"
    shown = f"the text {value!r}" if isinstance(value, str) else _yaml_line(value)
    return shown if len(shown) <= LONGEST_FOUND else f"{shown[: LONGEST_FOUND - 3]}..."


def _as_number(text: str) -> str:
    """How to write a number that YAML took for text: 1e-6 needs a point, 1.0e-6."""
    try:
        number = float(text)
    except ValueError:
        return ""
    return f" (write {_yaml_line(number)})"


def _yaml_line(value: Any) -> str:
    try:
        text = yaml.safe_dump(value, default_flow_style=True, width=math.inf)
    except yaml.YAMLError:
        text = str(value)
    return text.removesuffix("\n").removesuffix("\n...")
