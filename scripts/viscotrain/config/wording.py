"""Problems of a config in words: `key: found ...; allowed: ...`, ranges from the JSON schema."""

import difflib
import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import yaml

from viscotrain.config.keys import LONGEST_LIST, TOO_MANY

LONGEST_FOUND = 60  # characters of a wrong value that a message repeats


class Problem(NamedTuple):
    """What is wrong with one key."""

    location: tuple
    text: str

    def __str__(self) -> str:
        return f"{dotted(self.location)}: {self.text}" if self.location else self.text


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
        return f"{noun} {'>=' if 'minimum' in fragment else '>'} {shown(low)}"
    left = "[" if "minimum" in fragment else "("
    right = "]" if "maximum" in fragment else ")"
    return f"{noun} in {left}{shown(low)}, {shown(high)}{right}"


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
    if error["type"] in (TOO_MANY, "too_long"):
        most = LONGEST_LIST if error["type"] == TOO_MANY else error["ctx"]["max_length"]
        found = f"a list of {len(error['input'])}"
        return Problem(location, f"found {found}; allowed: at most {most} of the {allowed}")
    if error["type"] == "finite_number":
        allowed = f"finite {allowed}"
    found = shown(error["input"])
    if isinstance(error["input"], str) and {"number", "integer"} & _types(fragment):
        found += _as_number(error["input"])
    return Problem(location, f"found {found}; allowed: {allowed}")


def _types(fragment: Mapping[str, Any]) -> set[str]:
    kinds = fragment["type"]
    return {kinds} if isinstance(kinds, str) else set(kinds)


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
    parts = (f"[{part}]" if isinstance(part, int) else f".{_plain(part)}" for part in location)
    return "".join(parts).removeprefix(".")


def _plain(key: str) -> str:
    """A key as a message repeats it: not too long, no character that moves a cursor."""
    return _shortened(key if key.isprintable() else ascii(key)[1:-1])


def shown(value: Any) -> str:
    """A value as a message repeats it: the way YAML spells it, not too long."""
    if value is None:
        return "nothing"
    text = f"the text {value!r}" if isinstance(value, str) else _yaml_line(value)
    return _shortened(text)


def _shortened(text: str) -> str:
    """Text that is not too long for a message."""
    return text if len(text) <= LONGEST_FOUND else f"{text[: LONGEST_FOUND - 3]}..."


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
