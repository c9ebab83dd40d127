"""How keys of the config are declared: meaning, symbol, unit and range, each in one place.

Sections are frozen and refuse unknown keys. `config/README.md` and `config/schema.json` are
generated from what is declared.
"""

from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic.config import JsonDict


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


DeborahNumber = Annotated[float, Field(ge=0)]
Distance = Annotated[
    float,
    Field(gt=1, allow_inf_nan=True, json_schema_extra={"allowed": "number > 1 or .inf"}),
]
FiniteDistance = Annotated[float, Field(gt=1)]
Gap = Annotated[float, Field(gt=0)]
VolumeFraction = Annotated[float, Field(gt=0, lt=1)]
Station = Annotated[float, Field(ge=0)]
KnownTime = Annotated[float, Field(gt=0, json_schema_extra={"allowed": "number > 0 or null"})]
KnownMobility = Annotated[
    float, Field(ge=0, lt=1, json_schema_extra={"allowed": "number in [0, 1) or null"})
]

Item = TypeVar("Item")
ListOf = Annotated[  # immutable, but written as a list
    tuple[Item, ...], BeforeValidator(lambda value: tuple(value) if type(value) is list else value)
]
