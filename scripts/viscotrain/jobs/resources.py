"""Run time and memory that jobs ask a cluster for, by stage and Deborah number, as measured.

CPU seconds of flows are those of `measured_costs.csv`: of the slowest geometry there, all Deborah
numbers on the way included. What does not solve was measured in the demo, trains for longer ones
too. Other fluids, orders and machines cost more, hence `MARGIN`; a job that ends for lack of either
is tried again with twice as much, where Snakemake is told to (`--retries`). This module imports
neither numpy nor pandas: the workflow reads it for every job.
"""

import csv
import math
from functools import cache
from pathlib import Path

from viscotrain.config import stages
from viscotrain.config.outputs import DesignConfig, DesignMapConfig, TrainsConfig
from viscotrain.config.study import Study
from viscotrain.words import FASTEST, repeated

MEASURED = Path(__file__).with_name("measured_costs.csv")
MARGIN = 20.0
MARGIN_OF_MANY = 4.0  # of each further geometry of a job: not all of them are the slowest
MEAN = 0.65  # what a geometry costs over what the slowest one does
SHORTEST, SMALLEST = 5, 500  # minutes and MB: what is loaded differs between machines
# How much more than a geometry at held distances: start-ups of all its De, a short train of six
# spheres for 100 D/Ubar, all settings of a study of convergence.
TIMES = {"dns": 1.0, "transient": 9.5, "closure_train": 38.0, "convergence": 30.0}
# Resident memory of a process that solves, two modes: 460 MB with 14,000 unknowns, 570 with 25,000,
# 2130 with 90,000; half as much again is asked for.
BASE_MB, PER_UNKNOWN_KB, MORE = 150, 24, 1.5
# CPU seconds and resident MB of jobs that do not solve, with all that they start.
OTHERS = {
    "units": (0.6, 140),
    "channel_flow": (10.0, 250),
    "operating_conditions": (1.0, 200),
    "table": (1.3, 160),
    "trains": (9.0, 300),
    "film": (1.7, 260),
    "movies": (9.0, 420),
    "design_map": (4.0, 340),
    "order": (2.8, 320),
    "confinement": (4.0, 320),
    "encapsulation": (4.0, 320),
    "measured": (2.0, 200),
    "design": (4.0, 320),
    "verification_report": (9.4, 360),
    "figures": (6.4, 310),
    "interactive": (1.3, 210),
    "summary": (0.9, 220),
    "fluid_fit": (4.0, 220),
    "fit_spread": (2.0, 230),
}
START_UP = 1.0  # CPU seconds of a job that imports everything
FRAME = 0.007  # CPU seconds of a movie's frame, encoding included
# CPU seconds of a train per injected sphere, with N spheres in the channel: a + b N, measured for
# N from 300 to 3400, the densest of which took four fifths of this.
TRAIN = {"a": 7.0e-5, "b": 2.5e-7}
# Of diameters, in the stage `diameter_variation`, which imports numpy.
VARIATIONS = (0.0, 0.005, 0.01, 0.02, 0.05)
DRAW = 0.01  # CPU seconds of a fluid that `fit_spread` draws, at one Deborah number


@cache
def _slowest() -> dict[float, tuple[float, int]]:
    """CPU seconds up to a Deborah number, and unknowns there, of the slowest geometry."""
    found: dict[float, tuple[float, int]] = {}
    with MEASURED.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if not row["deborah_before"]:
                seconds, unknowns = 0.0, 0
            seconds += float(row["cpu_seconds"])
            unknowns = max(unknowns, int(row["unknowns"]))
            De = float(row["deborah"])
            before = found.get(De, (0.0, 0))
            found[De] = max(seconds, before[0]), max(unknowns, before[1])
    return found


def slowest(deborah: float) -> float:
    """CPU seconds of the slowest geometry that was measured, up to a Deborah number."""
    return _at(deborah)[0]


def measured_deborahs(deborah: float) -> int:
    """How many were measured on the way to a Deborah number, itself included."""
    below = sum(De <= deborah for De in _slowest())
    return max(1, below)


def _at(deborah: float) -> tuple[float, int]:
    """Of the next measured Deborah number, or the largest."""
    measured = _slowest()
    return measured[min((De for De in measured if De >= deborah), default=max(measured))]


def minutes(stage: str, deborah: float, attempt: int = 1, geometries: int = 1) -> int:
    """Run time to ask for, of a stage of `TIMES`.

    Args:
        stage: What is solved.
        deborah: The largest one that is solved.
        attempt: How many times it was tried, this time included.
        geometries: How many are solved one after the other; one of them may take very long.
    """
    times = 1 + (geometries - 1) * MARGIN_OF_MANY / MARGIN
    return minutes_for(times * TIMES[stage] * _at(deborah)[0], attempt)


def flow_seconds(deborah: float) -> float:
    """CPU seconds of a geometry through all Deborah numbers up to this, about the mean."""
    return MEAN * _at(deborah)[0]


def minutes_for(seconds: float, attempt: int = 1) -> int:
    """Run time to ask for, of a job that took so many CPU seconds where it was measured."""
    return math.ceil(max(SHORTEST, MARGIN * seconds / 60)) * 2 ** (attempt - 1)


def megabytes(deborah: float, attempt: int = 1) -> int:
    """Memory to ask for where a flow is solved."""
    return megabytes_for(BASE_MB + PER_UNKNOWN_KB * _at(deborah)[1] / 1e3, attempt)


def megabytes_for(resident: float, attempt: int = 1) -> int:
    """Memory to ask for, of a job that had so much where it was measured."""
    return round(max(SMALLEST, MORE * resident)) * 2 ** (attempt - 1)


def train_seconds(
    study: Study,
    volume_fraction: float,
    runs: TrainsConfig | DesignMapConfig | DesignConfig,
    feed: bool = False,
) -> float:
    """CPU seconds of all repeats of one train of a section of the config, and of its model error.

    Of a volume fraction in the feed as if spheres were as fast as they can be.
    """
    spacing = study.mean_spacing(volume_fraction / (FASTEST if feed else 1.0))
    inside = study.channel.length / (spacing * study.confinement)
    injected, again = inside + runs.passages, 2 * repeated(runs.repeats)
    return (runs.repeats + again) * injected * (TRAIN["a"] + TRAIN["b"] * inside)


def variation_seconds(study: Study) -> float:
    """CPU seconds of the trains of the stage `diameter_variation`, all conditions together.

    Each of them once, by the injection of the study and evenly, at each variation of the diameters.
    """
    own = stages.diameter_variation(study)
    ways = len({own.trains.injection, "even"}) * len({*VARIATIONS, own.trains.diameter_variation})
    once = {"repeats": own.trains.repeats, "passages": own.trains.passages}
    runs = study.trains.model_copy(update=once)
    counted = 1 + 2 * repeated(1)  # trains, in `train_seconds`
    each = [train_seconds(study, phi, runs, own.trains.feed) / counted for phi in own.fractions]
    return ways * len(own.deborah) * sum(each)
