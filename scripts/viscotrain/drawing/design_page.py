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

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from viscotrain.drawing.style import MARKERS, PAGE, Drawing, deborah_colour, styled
from viscotrain.trains.design import NO, PARTLY_YES, YES
from viscotrain.trains.design_answer import Answer, Device
from viscotrain.trains.occupancy import RANDOM_BEST

TEMPLATE = Path(__file__).with_suffix(".html")
COLOURS = {YES: "#009E73", PARTLY_YES: "#E69F00", NO: "#D55E00"}  # Okabe and Ito
COLUMNS = {  # title: column, format
    "flow rate [uL/min]": ("flow_rate_uL_per_min", ".3g"),
    "De": ("deborah", "g"),
    "feed [%]": ("feed_percent", ".3g"),
    "beads/s": ("beads_per_second", ".0f"),
    "spacing [d]": ("spacing_d", ".2f"),
    "CV in": ("variation_at_inlet", ".2f"),
    "CV out": ("variation", ".3f"),
    "+- sampling": ("variation_sampling", ".3f"),
    "+- model": ("variation_model", ".3f"),
    "CV by linear law": ("variation_by_linear_law", ".2f"),
    "ordering length [D]": ("ordering_length_D", ".0f"),
    "one bead per droplet [%]": ("single_percent", ".1f"),
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
        source=html.escape(source),
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
    """CV at the outlet, simulated and by the linear law, and droplets with one bead, by spacing."""
    figure = Figure(figsize=(PAGE, 3.3), layout="constrained")
    left, right = figure.subplots(1, 2)
    for n, (De, own) in enumerate(found.sort_values("spacing_d").groupby("deborah")):
        look = {"color": deborah_colour(De), "marker": MARKERS[n % len(MARKERS)], "ms": 4}
        error = np.nan_to_num(own["variation_sampling"]) + np.nan_to_num(own["variation_model"])
        label = f"De = {De:g}, {own['flow_rate_uL_per_min'].iloc[0]:.3g} \N{MICRO SIGN}L/min"
        left.errorbar(
            own["spacing_d"], own["variation"], error, lw=1, capsize=2, label=label, **look
        )
        law = {"color": look["color"], "lw": 0.8, "ls": (0, (1, 1))}
        left.plot(own["spacing_d"], own["variation_by_linear_law"], **law)
        right.plot(own["spacing_d"], own["single_percent"], lw=1, **look)
        wanted = own[own["has_wanted_rate"]]
        style = {"marker": "o", "ms": 9, "mfc": "none", "color": "black", "ls": ""}
        left.plot(wanted["spacing_d"], wanted["variation"], **style)
        right.plot(wanted["spacing_d"], wanted["single_percent"], **style)
    left.axhline(device.wanted.ordered_variation, color="black", lw=0.6, ls="--")
    left.set(ylabel="CV of the spacing at the outlet", ylim=(0, None))
    left.set_title("dotted: linear law; dashed: even below; circle: wanted rate", loc="left")
    right.axhline(100 * RANDOM_BEST, color="black", lw=0.6, ls="--")
    right.set(ylabel="droplets with one bead [%]", ylim=(0, 100))
    right.set_title("dashed: at most, with beads at random", loc="left")
    for axes in (left, right):
        axes.set(xlabel="mean spacing at the outlet [$d$]")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return Drawing(figure, found)
