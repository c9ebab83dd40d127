"""The answer of a design in words: whether trains form, the best conditions, limits, remedies."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import pandas as pd

from viscotrain.fluid.units import CENTIMETRES, MICROMETRES
from viscotrain.trains.design import BEST, LONGER, NO, PARTLY_YES, YES
from viscotrain.trains.tolerance import Wanted
from viscotrain.trains.variables import rate_in_words


class Device(NamedTuple):
    """What an answer is about.

    Attributes:
        particle: Mean diameter of the beads in um.
        channel: D in um, the smaller side of a duct.
        section: Of the channel, in words.
        wanted: Of the trains: closure, law of injection, length in D, CV that counts as ordered.
        variation: Of the beads' diameters.
        bead_rate: Beads that are wanted in a second; None: any.
        droplet_frequency: Droplets in a second; None: not asked for.
    """

    particle: float
    channel: float
    section: str
    wanted: Wanted
    variation: float
    bead_rate: float | None
    droplet_frequency: float | None

    @property
    def confinement(self) -> float:
        """d/D."""
        return self.particle / self.channel

    def centimetres(self, length: float) -> float:
        """Of a length in D."""
        return CENTIMETRES / MICROMETRES * self.channel * length


class Answer(NamedTuple):
    """Paragraphs and lists of lines.

    Attributes:
        question: The device in a sentence.
        verdict: In a sentence.
        best: The best conditions, a line each.
        limits: What limits the best one.
        remedies: What would help it, with numbers, the most helpful first.
        notes: What all numbers rest on.
    """

    question: str
    verdict: str
    best: list[str]
    limits: list[str]
    remedies: list[str]
    notes: list[str]

    def text(self) -> str:
        """All of it as plain text."""
        parts = [self.question, "", self.verdict]
        for title, lines in self.sections():
            parts += ["", title, *(f"  {line}" for line in lines)]
        return "\n".join(parts)

    def sections(self) -> list[tuple[str, list[str]]]:
        """Titles and lines, of those that are not empty."""
        named = {
            "The best conditions": self.best,
            "What limits the best one": self.limits,
            "What would help most": self.remedies,
            "What these numbers rest on": self.notes,
        }
        return [(title, lines) for title, lines in named.items() if lines]


def answer(
    found: pd.DataFrame,
    not_tried: Sequence[str],
    remedies: Mapping[str, float],
    device: Device,
    notes: Sequence[str] = (),
) -> Answer:
    """Put an answer into words.

    Args:
        found: Of `design.table`, with `design.with_linear_law`.
        not_tried: Conditions without trains, and why.
        remedies: Of `design.remedies`.
        device: What was asked.
        notes: Further ones, such as that of a duct.
    """
    best = found.iloc[0]
    return Answer(
        question=_question(device),
        verdict=_verdict(found, device),
        best=[_condition(row, device) for row in found.head(BEST).itertuples()],
        limits=_limits(best, device) + list(not_tried),
        remedies=_remedies(best, remedies, device),
        notes=[*_notes(device), *notes],
    )


def _question(device: Device) -> str:
    length, wanted = device.wanted.length, []
    beads = f"Beads of {device.particle:.3g} um"
    if device.variation:
        beads += f" (variation {100 * device.variation:.3g} %)"
    channel = f"a {device.section}, {device.channel:.3g} um wide, d/D = {device.confinement:.3g}"
    channel += f", {device.centimetres(length):.3g} cm long ({length:.5g} D)"
    if device.bead_rate:
        wanted.append(f"{device.bead_rate:g} beads/s")
    if device.droplet_frequency:
        wanted.append(f"one in each of {device.droplet_frequency:g} droplets/s")
    return f"{beads} in {channel}" + (f"; wanted: {', '.join(wanted)}." if wanted else ".")


VERDICTS = {
    YES: "Yes: trains form.",
    PARTLY_YES: "Partly: order grows along the channel, but spacings are not even at its end.",
    NO: "No: beads do not line up evenly.",
}


def _verdict(found: pd.DataFrame, device: Device) -> str:
    best = found.iloc[0]
    threshold = device.wanted.ordered_variation
    count = int((found["forms"] == YES).sum())
    words = VERDICTS[best["forms"]]
    words += f" The spacings count as even (CV up to {threshold:g}) at {count} of {len(found)} "
    words += "conditions that were tried."
    if best["reason"]:
        words += " None of them is within all limits of validity: " + best["reason"] + "."
    if device.bead_rate and not best["has_wanted_rate"]:
        there = found.loc[found["has_wanted_rate"], "deborah"]
        where = " and ".join(f"De = {De:g}" for De in there)
        beyond = f" are reached beyond the limits of validity only, at {where}."
        words += f" {device.bead_rate:g} beads/s" + (beyond if where else " are not reached.")
    return words


def _condition(row, device: Device) -> str:
    spacing = device.particle * row.spacing_d
    words = (
        f"{row.flow_rate_uL_per_min:.2g} uL/min (De = {row.deborah:g}), {row.feed_percent:.2g} % "
        f"in the feed, {rate_in_words(row.beads_per_second)} beads/s: "
        f"spacing {spacing:.1f} +- {device.particle * row.spacing_d_error:.1f} um, CV "
        f"{row.variation_at_inlet:.2f} -> {_with_errors(row)}; one bead in "
        f"{row.single_percent:.0f} % of the droplets (as many at random: "
        f"{row.single_random_percent:.0f} %); "
        f"{row.pressure_bar:.2g} bar. Trains: {row.forms}."
    )
    return words + (f" Not valid: {row.reason}." if row.reason else "")


def _with_errors(row) -> str:
    errors = (row.variation_sampling, row.variation_model)
    words = (f"{e:.2f}" if e >= 0.005 else "<0.01" for e in errors if math.isfinite(e))
    return " +- ".join([f"{row.variation:.2f}", *words])


def _limits(best: pd.Series, device: Device) -> list[str]:
    """Why the best condition is not better."""
    length, ordering = device.wanted.length, best["ordering_length_D"]
    lines = []
    if not math.isfinite(ordering):
        lines.append("closeness: an evenly spaced train of this spacing does not order")
    else:
        short = "longer than" if ordering > length else "within"
        lines.append(
            f"length: neighbours even out along {device.centimetres(ordering):.3g} cm "
            f"({ordering:.0f} D), {short} the channel of {device.centimetres(length):.3g} cm"
        )
    if device.variation:
        most = best["largest_bead_variation_percent"]
        lines.append(
            f"size: beads vary by {100 * device.variation:.3g} %; by the linear law the train "
            f"would be even with at most {most:.2g} %"
        )
    lines.append(
        f"the linear law says CV {best['variation_by_linear_law']:.2f} at the outlet, the "
        f"simulated trains {best['variation']:.2f}; it knows no close pairs"
    )
    if best["touching_percent"] >= 1:
        lines.append(f"closeness: {best['touching_percent']:.1f} % of the beads touch another")
    if best["reason"]:
        lines.append(f"validity: {best['reason']}")
    return lines


def _remedies(best: pd.Series, remedies: Mapping[str, float], device: Device) -> list[str]:
    """Other devices for the same flow and mean spacing, the one with the least CV first."""
    now = best["variation_by_linear_law"]
    ranked = sorted(remedies.items(), key=lambda item: item[1])
    return [_remedy(name, now, after, device) for name, after in ranked]


def _remedy(name: str, now: float, after: float, device: Device) -> str:
    """What another device would change, and why if it would not help."""
    change = f"CV {now:.2f} -> {after:.2f}, by the linear law"
    if after < now:
        return f"{name}: {change}"
    why = (
        "beads of different size go on drifting apart" if device.variation else "it does not order"
    )
    return f"{name} would not help: {change}" + (f"; {why}" if name == LONGER else "")


def _notes(device: Device) -> list[str]:
    law = device.wanted.injection
    return [
        f"Beads enter by the {law} law, on the axis",
        "Errors are of sampling (95 %), and of the model: the table and the closure",
        "A train counts by the coefficient of variation (CV) of the distances of neighbours",
    ]
