"""The figure of relative velocities: those of a triplet over both of its distances."""

from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from viscotrain.drawing.conventions import (
    ATTRACTION,
    ATTRACTION_COLOUR,
    BELOW_ERROR,
    CLOSER_THAN_TABLE,
    REPULSION,
    REPULSION_COLOUR,
    SIGNED,
    all_distances,
    beyond,
    conditions,
    distance_axis,
    distance_coordinate,
    draw_closer_than_table,
    power_of_ten,
    scientific,
    velocity_unit,
)
from viscotrain.drawing.style import GREY, PAGE, SMALL, VERMILLION, Drawing, styled
from viscotrain.table.attributes import INTERPOLATED
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.points import holes, largest_error
from viscotrain.words import INACCURATE, NEGLIGIBLE, PAIRS, PARTICLES

LEVELS = 20  # of filled contours, about
WIDEST = 0.04  # uncertainty of the place of a line between both signs, over the width of a panel
ROUGH = {"ls": "", "marker": "o", "mfc": "white", "mec": "black", "ms": 3, "mew": 0.6}


@styled
def relative_velocities(table: xr.Dataset, deborah: float, confinement: float) -> Drawing:
    """U2 - U1 and U3 - U2 over both distances, at one Deborah number of the table.

    Where the table has holes at this Deborah number there is no interpolant: nodes are shown as
    coloured dots.
    """
    velocities = VelocityTable(table)
    layer = table.isel(deborah=velocities.index(deborah))
    sp, sf = layer["sp"].values, layer["sf"].values
    U = layer["velocity"].transpose("sp", "sf", "particle").sel(particle=list(PARTICLES))
    nodes = np.diff(U.values, axis=-1)
    missing = [(p, f) for De, p, f in holes(table) if De == float(layer["deborah"])]
    for p, f in missing:
        nodes[sp == p, sf == f] = np.nan
    s = all_distances()
    surface = np.full((s.size, s.size, 2), np.nan)
    if not missing:
        surface = np.diff(velocities.at(deborah)(s[:, None], s[None, :]), axis=-1)
    data = _relative_velocity_data(s, surface, sp, sf, nodes, layer["deborah"])

    drawn = nodes if missing else surface
    error = largest_error(layer)
    simulated = layer["origin"].transpose("sp", "sf").values != INTERPOLATED
    rough = _inaccurate_nodes(layer, missing)
    limit = float(np.nanmax(np.abs(drawn), initial=NEGLIGIBLE))
    power = power_of_ten(limit)
    norm = Normalize(-limit / 10**power, limit / 10**power)
    figure = Figure(figsize=(PAGE, 4.2), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.03, h_pad=0.03)
    rows = figure.add_gridspec(2, 2, height_ratios=[0.12, 1.0])
    words = conditions(deborah, confinement, remark=beyond(layer).replace(": ", ":\n"))
    _draw_triplet(figure.add_subplot(rows[0, :]), words)
    panels = [figure.add_subplot(rows[1, n]) for n in range(2)]
    x, crosses = distance_coordinate(s), False
    for n, (axes, who) in enumerate(zip(panels, ("trailing", "leading"), strict=True)):
        scaled = surface[..., n] / 10**power
        if missing:
            shown = _draw_coloured_nodes(axes, sp, sf, nodes[..., n] / 10**power, norm)
        else:
            shown = _draw_surface(axes, x, scaled, norm)
            closest = distance_coordinate(velocities.smallest_distance)
            _draw_uncertainty(axes, x, scaled, error / 10**power, closest)
            crosses |= _draw_zero(axes, x, scaled, error / 10**power)
            _draw_nodes(axes, sp, sf, simulated)
        draw_closer_than_table(axes, velocities.smallest_distance)
        _draw_holes(axes, missing)
        _draw_inaccurate(axes, rough)
        _finish(axes, rf"gap of middle and {who} sphere, $U_{n + 2} - U_{n + 1}$")
    panels[0].set_ylabel("distance to the leading sphere, $s_f$ [$d$]")
    _signed_colour_bar(
        figure,
        panels,
        shown,
        f"relative velocity {velocity_unit(power)}, scale of De = {deborah:g}",
    )
    _legend_below(figure, bool(missing), crosses, None if missing else error, bool(rough))
    return Drawing(figure, data)


def _finish(axes: Axes, title: str):
    axes.set_title(title, loc="left", pad=7)
    axes.set(aspect="equal", xlim=(0, 1), ylim=(0, 1))
    axes.set(xlabel="distance to the trailing sphere, $s_p$ [$d$]")
    distance_axis(axes.xaxis)
    distance_axis(axes.yaxis)


def _relative_velocity_data(s, surface, sp, sf, nodes, deborah) -> xr.Dataset:
    def described(dims, values, long_name):
        return dims, values, {"long_name": long_name, "units": "1"}

    of = "relative velocity of two spheres over mean velocity of the flow"
    to_trailing = "distance of middle to trailing sphere over diameter"
    to_leading = "distance of leading to middle sphere over diameter"
    return xr.Dataset(
        {
            "relative_velocity": described(("sp", "sf", "pair"), surface, f"{of}, interpolated"),
            "node_relative_velocity": described(
                ("node_sp", "node_sf", "pair"), nodes, f"{of}, at the nodes; NaN: hole"
            ),
        },
        coords={
            "sp": described("sp", s, to_trailing),
            "sf": described("sf", s, to_leading),
            "node_sp": described("node_sp", sp, f"{to_trailing}, nodes"),
            "node_sf": described("node_sf", sf, f"{to_leading}, nodes"),
            "pair": ("pair", list(PAIRS), {"long_name": "spheres whose relative velocity it is"}),
            "deborah": ((), float(deborah), dict(deborah.attrs)),
        },
    )


def _signed_colour_bar(figure: Figure, panels: list[Axes], shown, label: str):
    bar = figure.colorbar(shown, ax=panels, aspect=28, pad=0.035)
    end = float(bar.vmax)
    bar.set_ticks(
        _ticks_on_edges(shown.levels, end) if hasattr(shown, "levels") else [-end, 0, end]
    )
    bar.set_label(label)
    bar.ax.set_title("\n".join(REPULSION), color=REPULSION_COLOUR, fontsize=SMALL)
    bar.ax.set_xlabel("\n".join(ATTRACTION), color=ATTRACTION_COLOUR, fontsize=SMALL)


def _ticks_on_edges(levels: NDArray, end: float) -> NDArray:
    """Edges of steps of colour, evenly from zero on, about nine up to both ends."""
    number = np.arange(levels.size) - np.argmin(np.abs(levels))
    every = max(1, round(levels.size / 9))
    return levels[(number % every == 0) & (np.abs(levels) <= end * (1 + NEGLIGIBLE))]


def _draw_surface(axes: Axes, x: NDArray, values: NDArray, norm: Normalize):
    levels = MaxNLocator(LEVELS, symmetric=True).tick_values(norm.vmin, norm.vmax)
    filled = axes.contourf(x, x, values.T, levels, cmap=SIGNED, norm=norm)
    filled.set_edgecolor("face")  # else white seams in the PDF
    filled.set_linewidth(0.3)
    return filled


def _draw_zero(axes: Axes, x: NDArray, values: NDArray, error: float) -> bool:
    """The line between both signs, as far as the error leaves it a place; whether there is one.

    The place is known within error over slope; where that is wide, the line is noise.
    """
    inner = np.maximum(np.arange(x.size), 1)  # at contact everything is zero
    values = values[np.ix_(inner, inner)]
    slope = np.hypot(*np.gradient(values, x[1] - x[0]))
    known = np.ma.masked_where(np.nan_to_num(error) > WIDEST * slope, values)
    if not known.count() or not known.min() < 0 < known.max():
        return False
    axes.contour(x, x, known.T, [0.0], colors="black", linewidths=1.0)
    return True


def _draw_uncertainty(axes: Axes, x: NDArray, values: NDArray, error: float, closest: NDArray):
    """Cover values below the interpolation error, whose sign is not known.

    Below the smallest tabulated distance lubrication shrinks velocity and error alike.
    """
    tabulated = np.maximum(np.arange(x.size), np.searchsorted(x, closest))
    values = values[np.ix_(tabulated, tabulated)]
    if error > 0 and np.abs(values).min() < error:
        axes.contourf(
            x, x, values.T, [-error, error], colors="white", hatches=[BELOW_ERROR["hatch"]]
        )


def _inaccurate_nodes(layer: xr.Dataset, missing: Iterable) -> list[tuple[float, float]]:
    """(sp, sf) of the solved nodes at one De whose estimated error is not within the allowed."""
    status = layer["status"].transpose("sp", "sf").values
    places = [
        (float(layer["sp"][i]), float(layer["sf"][j])) for i, j in np.argwhere(status == INACCURATE)
    ]
    return [place for place in places if place not in missing]


def _draw_nodes(axes: Axes, sp: NDArray, sf: NDArray, simulated: NDArray):
    p, f = np.meshgrid(distance_coordinate(sp), distance_coordinate(sf), indexing="ij")
    axes.plot(p[simulated], f[simulated], ".", color="black", ms=3, clip_on=False, zorder=5)


def _draw_coloured_nodes(axes: Axes, sp, sf, values, norm):
    p, f = np.meshgrid(distance_coordinate(sp), distance_coordinate(sf), indexing="ij")
    known = np.isfinite(values)
    return axes.scatter(
        p[known],
        f[known],
        c=values[known],
        s=60,
        cmap=SIGNED,
        norm=norm,
        edgecolors="black",
        linewidths=0.5,
        clip_on=False,
        zorder=5,
    )


def _draw_holes(axes: Axes, missing: Iterable[tuple[float, float]]):
    for p, f in missing:
        where = distance_coordinate(p), distance_coordinate(f)
        axes.plot(*where, "x", color=VERMILLION, ms=7, mew=1.8, clip_on=False, zorder=6)


def _draw_inaccurate(axes: Axes, nodes: Iterable[tuple[float, float]]):
    for p, f in nodes:
        where = distance_coordinate(p), distance_coordinate(f)
        axes.plot(*where, **ROUGH, clip_on=False, zorder=6)


def _legend_below(
    figure: Figure, missing: bool, crosses: bool, error: float | None, inaccurate: bool
):
    entries = [(Patch(**CLOSER_THAN_TABLE), "closer than the table")]
    if missing:
        node = Line2D([], [], ls="", marker="o", mfc="white", mec="black", ms=6, mew=0.5)
        hole = Line2D([], [], ls="", marker="x", color=VERMILLION, ms=6, mew=1.8)
        entries += [(node, "simulated"), (hole, "hole: no solution, so nothing is interpolated")]
    else:
        node = Line2D([], [], ls="", marker=".", color="black", ms=4)
        entries.append((node, "simulated"))
    if inaccurate:
        entries.append((Line2D([], [], **ROUGH), "open: not accurate"))
    if crosses:
        entries.append((Line2D([], [], color="black", lw=1.0), "neither opens nor closes"))
    if error is not None and error > 0:
        words = f"below the error, {scientific(error)} $\\bar{{U}}$"
        entries.append((Patch(**BELOW_ERROR), words))
    handles, labels = zip(*entries, strict=True)
    figure.legend(
        handles, labels, loc="outside lower center", ncols=len(entries), columnspacing=1.5
    )


def _draw_triplet(axes: Axes, words: str):
    """A schematic of the three spheres in their channel, and the conditions beside it."""
    axes.set(aspect="equal", xlim=(-9.5, 9.5), ylim=(-0.95, 1.0))
    axes.axis("off")
    for side in (-0.95, 0.95):
        axes.plot([-4.2, 4.2], [side, side], color=GREY, lw=1.5)
    places = (-0.8, 1.2, 3.0)
    for n, z in enumerate(places):
        axes.add_patch(Circle((z, 0), 0.36, facecolor="#DDDDDD", edgecolor="black", lw=0.6))
        axes.text(z, -0.03, str(n + 1), ha="center", va="center", fontsize=SMALL)
    for left, right, name in ((0, 1, "$s_p$"), (1, 2, "$s_f$")):
        ends = {"xy": (places[right], 0.5), "xytext": (places[left], 0.5)}
        style = {"arrowstyle": "<->", "lw": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6}
        axes.annotate("", **ends, arrowprops=style)
        middle = (places[left] + places[right]) / 2
        axes.text(middle, 0.12, name, ha="center", va="center", fontsize=SMALL)
    arrow = {"arrowstyle": "-|>", "lw": 1.0, "color": "black"}
    axes.annotate("", (-1.8, 0), (-2.7, 0), arrowprops=arrow)
    axes.text(-2.8, 0, "flow", ha="right", va="center", fontsize=SMALL)
    axes.text(-4.8, 0, words, ha="right", va="center")
    names = "1 trailing, 2 middle, 3 leading;\n$s$ = \N{INFINITY}: that sphere is far away"
    axes.text(4.8, 0, names, ha="left", va="center")
