"""Whether files belong together: parts of one table, and a finished table and a study.

Parts of one table have the same settings and the same code; a finished table may be of another
program, but of the same fluid, confinement and Deborah numbers.

Geometries are simulated at different Deborah numbers, so these may differ; but what a Deborah
number of the study means, lambda_1 Ubar/D, must be the same in all parts.
"""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import xarray as xr
import yaml

from viscotrain.config.settings import CaseSettings, FlowSettings
from viscotrain.errors import TableError

OWN = {"deborah", "longest_modes"}  # settings that every part has for itself
DE = "De"  # how facts begin that are about one Deborah number
MOST_FILES = 5  # that a message names


def refuse_strangers(parts: Mapping[str, xr.Dataset], but: Collection = ()) -> dict[str, str]:
    """Check that all parts agree in fluid, confinement, settings and code.

    Args:
        parts: Datasets by the names of their files.
        but: Settings in which they may differ.

    Returns:
        What they share, as attributes of the table.

    Raises:
        TableError: Some differ from the others; it names them, and what differs.
    """
    facts = {
        name: {key: value for key, value in _facts(part.attrs) if key not in but}
        for name, part in parts.items()
    }
    shared = _most_common(facts.values())
    lines = []
    for name, own in facts.items():
        differing = [key for key in own if key in shared and own[key] != shared[key]]
        differing += sorted({key for key in own.keys() ^ shared.keys() if not key.startswith(DE)})
        if differing:
            words = (f"{key} {own.get(key)}, not {shared.get(key)}" for key in differing)
            lines.append(f"{name}: {'; '.join(words)}")
    if lines:
        shown = lines[:MOST_FILES] + (
            [f"and {len(lines) - MOST_FILES} more"] * (len(lines) > MOST_FILES)
        )
        raise TableError(
            "files of different studies or programs in one table; allowed: one of them. Make these "
            "again:\n  " + "\n  ".join(shown)
        )
    named = {key: value for key, value in shared.items() if not key.startswith(DE)}
    code = named.pop("code_digest", "")
    return {
        "simulations_digest": code,
        "simulations_settings": "".join(f"{key}: {value}\n" for key, value in named.items()),
    }


def refuse_other_spheres(table: xr.Dataset, parts: Mapping[str, xr.Dataset]) -> dict[str, str]:
    """Check that single spheres are of a table's fluid and Deborah numbers, of any diameter.

    Args:
        table: With its attributes.
        parts: Datasets of the spheres by the names of their files.

    Returns:
        Their code, as an attribute of the table.

    Raises:
        TableError: They are not, or they differ from each other.
    """
    shared = refuse_strangers(parts, but=("confinement",))
    own = yaml.safe_load(table.attrs["simulations_settings"])
    for name, part in parts.items():
        settings = yaml.safe_load(part.attrs["settings"]) | {"confinement": own["confinement"]}
        refuse_other_case(name, table, FlowSettings.model_validate(settings))
    return {"single_spheres_digest": shared["simulations_digest"]}


def refuse_other_case(name: str, table: xr.Dataset, case: CaseSettings) -> None:
    """Check that a finished table is of this fluid and confinement and has the Deborah numbers.

    Args:
        name: Of its file.
        table: As the table stage writes it.
        case: What it must be of.

    Raises:
        TableError: It is not; one message names all that differs.
    """
    if lines := other_case(table, case):
        raise TableError(f"{name}: not of this study\n  " + "\n  ".join(lines))


def other_case(table: xr.Dataset, case: CaseSettings) -> list[str]:
    """In what a finished table is of another case, a line each; a fluid to be fitted is left out.

    Args:
        table: As the table stage writes it.
        case: What it must be of.
    """
    own = yaml.safe_load(table.attrs.get("simulations_settings", "")) or {}
    if "deborah_longest_mode" not in table.coords or not own:
        return ["found no velocity table of this program; allowed: velocity_table.nc"]
    asked = yaml.safe_load(case.stated().text())
    named = [key for key in ("confinement", "dimensionless_fluid") if asked[key] is not None]
    lines = [
        f"{key}: found {own.get(key)}; allowed: {value}, as in the config"
        for key, value in _flat({key: asked[key] for key in named}, "")
        if str(own.get(key)) != value
    ]
    there = dict(zip(table["deborah"].values, table["deborah_longest_mode"].values, strict=True))
    for De in case.deborah:
        if De not in there:
            values = ", ".join(f"{each:g}" for each in there)
            lines.append(
                f"deborah: found {De:g} in the config; allowed: one of the table's {values}"
            )
        elif case.longest_modes and f"{there[De]:.9g}" != f"{case.deborah_longest_mode(De):.9g}":
            lines.append(
                f"De = {De:g}: found lambda_1 Ubar/D = {there[De]:g}; allowed: "
                f"{case.deborah_longest_mode(De):g}, as the config defines it"
            )
    return lines


def _most_common(facts) -> dict[str, str]:
    """Of every fact, what most files say."""
    counts: dict[str, Counter] = {}
    for own in facts:
        for key, value in own.items():
            counts.setdefault(key, Counter())[value] += 1
    return {key: count.most_common(1)[0][0] for key, count in counts.items()}


def _facts(attributes: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What a file says about itself: dotted settings, De by De, and the code."""
    settings = yaml.safe_load(attributes.get("settings", "")) or {}
    yield from _flat({key: value for key, value in settings.items() if key not in OWN}, "")
    for De, longest in zip(*(settings.get(key) or [] for key in sorted(OWN)), strict=True):
        yield f"{DE} {De:g} with lambda_1 Ubar/D =", f"{longest:g}"
    yield "code_digest", str(attributes.get("code_digest", ""))


def _flat(value: Any, key: str) -> Iterator[tuple[str, str]]:
    if isinstance(value, dict):
        for name, inside in value.items():
            yield from _flat(inside, f"{key}.{name}" if key else name)
    else:
        yield key, str(value)
