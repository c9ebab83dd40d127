"""Configs that went wrong: the shipped ones, with one to three of their keys changed at random.

A mutation is plain data (name of an operation, where, with what), so that one that was found can
be kept as an explicit example. Which keys there are follows from the shipped files and from the
schema: a new key is mutated without a change here.
"""

import copy
import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import yaml
from harness import CONFIG
from hypothesis import strategies as st

from viscotrain.config.reading import schema
from viscotrain.config.wording import inlined

SHIPPED = tuple(sorted(path.name for path in CONFIG.glob("*.yaml")))
Path = tuple[str | int, ...]

NUMBERS = (
    *(0, -1, 1, 2, 3, 1.0, 1.5, 0.004, 7, 0.1, 20, 1e-3, 100, 1000),
    *(math.nan, math.inf, -math.inf, -0.0, 5e-324, 1e-300, 1e300, 1.7976931348623157e308),
    *(1e5, 1e9, 10**9, 10**18, 2**63, 2**64, -(2**63), 10**400, 1 + 2**-52, 0.9999999999999999),
)
TEXTS = (
    *("", " ", "null", ".inf", "inf", "nan", "1e-6", "2e-5 m", "1,5", "0x10", "yes", "~"),
    *("../../etc", "/etc/passwd", "a;b", "$(touch x)", "`touch x`", "a b", "-rf", "--help", "."),
    *("{sp}", "{wildcards.sp}", "{{x}}", "{% raw %}", "%s", "*", "a\nb", "a\tb", "\x00", "\x1b[2J"),
    *("<script>alert(1)</script>", "</script>", '"><img src=x>', "é", "研究", "\u202e", "💧"),
    *("demo\n", "x" * 300, "x" * 100_000, "CON", "a/b", "a\\b", "http://example.org/t.nc"),
)
OTHERS = (None, True, False, [], {}, [[]], [None], {"a": 1}, {1: 2}, {None: 1}, [{}], [1, "a"])
LISTS = ("long", "longer", "steps", "texts", "nested")
ORDERS = ("reversed", "twice", "many", "rotated")
FACTORS = (-1, 0.0, 0.5, 1.1, 2, 10, 1e3, 1e6, 1e-3, 1e-6, 1e12)
TYPOS = ("doubled", "dropped", "upper", "spaced", "dashed", "foreign", "long", "control")


@cache
def words() -> dict[str, Any]:
    return inlined(schema())


@cache
def shipped(name: str) -> dict[str, Any]:
    return yaml.safe_load((CONFIG / name).read_text(encoding="utf-8"))


def places(data: Any, before: Path = ()) -> Iterator[Path]:
    """Everything in a config, sections and items of lists included."""
    pairs = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in pairs:
        yield (*before, key)
        if isinstance(value, dict | list):
            yield from places(value, (*before, key))


def declared(fragment: dict[str, Any], before: Path = ()) -> Iterator[Path]:
    """Keys of the schema, whether a config has them or not; the first item stands for a list."""
    for key, inside in fragment.get("properties", {}).items():
        yield (*before, key)
        yield from declared(inside, (*before, key))
        if "items" in inside:
            yield (*before, key, 0)
            yield from declared(inside["items"], (*before, key, 0))


@cache
def targets(name: str) -> tuple[Path, ...]:
    """All places of a config that may be changed."""
    return tuple(dict.fromkeys([*places(shipped(name)), *declared(words())]))


@cache
def present(name: str, kind: Any) -> list[Path]:
    """Places of a config that hold something of a type."""
    return [path for path in places(shipped(name)) if isinstance(found(name, path), kind)]


def found(name: str, path: Path) -> Any:
    """What a shipped config has at a place."""
    value: Any = shipped(name)
    for part in path:
        value = value[part]
    return value


def mutations(name: str) -> st.SearchStrategy[tuple]:
    """One change: (operation, path, argument)."""
    path, there = st.sampled_from(targets(name)), st.sampled_from(present(name, object))
    numbers, lists = st.sampled_from(present(name, int | float)), present(name, list)
    keys = st.sampled_from([place for place in present(name, object) if isinstance(place[-1], str)])
    value = st.sampled_from(NUMBERS) | st.sampled_from(TEXTS) | st.sampled_from(OTHERS)
    value |= st.integers() | st.floats() | st.text(max_size=8)
    return st.one_of(
        st.tuples(st.just("set"), path, value),
        st.tuples(st.just("set"), numbers, st.sampled_from(NUMBERS)),
        st.tuples(st.just("scale"), numbers | st.sampled_from(lists), st.sampled_from(FACTORS)),
        st.tuples(st.just("remove"), there, st.none()),
        st.tuples(st.just("misspell"), keys, st.sampled_from(TYPOS)),
        st.tuples(st.just("list"), path, st.sampled_from(LISTS)),
        st.tuples(st.just("copy"), path, there),
        st.tuples(
            st.just("shuffle"),
            st.sampled_from(lists),
            st.sampled_from(ORDERS),
        ),
    )


@st.composite
def mutated(draw) -> tuple[str, tuple]:
    """Name of a shipped config, and one to three changes of it."""
    name = draw(st.sampled_from(SHIPPED))
    return name, tuple(draw(st.lists(mutations(name), min_size=1, max_size=3)))


def applied(name: str, changes: tuple) -> dict[str, Any]:
    """The config after its changes; one whose place is gone changes nothing."""
    data = copy.deepcopy(shipped(name))
    for operation, path, argument in changes:
        try:
            _apply(data, operation, path, argument)
        except (KeyError, IndexError, TypeError, AttributeError, ValueError, OverflowError):
            continue
    return data


def as_yaml(data: Any) -> str:
    """A config as a file holds it."""
    return yaml.dump(data, Dumper=getattr(yaml, "CSafeDumper", yaml.SafeDumper), sort_keys=False)


def _apply(data: Any, operation: str, path: Path, argument: Any):
    *parents, last = path
    place = data
    for part in parents:
        if isinstance(place, dict) and place.get(part) is None:
            place[part] = {}
        place = place[part]
    if operation == "set":
        _set(place, last, copy.deepcopy(argument))
    elif operation == "scale":
        _set(place, last, _scaled(place[last], argument))
    elif operation == "remove":
        del place[last]
    elif operation == "misspell":
        place[_misspelt(last, argument)] = place.pop(last)
    elif operation == "list":
        _set(place, last, _list(argument))
    elif operation == "copy":
        value = data
        for part in argument:
            value = value[part]
        _set(place, last, copy.deepcopy(value))
    else:
        _set(place, last, _shuffled(place[last], argument))


def _set(place: Any, last: Any, value: Any):
    if isinstance(place, list) and last == len(place):
        place.append(value)
    else:
        place[last] = value


def _scaled(value: Any, factor: float) -> Any:
    """A number, or all numbers of a list, times a factor; whole ones stay whole where they can."""
    if isinstance(value, list):
        return [_scaled(item, factor) for item in value]
    product = value * factor
    return int(product) if isinstance(value, int) and product == int(product) else product


def _misspelt(key: str, how: str) -> str:
    return {
        "doubled": key[:1] + key,
        "dropped": key[1:],
        "upper": key.upper(),
        "spaced": f"{key} ",
        "dashed": key.replace("_", "-") + "-",
        "foreign": f"{key}é",
        "long": key * 1000,
        "control": f"\x1b[2J{key}\n",
    }[how]


def _list(kind: str) -> list:
    return {
        "long": [1.01 + n / 100 for n in range(900)],
        "longer": [1.01 + n / 100 for n in range(1100)],
        "steps": list(range(1000)),
        "texts": ["a"] * 1100,
        "nested": [[[[1.5] * 10] * 10] * 3],
    }[kind]


def _shuffled(value: Any, how: str) -> Any:
    if how == "reversed":
        return value[::-1]
    if how == "many":
        return [copy.deepcopy(item) for item in (value * 1100)[:1100]]
    return value + value if how == "twice" else value[1:] + value[:1]
