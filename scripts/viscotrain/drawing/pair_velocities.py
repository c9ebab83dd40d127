"""The figure of a pair alone: its relative velocity over the distance, at every De."""

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from viscotrain.drawing.conventions import (
    ATTRACTION,
    ATTRACTION_COLOUR,
    REPULSION,
    REPULSION_COLOUR,
    all_distances,
    distance_axis,
    distance_coordinate,
    draw_closer_than_table,
    largest_error,
    mark_explained,
    marked_deborah,
    power_of_ten,
    remarks,
    velocity_unit,
)
from viscotrain.drawing.style import COLUMN, Drawing, deborah_look, styled
from viscotrain.table import pairs
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.points import holes
from viscotrain.words import INACCURATE, NEGLIGIBLE, has_solution

NODE_KINDS = ("simulated", "inaccurate", "hole")  # of a pair


@styled
def pair_velocity(table: xr.Dataset, confinement: float) -> Drawing:
    """Relative velocity of a pair alone (no trailing sphere) against distance, at every De."""
    velocities = VelocityTable(table)
    data = pd.concat([_pair_data(velocities, De) for De in velocities.deborah], ignore_index=True)
    y = data["relative_velocity_Ubar"]
    limit = float(np.nanmax(np.abs(y), initial=NEGLIGIBLE))
    power = power_of_ten(limit)
    figure = Figure(figsize=(COLUMN, 3.6), layout="constrained")
    axes = figure.add_subplot()
    beyond = remarks(table)
    for n, De in enumerate(velocities.deborah):
        own = data[data["deborah"] == De].assign(
            x=lambda rows: distance_coordinate(rows["distance_d"]),
            y=lambda rows: rows["relative_velocity_Ubar"] / 10**power,
        )
        curve = own[own["kind"] == "interpolated"]
        marker = deborah_look(De)
        colour = marker["color"]
        axes.plot(curve["x"], curve["y"], color=colour)
        tabulated = curve[curve["distance_d"] >= velocities.smallest_distance]
        error = largest_error(table.isel(deborah=n)) / 10**power
        if 0 < error < tabulated["y"].abs().max():  # else a pair alone does not move, by symmetry
            edges = tabulated["y"] - error, tabulated["y"] + error
            axes.fill_between(tabulated["x"], *edges, color=colour, alpha=0.2, lw=0)
        _draw_pair_nodes(axes, own, marker)
        label = marked_deborah(De, beyond[n])
        if not len(curve):
            label += " (no curve, \N{MULTIPLICATION SIGN} hole)"
        axes.plot([], [], label=label, ls="-" if len(curve) else "", **marker)
    if (data["kind"] == "inaccurate").any():
        axes.plot([], [], ls="", marker="o", ms=4, mfc="white", color="black", label="not accurate")
    low, high = _room_for_both_signs(y.min() / 10**power, y.max() / 10**power)
    axes.axhspan(0, high, color=REPULSION_COLOUR, alpha=0.06, lw=0)
    axes.axhspan(low, 0, color=ATTRACTION_COLOUR, alpha=0.06, lw=0)
    axes.axhline(0, color="black", lw=0.6)
    draw_closer_than_table(axes, velocities.smallest_distance, both=False)
    for height, vertical, words, colour in (
        (0.98, "top", REPULSION, REPULSION_COLOUR),
        (0.02, "bottom", ATTRACTION, ATTRACTION_COLOUR),
    ):
        style = {"color": colour, "ha": "right", "va": vertical, "transform": axes.transAxes}
        axes.text(0.98, height, ": ".join(words), **style)
    axes.set(xlim=(0, 1), ylim=(low, high))
    axes.set_xlabel(
        "distance of the pair, centre to centre, $s$ [$d$]\n"
        "(hatched: closer than the table, lubrication;\n"
        "bands: largest error of interpolation\n"
        "plus that of the simulations)"
    )
    axes.set_ylabel(f"velocity of the leading minus\nthe trailing sphere {velocity_unit(power)}")
    distance_axis(axes.xaxis)
    figure.legend(
        title=f"a pair alone, $d/D$ = {confinement:g}" + mark_explained(beyond),
        loc="outside upper center",
        ncols=2 if (data["kind"] == "hole").any() else 4,
        columnspacing=1.2,
        handlelength=1.8,
    )
    return Drawing(figure, data)


def _draw_pair_nodes(axes: Axes, own: pd.DataFrame, marker: dict):
    """Nodes at one De: filled, open if not accurate, crosses if there is no solution."""
    nodes, rough, lost = (own[own["kind"] == kind] for kind in NODE_KINDS)
    style = {"ls": "", "clip_on": False}
    axes.plot(nodes["x"], nodes["y"], zorder=3, **style, **marker)
    axes.plot(rough["x"], rough["y"], zorder=3, mfc="white", **style, **marker)
    cross = {"marker": "x", "color": marker["color"], "ms": 7, "mew": 1.8}
    axes.plot(lost["x"], 0 * lost["x"], zorder=4, **style, **cross)


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
