"""The page that answers a design: verdict, best conditions, limits, remedies, a table of all.

It is a file of its own, loads nothing and runs nothing; whatever is from a config or a file is
escaped. The figure is an SVG inside.
"""

import base64
import html
import io
import math
import string
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from viscotrain.drawing.conventions import MEAN_SPACING, draw_ordered
from viscotrain.drawing.style import MARKER_SIZE, PAGE, SMALL, Drawing, deborah_look, styled
from viscotrain.trains.design import NO, PARTLY_YES, YES
from viscotrain.trains.design_answer import VERDICTS, Answer, Device

TEMPLATE = Path(__file__).with_suffix(".html")
COLOURS = {YES: "#009E73", PARTLY_YES: "#E69F00", NO: "#D55E00"}  # Okabe and Ito
RING = {"marker": "o", "ms": 9, "mfc": "none", "color": "black", "ls": "", "mew": 0.8}
COLUMNS = {  # title: column, format
    "flow rate [\N{MICRO SIGN}L/min]": ("flow_rate_uL_per_min", ".3g"),
    "De": ("deborah", "g"),
    "feed [%]": ("feed_percent", ".3g"),
    "beads/s": ("beads_per_second", ".0f"),
    "spacing [d]": ("spacing_d", ".2g"),
    "CV in": ("variation_at_inlet", ".2f"),
    "CV out": ("variation", ".2f"),
    "\N{PLUS-MINUS SIGN} sampling": ("variation_sampling", ".2g"),
    "\N{PLUS-MINUS SIGN} model": ("variation_model", ".2g"),
    "CV by linear law": ("variation_by_linear_law", ".2f"),
    "ordering length [D]": ("ordering_length_D", ".0f"),
    "one bead per droplet [%]": ("single_percent", ".0f"),
    "as many at random [%]": ("single_random_percent", ".0f"),
    "pressure [bar]": ("pressure_bar", ".2g"),
    "memory number": ("memory_number", ".2g"),
    "trains": ("forms", ""),
}


class _Page(string.Template):
    delimiter = "@@"


def page(answer: Answer, found: pd.DataFrame, drawing: Drawing, study: str, source: str) -> str:
    """HTML of the page.

    Args:
        answer: In words.
        found: All conditions, of `design.table` with `design.with_linear_law`.
        drawing: Of `draw_design`.
        study: Its name.
        source: Program and version.
    """
    return _Page(TEMPLATE.read_text(encoding="utf-8")).substitute(
        title=html.escape(f"viscotrain: design of study {study}"),
        colour=COLOURS[found.iloc[0]["forms"]],
        question=html.escape(answer.question),
        verdict=html.escape(answer.verdict),
        sections="\n".join(_section(title, lines) for title, lines in answer.sections()),
        table=_table(found),
        figure=_embedded(drawing),
        source=html.escape(source.removeprefix("viscotrain, ")),
    )


def _section(title: str, lines: list[str]) -> str:
    items = "".join(f"<li>{html.escape(line)}</li>" for line in lines)
    return f"<h2>{html.escape(title)}</h2><ul>{items}</ul>"


def _table(found: pd.DataFrame) -> str:
    head = "".join(f"<th>{html.escape(title)}</th>" for title in COLUMNS) + "<th>not valid</th>"
    rows = []
    for _, row in found.iterrows():
        cells = "".join(f"<td>{_cell(row[name], form)}</td>" for name, form in COLUMNS.values())
        kind = ' class="invalid"' if row["reason"] else ""
        reason = f'<td class="reason">{html.escape(row["reason"])}</td>'
        rows.append(f"<tr{kind}>{cells}{reason}</tr>")
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def _cell(value, form: str) -> str:
    if isinstance(value, str):
        return html.escape(value)
    if math.isnan(value):
        return "-"
    return "none" if math.isinf(value) else f"{value:{form}}"


@styled
def _embedded(drawing: Drawing) -> str:
    """The figure as a data address."""
    file = io.StringIO()
    drawing.figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    return "data:image/svg+xml;base64," + base64.b64encode(file.getvalue().encode()).decode()


@styled
def draw_design(found: pd.DataFrame, device: Device) -> Drawing:
    """CV at the outlet and droplets with one bead against the spacing; the answer as the title.

    Args:
        found: All conditions, the best one first, of `design.table` with `design.with_linear_law`.
        device: What was asked.
    """
    figure = Figure(figsize=(PAGE, 4.1), layout="constrained")
    left, right = figure.subplots(1, 2)
    for De, own in found.sort_values("spacing_d").groupby("deborah"):
        look = deborah_look(De)
        errors = np.nan_to_num(own["variation_sampling"]) + np.nan_to_num(own["variation_model"])
        flow = f"{own['flow_rate_uL_per_min'].iloc[0]:.2g} \N{MICRO SIGN}L/min"
        label = f"De = {De:g}: {flow}, {own['pressure_bar'].iloc[0]:.2g} bar"
        _draw_conditions(left, own, own["variation"], errors, look)
        _draw_conditions(right, own, own["single_percent"], own["single_sampling_percent"], look)
        face = look["color"] if (own["reason"] == "").any() else "white"  # as the symbols
        left.plot([], [], label=label, **look | {"mfc": face})
        dotted = {"color": look["color"], "lw": 0.8, "ls": (0, (1, 1))}
        left.plot(own["spacing_d"], own["variation_by_linear_law"], **dotted)
        right.plot(own["spacing_d"], own["single_random_percent"], **dotted)
    for axes, name in ((left, "variation"), (right, "single_percent")):
        best, box = found.iloc[0], {"fontsize": SMALL, "ha": "center"}
        place = {
            "textcoords": "offset points",
            "xytext": (0, 16),
            "arrowprops": {"arrowstyle": "-"},
        }
        axes.annotate("best", (best["spacing_d"], best[name]), **place, **box)
        axes.set(xlabel=rf"mean spacing at the outlet, ${MEAN_SPACING}$ [$d$]")
        axes.margins(x=0.1)
    draw_ordered(left, device.wanted.ordered_variation)
    left.set(ylabel="CV of the spacing at the outlet", ylim=(0, None))
    left.set_title("unevenness (dotted: by the linear law)", loc="left")
    right.set(ylabel="droplets with one bead [%]", ylim=(0, 100))
    right.set_title("droplets (dotted: as many beads at random)", loc="left")
    figure.suptitle(_title(found, device), fontsize=matplotlib.rcParams["axes.titlesize"])
    _explain(figure, left, found, device)
    return Drawing(figure, found)


def _draw_conditions(axes: Axes, own: pd.DataFrame, values, errors, look: dict):
    """Conditions of one De with their errors, hollow where one is beyond a limit of validity."""
    axes.errorbar(own["spacing_d"], values, errors, **look | {"marker": ""}, lw=1, capsize=2)
    for valid, face in ((True, look["color"]), (False, "white")):
        shown = (own["reason"] == "") == valid
        axes.plot(
            own["spacing_d"][shown], values[shown], zorder=3, **look | {"ls": "", "mfc": face}
        )
    wanted = own["has_wanted_rate"]
    axes.plot(own["spacing_d"][wanted], values[wanted], **RING)
    for at, value, feed in zip(
        own["spacing_d"][wanted], values[wanted], own["feed_percent"][wanted], strict=True
    ):
        beside = {"xytext": (5, -3), "textcoords": "offset points", "va": "top"}
        axes.annotate(f"{feed:.2g} %", (at, value), fontsize=SMALL, **beside)


def _title(found: pd.DataFrame, device: Device) -> str:
    """The answer, and the device."""
    size = f", vary by {100 * device.variation:.2g} %" if device.variation else ""
    words = [
        f"beads of {device.particle:.3g} \N{MICRO SIGN}m{size}",
        f"{device.section}, {device.channel:.3g} \N{MICRO SIGN}m, $d/D$ = {device.confinement:.2g}",
        f"{device.centimetres(device.wanted.length):.3g} cm = {device.wanted.length:g} $D$",
    ]
    if device.droplet_frequency:
        words.append(f"{device.droplet_frequency:g} droplets/s")
    best = found.iloc[0]
    answer = (
        f"{VERDICTS[best['forms']]} Best, De = {best['deborah']:g}: CV "
        f"{best['variation_at_inlet']:.2f} at the inlet, {best['variation']:.2f} at the outlet; "
        f"one bead in {best['single_percent']:.0f} % of the droplets"
    )
    return answer + "\n" + ";  ".join(words)


def _explain(figure: Figure, left: Axes, found: pd.DataFrame, device: Device):
    """A legend below of De, threshold, and the signs that there are."""
    handles, labels = left.get_legend_handles_labels()
    if (found["reason"] != "").any():
        handles.append(
            Line2D([], [], ls="", marker="o", ms=MARKER_SIZE, mfc="white", color="black")
        )
        labels.append("hollow: beyond a limit of validity")
    if found["has_wanted_rate"].any():
        handles.append(Line2D([], [], **RING))
        labels.append(f"ring: {device.bead_rate:g} beads/s, with % in the feed")
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
