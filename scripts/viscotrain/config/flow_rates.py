"""The config of a study with another fluid at the same flow rates, to be run as a study of its own.

A pump sets Ubar. With another relaxation time this is another De = time Ubar/D, so every De of the
config, which are the keys with this symbol, is scaled by the ratio of the times.
"""

from collections.abc import Mapping
from typing import Any

from viscotrain.config.models import FluidConfig
from viscotrain.config.reading import schema
from viscotrain.config.wording import inlined

DIGITS = 6  # of a Deborah number, which names files


def at_same_flow_rates(
    config: Mapping[str, Any], name: str, fluid: FluidConfig, ratio: float
) -> dict[str, Any]:
    """The config with this name and fluid.

    Args:
        config: Of a study, as it dumps itself.
        name: Of the new study.
        fluid: Written, not to be fitted.
        ratio: Of the relaxation time that De is defined by, new over old.
    """
    scaled = _scaled(config, inlined(schema()), ratio)
    return scaled | {"study": name, "fluid": fluid.model_dump()}


def _scaled(value: Any, fragment: Mapping[str, Any], ratio: float) -> Any:
    """A part of the config, described by its part of the schema, with its De scaled."""
    if isinstance(value, Mapping):
        parts = fragment.get("properties", {})
        return {key: _scaled(item, parts.get(key, {}), ratio) for key, item in value.items()}
    if fragment.get("symbol") != "De":
        inside = fragment.get("items", {})
        many = isinstance(value, list | tuple)
        return [_scaled(item, inside, ratio) for item in value] if many else value
    if isinstance(value, list | tuple):
        return [_times(De, ratio) for De in value]
    return None if value is None else _times(value, ratio)


def _times(De: float, ratio: float) -> float:
    return float(f"{De * ratio:.{DIGITS}g}")
