"""How keys of the config are declared: meaning, symbol, unit and range, each in one place.

Sections are frozen and refuse unknown keys. `config/README.md` and `config/schema.json` are
generated from what is declared.
"""

import math
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field
from pydantic.config import JsonDict
from pydantic_core import PydanticCustomError

LARGEST_DEBORAH = 1000
SHORTEST_TIME, LONGEST_TIME = 1e-9, 10**7  # s, of relaxation
CLOSEST = 1.001  # d: closer than that is a matter of lubrication, and no mesh resolves the gap
FARTHEST = 100  # d: farther spheres do not feel each other, and no mesh holds them
LONGEST_LIST = 1000  # items
TOO_MANY = "too_many_items"  # type of the error


def key(
    meaning: str,
    *,
    symbol: str | None = None,
    unit: str | None = None,
    allowed: str | None = None,
    rule: str | None = None,
    default: Any = ...,
    **limits: Any,
) -> Any:
    """Declare a key; `allowed` replaces its range in words, `rule` adds to it."""
    words = {"symbol": symbol, "unit": unit, "allowed": allowed, "rule": rule}
    extra: JsonDict = {name: text for name, text in words.items() if text is not None}
    return Field(default, description=meaning, json_schema_extra=extra, **limits)


class Section(BaseModel):
    """A part of the config: immutable, no unknown keys, no conversion of wrong types."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


def _in_reach(distance: float) -> float:
    """A distance that is infinite or can be meshed."""
    if FARTHEST < distance < math.inf:
        raise PydanticCustomError("out_of_reach", "farther than {farthest}", {"farthest": FARTHEST})
    return distance


def _as_tuple(value: Any) -> Any:
    """A list as a tuple, unless it is longer than anything that a study needs.

    Its length is looked at before its items: each of these could be a problem of its own.
    """
    if type(value) is not list:
        return value
    if len(value) > LONGEST_LIST:
        raise PydanticCustomError(TOO_MANY, "at most {most}", {"most": LONGEST_LIST})
    return tuple(value)


DeborahNumber = Annotated[float, Field(ge=0, le=LARGEST_DEBORAH)]
Distance = Annotated[
    float,
    Field(
        ge=CLOSEST,
        allow_inf_nan=True,
        json_schema_extra={"allowed": f"number in [{CLOSEST}, {FARTHEST}] or .inf"},
    ),
    AfterValidator(_in_reach),
]
FiniteDistance = Annotated[float, Field(ge=CLOSEST, le=FARTHEST)]
Gap = Annotated[float, Field(ge=0.001, le=FARTHEST)]
VolumeFraction = Annotated[float, Field(gt=0, lt=1)]
Station = Annotated[float, Field(ge=0)]
KnownTime = Annotated[
    float,
    Field(
        ge=SHORTEST_TIME,
        le=LONGEST_TIME,
        json_schema_extra={"allowed": f"number in [{SHORTEST_TIME}, {LONGEST_TIME}] or null"},
    ),
]
KnownMobility = Annotated[
    float, Field(ge=0, lt=1, json_schema_extra={"allowed": "number in [0, 1) or null"})
]

# Of a file: Snakemake takes braces for wildcards, and control characters are no one's intention.
PathText = Annotated[str, Field(min_length=1, max_length=1000, pattern=r"^[^\x00-\x1f\x7f{}]+$")]

Item = TypeVar("Item")
ListOf = Annotated[tuple[Item, ...], BeforeValidator(_as_tuple)]  # immutable, written as a list
