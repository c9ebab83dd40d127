"""A config with several particle diameters: it is one study for each of them, compared afterwards.

    particle: {diameter: [10.0e-6, 20.0e-6]}

makes the studies `<study>/beta0.1` and `<study>/beta0.2`, named by d/D, with results in folders of
these names. Each is a study like any other: its recorded config is that of one diameter.
"""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from viscotrain.config.device_models import ChannelConfig
from viscotrain.config.names import number_name
from viscotrain.config.reading import parse_study, read_yaml
from viscotrain.config.settings import DIGITS, StudyConfigSettings
from viscotrain.config.study import CLOSEST_MAP_SPACING, Study
from viscotrain.config.wording import shown
from viscotrain.errors import ConfigError

KEY = "particle.diameter"
MOST_DIAMETERS = 20


def parse_studies(
    data: Any, source: str = "config", known_problems: Sequence[str] = ()
) -> tuple[Study, ...]:
    """The studies of a config that has been read already, by ascending diameter; usually one.

    Arguments are those of `parse_study`.

    Raises:
        ConfigError: One message lists every problem of all of them, each once.
    """
    diameters = listed(data)
    if diameters is None:
        return (parse_study(data, source, known_problems),)
    if len(diameters) > MOST_DIAMETERS:
        allowed = f"at most {MOST_DIAMETERS}, each of which is a study"
        lines = [*known_problems, f"{KEY}: found a list of {len(diameters)}; allowed: {allowed}"]
        raise ConfigError(source, lines)
    studies, lines = [], [*known_problems, *_problems_of_list(diameters)]
    if data.get("table") and isinstance(data["table"], Mapping) and data["table"].get("file"):
        lines.append(f"table.file: found with several of {KEY}; allowed: a table is of one d/D")
    for n, diameter in enumerate(diameters):
        try:
            study = parse_study(_of_one(data, diameter))
            studies.append(study.model_copy(update={"study": f"{study.study}/{beta_name(study)}"}))
        except ConfigError as error:
            lines += [line.replace(f"{KEY}:", f"{KEY}[{n}]:", 1) for line in error.problems]
    if lines:
        raise ConfigError(source, list(dict.fromkeys(lines)))
    return tuple(studies)


def load_studies(path: str | Path) -> tuple[Study, ...]:
    """The studies of a YAML file.

    Raises:
        ConfigError: As `parse_studies` does, or the file cannot be read.
    """
    data, repeated = read_yaml(path)
    return parse_studies(data, source=str(path), known_problems=repeated)


def only(studies: Sequence[Study], source: str) -> Study:
    """The one study of a config, for what is made of one diameter.

    Raises:
        ConfigError: There are several.
    """
    if len(studies) > 1:
        config = f"results/{studies[0].study}/config.yaml"
        allowed = f"one here, as in {config}, which the workflow writes"
        raise ConfigError(source, [f"{KEY}: found {len(studies)}; allowed: {allowed}"])
    return studies[0]


def name_of(studies: Sequence[Study]) -> str:
    """What the config calls the study."""
    return studies[0].study if len(studies) == 1 else studies[0].study.rpartition("/")[0]


def _of_one(data: dict, diameter: Any) -> dict:
    """The config of one of the diameters, with those conditions of the design map that suit it."""
    own = data | {"particle": data["particle"] | {"diameter": diameter}}
    try:
        channel = ChannelConfig.model_validate(data["channel"])
        beta = diameter / channel.inscribed_diameter
        fractions = data["design_map"]["volume_fraction"]
        fitting = [
            phi
            for phi in fractions
            if channel.section.mean_spacing(beta, phi) >= CLOSEST_MAP_SPACING
        ]
    except (KeyError, TypeError, ArithmeticError, ValidationError):  # none are given, or wrong
        return own
    return own | {"design_map": data["design_map"] | {"volume_fraction": fitting or fractions}}


def listed(data: Any) -> list | None:
    """The diameters of a config that has a list of them, right or wrong; None for any other."""
    particle = data.get("particle") if isinstance(data, Mapping) else None
    diameter = particle.get("diameter") if isinstance(particle, Mapping) else None
    return diameter if isinstance(diameter, list) else None


def beta_name(study: Study) -> str:
    """Name of a study among those of its config: beta0.2."""
    return f"beta{number_name(float(f'{study.confinement:.{DIGITS}g}'))}"


def config_of(studies: Sequence[Study]) -> StudyConfigSettings:
    """The config of them all with every default."""
    config = studies[0].model_dump()
    if len(studies) > 1:
        config["study"] = name_of(studies)
        config["particle"]["diameter"] = [study.particle.diameter for study in studies]
    return StudyConfigSettings(config=config)


def _problems_of_list(diameters: Sequence) -> list[str]:
    if len(diameters) < 2:
        return [
            f"{KEY}: found {shown(diameters)}; "
            "allowed: number in [1.0e-08, 1], or at least 2 of them"
        ]
    numbers = [(n, d) for n, d in enumerate(diameters) if type(d) in (int, float)]
    return [
        f"{KEY}[{n}]: found {shown(d)}; allowed: more than the value before it, {shown(before)}"
        for (_, before), (n, d) in itertools.pairwise(numbers)
        if not d > before
    ]
