"""The figure of a pair alone: its relative velocity over the distance, at every De."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from viscotrain.drawing.conventions import (
    ATTRACTION,
    ATTRACTION_COLOUR,
    CLOSER_THAN_TABLE,
    REPULSION,
    REPULSION_COLOUR,
    all_distances,
    distance_axis,
    distance_coordinate,
    draw_closer_than_table,
    mark_explained,
    marked_deborah,
    power_of_ten,
    remarks,
    velocity_unit,
)
from viscotrain.drawing.style import COLUMN, GREY, MARKER_SIZE, STYLE, Drawing, deborah_look, styled
from viscotrain.table import pairs
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.points import holes, largest_error
from viscotrain.words import INACCURATE, NEGLIGIBLE, has_solution

NODE_KINDS = ("simulated", "inaccurate", "hole")  # of a pair
SMALL_SHARE = 0.25  # of the largest velocity, below which that of a De is drawn again


@styled
def pair_velocity(table: xr.Dataset, confinement: float) -> Drawing:
    """Relative velocity of a pair alone (no trailing sphere) against distance, at every De.

    De whose velocities are small beside the largest are drawn again in a panel of their own.
    """
    velocities = VelocityTable(table)
    data = pd.concat([_pair_data(velocities, De) for De in velocities.deborah], ignore_index=True)
    errors = {De: largest_error(table.sel(deborah=De)) for De in velocities.deborah}
    groups = _groups(data)
    figure = Figure(figsize=(COLUMN, 1.5 + 2.1 * len(groups)), layout="constrained")
    panels = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
    for axes, deborah in zip(panels, groups, strict=True):
        _draw_group(axes, data[data["deborah"].isin(deborah)], errors)
        draw_closer_than_table(axes, velocities.smallest_distance, both=False)
    if len(groups) > 1:
        words = "the same, enlarged: De = " + ", ".join(f"{De:g}" for De in groups[1])
        panels[1].set_title(words, loc="left")
    words = "velocity of the leading minus the trailing sphere"
    figure.supylabel(words, fontsize=STYLE["axes.labelsize"])
    panels[-1].set_xlabel("distance of the pair, centre to centre, $s$ [$d$]")
    distance_axis(panels[-1].xaxis)
    panels[-1].set_xlim(0, 1)
    _legend(figure, data, remarks(table), f"a pair alone, $d/D$ = {confinement:g}")
    return Drawing(figure, data)


def _groups(data: pd.DataFrame) -> list[list[float]]:
    """All De, and those that move but whose largest velocity is small beside that of all."""
    limits = data["relative_velocity_Ubar"].abs().groupby(data["deborah"]).max()
    small = limits[(limits < SMALL_SHARE * limits.max()) & (limits > NEGLIGIBLE)]
    every = limits.index.tolist()
    return [every, small.index.tolist()] if len(small) else [every]


def _draw_group(axes: Axes, data: pd.DataFrame, errors: Mapping[float, float]):
    """Curves with the bands of their errors, and nodes, of some De."""
    y = data["relative_velocity_Ubar"]
    power = power_of_ten(float(np.nanmax(np.abs(y), initial=NEGLIGIBLE)))
    for De, rows in data.groupby("deborah"):
        own = rows.assign(
            x=distance_coordinate(rows["distance_d"]),
            y=rows["relative_velocity_Ubar"] / 10**power,
        )
        look = deborah_look(float(str(De)))
        curve = own[own["kind"] == "interpolated"]
        axes.plot(curve["x"], curve["y"], color=look["color"])
        nodes = own[own["kind"] != "interpolated"]
        tabulated = curve[curve["distance_d"] >= nodes["distance_d"].min()]
        error = errors[float(str(De))] / 10**power
        if 0 < error < tabulated["y"].abs().max():  # else a pair alone does not move, by symmetry
            edges = tabulated["y"] - error, tabulated["y"] + error
            axes.fill_between(tabulated["x"], *edges, color=look["color"], alpha=0.2, lw=0)
        _draw_pair_nodes(axes, own, look)
    low, high = _room_for_both_signs(y.min() / 10**power, y.max() / 10**power)
    axes.axhspan(0, high, color=REPULSION_COLOUR, alpha=0.06, lw=0)
    axes.axhspan(low, 0, color=ATTRACTION_COLOUR, alpha=0.06, lw=0)
    axes.axhline(0, color="black", lw=0.6)
    for height, vertical, words, colour in (
        (0.98, "top", REPULSION, REPULSION_COLOUR),
        (0.02, "bottom", ATTRACTION, ATTRACTION_COLOUR),
    ):
        style = {"color": colour, "ha": "right", "va": vertical, "transform": axes.transAxes}
        axes.text(0.98, height, ": ".join(words), **style)
    axes.set_ylim(low, high)
    axes.set_ylabel(velocity_unit(power))


def _legend(figure: Figure, data: pd.DataFrame, marks: list[str], title: str):
    """De with their lines and symbols, and what bands, grey and open symbols are."""
    entries: list[tuple[Any, str]] = []
    for (De, own), mark in zip(data.groupby("deborah"), marks, strict=True):
        known = (own["kind"] == "interpolated").any()
        words = "" if known else " (no curve, \N{MULTIPLICATION SIGN} hole)"
        line = Line2D([], [], ls="-" if known else "", **deborah_look(float(str(De))))
        entries.append((line, marked_deborah(float(str(De)), mark) + words))
    if (data["kind"] == "inaccurate").any():
        ring = Line2D([], [], ls="", marker="o", ms=MARKER_SIZE, mfc="white", color=GREY)
        entries.append((ring, "open: not accurate"))
    band = (Patch(color=GREY, alpha=0.3, lw=0), Line2D([], [], color=GREY))
    entries.append((band, "band: largest error"))
    entries.append((Patch(**CLOSER_THAN_TABLE), "closer than the table"))
    figure.legend(
        *zip(*entries, strict=True),
        title=title + mark_explained(marks),
        loc="outside upper center",
        ncols=2 if (data["kind"] == "hole").any() else 3,
        columnspacing=1.2,
        handlelength=1.8,
    )


def _draw_pair_nodes(axes: Axes, own: pd.DataFrame, look: dict):
    """Nodes at one De: filled, open if not accurate, crosses if there is no solution."""
    cross = {"marker": "x", "color": look["color"], "ms": 7, "mew": 1.8}
    looks = (look, look | {"mfc": "white"}, cross)
    for kind, one in zip(NODE_KINDS, looks, strict=True):
        nodes = own[own["kind"] == kind]
        if len(nodes):  # nothing, drawn without clipping, would have a place in the layout
            y = nodes["y"].fillna(0.0)
            axes.plot(nodes["x"], y, ls="", clip_on=False, zorder=3 + (kind == "hole"), **one)


def _pair_data(velocities: VelocityTable, deborah: float) -> pd.DataFrame:
    """Of a pair alone: nodes, holes, and the interpolant if there is one."""
    table = velocities.dataset
    missing = any(De == deborah for De, *_ in holes(table))
    layer = table.isel(deborah=velocities.index(deborah))
    nodes, distance = pairs.tabulated_pair_velocity(layer), layer["pair_distance"].values
    lost = ~has_solution(layer["pair_status"].values) | np.isnan(nodes)
    rough = ~lost & (layer["pair_status"].values == INACCURATE)
    known = ~lost & ~rough
    parts = [
        ("simulated", distance[known], nodes[known]),
        ("inaccurate", distance[rough], nodes[rough]),
    ]
    if any(lost):
        parts.append(("hole", distance[lost], np.nan))
    if not missing:
        s = all_distances()
        parts.append(("interpolated", s, pairs.pair_velocity(velocities.at(deborah), s)))
    return pd.concat(
        [
            pd.DataFrame(
                {"deborah": deborah, "kind": kind, "distance_d": s, "relative_velocity_Ubar": value}
            )
            for kind, s, value in parts
        ]
    )


def _room_for_both_signs(low: float, high: float) -> tuple[float, float]:
    """Limits that hold all values and leave a place to name either side of zero."""
    span = max(high, 0.0) - min(low, 0.0) or 1.0
    return min(low, 0.0) - 0.16 * span, max(high, 0.0) + 0.16 * span
