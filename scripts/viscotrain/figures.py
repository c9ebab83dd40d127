r"""Figures of a study: each a function from a dataset to a matplotlib figure and the data it shows.

Conventions. A relative velocity is that of the sphere ahead minus that of the one behind: positive
is repulsion (the gap opens, red), negative attraction (the gap closes, blue). Distances are drawn
on 1 - 1/s, the coordinate of the interpolant from contact (0) to infinity (1), with ticks labelled
by s. Holes of the table are crosses and are never painted over; nodes that are not accurate, by the
estimate of their error, are open. Colours are safe for the colour-blind: viridis, RdBu_r where
signs count, those of Okabe and Ito for lines.

Figures are made without pyplot, so that importing this module changes no backend and no setting.
"""

import functools
import itertools
import math
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike, NDArray

from viscotrain import datasets
from viscotrain.errors import ViscotrainError
from viscotrain.interpolation import LEADING, MIDDLE, PARTICLES, TripletVelocities, VelocityTable
from viscotrain.table import ERRORS, INACCURATE, NEGLIGIBLE, PAIRS, holes
from viscotrain.trains import TOUCHING, moving_frame

STYLE = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same figure on every machine
    "font.size": 8,
    "mathtext.fontset": "dejavusans",
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "figure.titlesize": 9,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.title_fontsize": 7,
    "legend.frameon": False,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.2,
    "hatch.linewidth": 0.5,
    "axes.unicode_minus": True,
    "pdf.fonttype": 42,  # text stays text
    "savefig.dpi": 200,
}
COLUMN, PAGE = 3.5, 7.2  # widths of figures in inches
BLUE, VERMILLION, GREY, PALE_GREY = "#0072B2", "#D55E00", "#777777", "#CCCCCC"  # Okabe and Ito
SIGNED = "RdBu_r"
REPULSION, ATTRACTION = ("repulsion", "gap opens"), ("attraction", "gap closes")
REPULSION_COLOUR, ATTRACTION_COLOUR = "#B2182B", "#2166AC"  # towards the ends of RdBu_r
MARKERS = "osD^vP*X"
NODE_KINDS = ("simulated", "inaccurate", "hole")  # of a pair
DISTANCE_TICKS = (1, 1.2, 1.5, 2, 3, 5, 10, math.inf)
GRID = 241  # points per axis of a drawn interpolant
LEVELS = 20  # of filled contours, about
DRAWN_LENGTH = 80.0  # of a train, in d
FIELD_MARGIN = 0.7  # of the drawn field beyond the outer spheres' centres, in D
DECADES = 3  # of a logarithmic colour map
HIDDEN = {"CreationDate": None, "ModDate": None}  # clocks, which would spoil identical bytes


class FigureError(ViscotrainError, ValueError):
    """A figure is asked for that does not exist, or that the data cannot give."""


class Drawing(NamedTuple):
    """A figure and the data it shows: a dataset is kept as netCDF, a data frame as CSV."""

    figure: Figure
    data: xr.Dataset | pd.DataFrame


def styled(function: Callable) -> Callable:
    """Run a function with the style of all figures, and leave the user's settings alone."""

    @functools.wraps(function)
    def with_style(*args, **kwargs):
        with matplotlib.rc_context():
            matplotlib.rcdefaults()
            matplotlib.rcParams.update(STYLE)
            return function(*args, **kwargs)

    return with_style


def draw(name: str, dataset: xr.Dataset, confinement: float) -> Drawing:
    """Make the figure of this name, as in `relative_velocities_De5`.

    Args:
        name: File name of the figure, without extension.
        dataset: The velocity table, the field, the trains, the film or the design map, whichever
            the figure shows.
        confinement: d/D.

    Raises:
        FigureError: There is no such figure.
    """
    from viscotrain import design_figures  # not above: it has its style from here

    number = r"([0-9.e+-]+)"
    if found := re.fullmatch(f"relative_velocities_De{number}", name):
        return relative_velocities(dataset, float(found[1]), confinement)
    if name == "pair_velocity":
        return pair_velocity(dataset, confinement)
    if name == "stress_field":
        return stress_field(dataset)
    if re.fullmatch(f"spacing_De{number}_phi{number}", name):
        return spacing(dataset)
    if re.fullmatch(f"train_De{number}_phi{number}", name):
        return train(dataset)
    if re.fullmatch(f"stations_De{number}_phi{number}", name):
        return design_figures.stations(dataset)
    if name == "spacing_law":
        return design_figures.spacing_law(dataset)
    if name == "design_map":
        return design_figures.draw_design_map(dataset)
    raise FigureError(
        f"figure is {name!r}; allowed: relative_velocities_De*, pair_velocity, stress_field, "
        "spacing_De*_phi*, train_De*_phi*, stations_De*_phi*, spacing_law, design_map"
    )


@styled
def save(drawing: Drawing, stem: str | Path) -> list[Path]:
    """Write `stem`.png, `stem`.pdf and `stem`.nc or `stem`.csv; bytes depend on content only."""
    stem = Path(stem)
    stem.parent.mkdir(parents=True, exist_ok=True)
    table = isinstance(drawing.data, pd.DataFrame)
    # with_suffix would cut names at their decimal point
    paths = [
        stem.with_name(stem.name + end) for end in (".png", ".pdf", ".csv" if table else ".nc")
    ]
    drawing.figure.savefig(paths[0], metadata={"Software": None})
    drawing.figure.savefig(paths[1], metadata=HIDDEN)
    if table:
        drawing.data.to_csv(paths[2], index=False, lineterminator="\n")
    else:
        datasets.write(drawing.data, paths[2])
    return paths


# ------------------------------------------------------------------------------------ distances


def distance_coordinate(distance: ArrayLike) -> NDArray:
    """Where a distance is drawn: contact at 0, infinity at 1."""
    return 1.0 - 1.0 / np.asarray(distance, dtype=float)


def _all_distances() -> NDArray:
    """From contact to infinity, evenly on the drawn axis."""
    with np.errstate(divide="ignore"):
        return 1.0 / (1.0 - np.linspace(0.0, 1.0, GRID))


def _distance_axis(axis: Axis):
    axis.set_ticks(
        distance_coordinate(DISTANCE_TICKS),
        ["\N{INFINITY}" if math.isinf(s) else f"{s:g}" for s in DISTANCE_TICKS],
    )


def _power(limit: float) -> int:
    """Power of ten by which values up to `limit` are drawn."""
    return math.floor(math.log10(limit)) if limit > 0 else 0


def _velocity_unit(power: int) -> str:
    return r"[$\bar{U}$]" if power == 0 else rf"[$10^{{{power}}}\,\bar{{U}}$]"


# --------------------------------------------------------------------------- relative velocities


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
    s = _all_distances()
    surface = np.full((GRID, GRID, 2), np.nan)
    if not missing:
        surface = np.diff(velocities.at(deborah)(s[:, None], s[None, :]), axis=-1)
    data = _relative_velocity_data(s, surface, sp, sf, nodes, layer["deborah"])

    drawn = nodes if missing else surface
    error = _error(layer)
    rough = _inaccurate_nodes(layer, missing)
    limit = float(np.nanmax(np.abs(drawn), initial=NEGLIGIBLE))
    power = _power(limit)
    norm = Normalize(-limit / 10**power, limit / 10**power)
    figure = Figure(figsize=(PAGE, 4.2), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.03, h_pad=0.03)
    rows = figure.add_gridspec(2, 2, height_ratios=[0.12, 1.0])
    _draw_triplet(figure.add_subplot(rows[0, :]), deborah, confinement)
    panels = [figure.add_subplot(rows[1, n]) for n in range(2)]
    x = distance_coordinate(s)
    for n, (axes, who) in enumerate(zip(panels, ("trailing", "leading"), strict=True)):
        scaled = surface[..., n] / 10**power
        if missing:
            shown = _draw_coloured_nodes(axes, sp, sf, nodes[..., n] / 10**power, norm)
        else:
            shown = _draw_surface(axes, x, scaled, norm)
            closest = distance_coordinate(velocities.smallest_distance)
            _draw_uncertainty(axes, x, scaled, error / 10**power, closest)
            _draw_zero(axes, x, scaled)
            _draw_nodes(axes, sp, sf)
        _draw_lubrication(axes, velocities.smallest_distance)
        _draw_holes(axes, missing)
        _draw_inaccurate(axes, rough)
        axes.set_title(
            rf"gap of middle and {who} sphere, $U_{n + 2} - U_{n + 1}$", loc="left", pad=7
        )
        axes.set(aspect="equal", xlim=(0, 1), ylim=(0, 1))
        axes.set(xlabel="distance to the trailing sphere, $s_p$ [$d$]")
        _distance_axis(axes.xaxis)
        _distance_axis(axes.yaxis)
    panels[0].set_ylabel("distance to the leading sphere, $s_f$ [$d$]")
    _signed_colour_bar(figure, panels, shown, f"relative velocity {_velocity_unit(power)}")
    crosses = not missing and bool(drawn.min() < 0 < drawn.max())
    _legend_below(figure, bool(missing), crosses, None if missing else error, bool(rough))
    return Drawing(figure, data)


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
    bar = figure.colorbar(shown, ax=panels, aspect=28, pad=0.035, ticks=MaxNLocator(8, symmetric=1))
    bar.set_label(label)
    bar.ax.set_title("\n".join(REPULSION), color=REPULSION_COLOUR, fontsize=7)
    bar.ax.set_xlabel("\n".join(ATTRACTION), color=ATTRACTION_COLOUR, fontsize=7)


def _draw_surface(axes: Axes, x: NDArray, values: NDArray, norm: Normalize):
    levels = MaxNLocator(LEVELS, symmetric=True).tick_values(norm.vmin, norm.vmax)
    filled = axes.contourf(x, x, values.T, levels, cmap=SIGNED, norm=norm)
    filled.set_edgecolor("face")  # else white seams in the PDF
    filled.set_linewidth(0.3)
    return filled


def _draw_zero(axes: Axes, x: NDArray, values: NDArray):
    inner = np.maximum(np.arange(x.size), 1)  # at contact everything is zero
    values = values[np.ix_(inner, inner)]
    if values.min() < 0 < values.max():
        axes.contour(x, x, values.T, [0.0], colors="black", linewidths=1.0)


def _draw_uncertainty(axes: Axes, x: NDArray, values: NDArray, error: float, closest: NDArray):
    """Cover values below the interpolation error, whose sign is not known.

    Below the smallest tabulated distance lubrication shrinks velocity and error alike.
    """
    tabulated = np.maximum(np.arange(x.size), np.searchsorted(x, closest))
    values = values[np.ix_(tabulated, tabulated)]
    if error > 0 and np.abs(values).min() < error:
        axes.contourf(x, x, values.T, [-error, error], colors=[PALE_GREY])


def _error(layer: xr.Dataset) -> float:
    """Largest error of relative velocities at one De, in Ubar; NaN if it was not measured.

    That of the interpolation, found between the nodes, plus that of the simulations, as far as it
    is estimated.
    """
    if "check_error" not in layer or not np.isfinite(layer["check_error"]).any():
        return math.nan
    discretisation = float(layer[ERRORS[1]].max()) if ERRORS[1] in layer else 0.0
    return float(np.abs(layer["check_error"]).max()) + np.nan_to_num(discretisation)


def _inaccurate_nodes(layer: xr.Dataset, missing: Iterable) -> list[tuple[float, float]]:
    """(sp, sf) of the solved nodes at one De whose estimated error is not within the allowed."""
    status = layer["status"].transpose("sp", "sf").values
    places = [
        (float(layer["sp"][i]), float(layer["sf"][j])) for i, j in np.argwhere(status == INACCURATE)
    ]
    return [place for place in places if place not in missing]


def _draw_nodes(axes: Axes, sp: NDArray, sf: NDArray):
    p, f = np.meshgrid(distance_coordinate(sp), distance_coordinate(sf), indexing="ij")
    axes.plot(p.ravel(), f.ravel(), ".", color="black", ms=3, clip_on=False, zorder=5)


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


def _draw_lubrication(axes: Axes, smallest_distance: float, both: bool = True):
    """Hatch distances below the table's, on the horizontal axis or on both."""
    edge = float(distance_coordinate(smallest_distance))
    style = {"facecolor": "none", "edgecolor": GREY, "hatch": "////", "linewidth": 0}
    axes.axvspan(0, edge, **style)
    if both:
        axes.fill_between([edge, 1], 0, edge, **style)


def _draw_holes(axes: Axes, missing: Iterable[tuple[float, float]]):
    for p, f in missing:
        where = distance_coordinate(p), distance_coordinate(f)
        axes.plot(*where, "x", color=VERMILLION, ms=7, mew=1.8, clip_on=False, zorder=6)


def _draw_inaccurate(axes: Axes, nodes: Iterable[tuple[float, float]]):
    for p, f in nodes:
        where = distance_coordinate(p), distance_coordinate(f)
        axes.plot(*where, "D", mfc="none", mec="black", ms=7, mew=0.8, clip_on=False, zorder=6)


def _legend_below(
    figure: Figure, missing: bool, crosses: bool, error: float | None, inaccurate: bool
):
    entries = [(_lubrication_patch(), "closer than the table: lubrication")]
    if missing:
        node = Line2D([], [], ls="", marker="o", mfc="white", mec="black", ms=6, mew=0.5)
        hole = Line2D([], [], ls="", marker="x", color=VERMILLION, ms=6, mew=1.8)
        entries += [(node, "simulated"), (hole, "hole: no solution, so nothing is interpolated")]
    else:
        node = Line2D([], [], ls="", marker=".", color="black", ms=4)
        entries.append((node, "simulated"))
    if inaccurate:
        node = Line2D([], [], ls="", marker="D", mfc="none", mec="black", ms=6, mew=0.8)
        entries.append((node, "not accurate"))
    if crosses:
        entries.append((Line2D([], [], color="black", lw=1.0), "no relative motion"))
    if error is not None and error > 0:
        words = f"below the error, {_scientific(error)} $\\bar{{U}}$"
        entries.append((Patch(facecolor=PALE_GREY), words))
    handles, labels = zip(*entries, strict=True)
    figure.legend(
        handles, labels, loc="outside lower center", ncols=len(entries), columnspacing=1.5
    )


def _lubrication_patch() -> Patch:
    return Patch(facecolor="none", edgecolor=GREY, hatch="/////", linewidth=0)


def _scientific(value: float) -> str:
    digits, power = f"{value:.0e}".split("e")
    return rf"{digits}$\cdot$10$^{{{int(power)}}}$"


def _draw_triplet(axes: Axes, deborah: float, confinement: float):
    """A schematic of the three spheres in their channel, and the conditions beside it."""
    axes.set(aspect="equal", xlim=(-9.5, 9.5), ylim=(-0.95, 1.0))
    axes.axis("off")
    for side in (-0.95, 0.95):
        axes.plot([-4.2, 4.2], [side, side], color=GREY, lw=1.5)
    places = (-0.8, 1.2, 3.0)
    for n, z in enumerate(places):
        axes.add_patch(Circle((z, 0), 0.36, facecolor="#DDDDDD", edgecolor="black", lw=0.6))
        axes.text(z, -0.03, str(n + 1), ha="center", va="center", fontsize=7)
    for left, right, name in ((0, 1, "$s_p$"), (1, 2, "$s_f$")):
        ends = {"xy": (places[right], 0.5), "xytext": (places[left], 0.5)}
        style = {"arrowstyle": "<->", "lw": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6}
        axes.annotate("", **ends, arrowprops=style)
        middle = (places[left] + places[right]) / 2
        axes.text(middle, 0.12, name, ha="center", va="center", fontsize=7)
    arrow = {"arrowstyle": "-|>", "lw": 1.0, "color": "black"}
    axes.annotate("", (-1.8, 0), (-2.7, 0), arrowprops=arrow)
    axes.text(-2.8, 0, "flow", ha="right", va="center", fontsize=7)
    axes.text(-4.8, 0, _conditions(deborah, confinement), ha="right", va="center")
    names = "1 trailing, 2 middle, 3 leading;\n$s$ = \N{INFINITY}: sphere not there"
    axes.text(4.8, 0, names, ha="left", va="center")


def _conditions(deborah: float, confinement: float, volume_fraction: float | None = None) -> str:
    words = [f"De = {deborah:g}", f"$d/D$ = {confinement:g}"]
    if volume_fraction is not None:
        words.append(rf"$\phi$ = {100 * volume_fraction:g} %")
    return ",  ".join(words)


# ----------------------------------------------------------------------------------------- pair


@styled
def pair_velocity(table: xr.Dataset, confinement: float) -> Drawing:
    """Relative velocity of a pair alone (no trailing sphere) against distance, at every De."""
    velocities = VelocityTable(table)
    data = pd.concat([_pair_data(velocities, De) for De in velocities.deborah], ignore_index=True)
    y = data["relative_velocity_Ubar"]
    limit = float(np.nanmax(np.abs(y), initial=NEGLIGIBLE))
    power = _power(limit)
    figure = Figure(figsize=(COLUMN, 3.6), layout="constrained")
    axes = figure.add_subplot()
    colours = matplotlib.colormaps["viridis"](np.linspace(0, 0.88, len(velocities.deborah)))
    for n, (De, colour) in enumerate(zip(velocities.deborah, colours, strict=True)):
        own = data[data["deborah"] == De].assign(
            x=lambda rows: distance_coordinate(rows["distance_d"]),
            y=lambda rows: rows["relative_velocity_Ubar"] / 10**power,
        )
        curve = own[own["kind"] == "interpolated"]
        marker = {"marker": MARKERS[n % len(MARKERS)], "ms": 4, "color": colour}
        axes.plot(curve["x"], curve["y"], color=colour)
        tabulated = curve[curve["distance_d"] >= velocities.smallest_distance]
        error = _error(table.isel(deborah=n)) / 10**power
        if 0 < error < tabulated["y"].abs().max():  # else a pair alone does not move, by symmetry
            edges = tabulated["y"] - error, tabulated["y"] + error
            axes.fill_between(tabulated["x"], *edges, color=colour, alpha=0.2, lw=0)
        _draw_pair_nodes(axes, own, marker)
        label = (
            f"De = {De:g}"
            if len(curve)
            else f"De = {De:g} (no curve, \N{MULTIPLICATION SIGN} hole)"
        )
        axes.plot([], [], label=label, ls="-" if len(curve) else "", **marker)
    if (data["kind"] == "inaccurate").any():
        axes.plot([], [], ls="", marker="o", ms=4, mfc="white", color="black", label="not accurate")
    low, high = _room_for_both_signs(y.min() / 10**power, y.max() / 10**power)
    axes.axhspan(0, high, color=REPULSION_COLOUR, alpha=0.06, lw=0)
    axes.axhspan(low, 0, color=ATTRACTION_COLOUR, alpha=0.06, lw=0)
    axes.axhline(0, color="black", lw=0.6)
    _draw_lubrication(axes, velocities.smallest_distance, both=False)
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
    axes.set_ylabel(f"velocity of the leading minus\nthe trailing sphere {_velocity_unit(power)}")
    _distance_axis(axes.xaxis)
    figure.legend(
        title=f"a pair alone, $d/D$ = {confinement:g}",
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
    """U3 - U2 without a trailing sphere: nodes, holes, and the interpolant if there is one."""
    table = velocities.dataset
    missing = [(sp, sf) for De, sp, sf in holes(table) if De == deborah]
    U = table["velocity"].isel(deborah=velocities.index(deborah)).sel(sp=np.inf)
    nodes = (U.sel(particle="leading") - U.sel(particle="middle")).values
    lost = [(np.inf, sf) in missing for sf in table["sf"].values]
    sf, lost = table["sf"].values, np.array(lost)
    status = table["status"].isel(deborah=velocities.index(deborah)).sel(sp=np.inf).values
    rough = ~lost & (status == INACCURATE)
    known = ~lost & ~rough
    parts = [("simulated", sf[known], nodes[known]), ("inaccurate", sf[rough], nodes[rough])]
    if any(lost):
        parts.append(("hole", sf[lost], np.nan))
    if not missing:
        s = _all_distances()
        parts.append(("interpolated", s, _of_a_pair(velocities.at(deborah), s)))
    return pd.concat(
        [
            pd.DataFrame(
                {"deborah": deborah, "kind": kind, "distance_d": s, "relative_velocity_Ubar": value}
            )
            for kind, s, value in parts
        ]
    )


def _of_a_pair(velocities: TripletVelocities, distance: NDArray) -> NDArray:
    U = velocities(np.inf, distance)
    return U[..., LEADING] - U[..., MIDDLE]


def _room_for_both_signs(low: float, high: float) -> tuple[float, float]:
    """Limits that hold all values and leave a place to name either side of zero."""
    span = max(high, 0.0) - min(low, 0.0) or 1.0
    return min(low, 0.0) - 0.16 * span, max(high, 0.0) + 0.16 * span


# ---------------------------------------------------------------------------------------- field


@styled
def stress_field(field: xr.Dataset) -> Drawing:
    """Mesh (upper half) and polymer stress (lower half) around the spheres of one point."""
    data = _visible(_with_trace(field))
    centre = float(data["sphere_position"].sel(sphere="middle"))
    z, r = data["z"].values - centre, data["r"].values
    trace = data["stress_trace"].values
    view = _view(data["sphere_position"].values - centre, z)
    norm = _trace_norm(trace)
    figure = Figure(figsize=(PAGE, PAGE * 0.8 / (view[1] - view[0]) + 0.75), layout="compressed")
    axes = figure.add_subplot()
    shown = axes.tripcolor(
        z,
        -r,
        data["triangles"].values,
        np.maximum(trace, norm.vmin),
        norm=norm,
        cmap="viridis",
        shading="gouraud",
        rasterized=True,
    )
    lines = data["edges"].values
    axes.add_collection(
        LineCollection(np.stack([z[lines], r[lines]], axis=-1), colors=GREY, linewidths=0.4)
    )
    radius = float(data["confinement"]) / 2
    for position, name in zip(data["sphere_position"].values, data["sphere"].values, strict=True):
        where = (position - centre, 0)
        sphere = Circle(where, radius, facecolor="white", edgecolor="black", lw=0.8, zorder=3)
        axes.add_patch(sphere)
        axes.text(*where, str(name), ha="center", va="center", fontsize=6)
    for height, words in ((0.44, "mesh"), (-0.44, "polymer stress")):
        white = {"facecolor": "white", "edgecolor": "none", "pad": 1.5, "alpha": 0.9}
        axes.text(view[0] + 0.04, height, words, ha="left", va="center", bbox=white)
    axes.set(aspect="equal", xlim=view, ylim=(-0.5, 0.5))
    axes.set_xlabel("position along the channel from the middle sphere, $z$ [$D$]")
    axes.set_ylabel("radius, $r$ [$D$]")
    axes.yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    axes.set_title(_field_conditions(data), loc="left")
    axes.set_title(r"flow $\longrightarrow$", loc="right")
    extend = "min" if np.nanmin(trace) < norm.vmin else "neither"
    bar = figure.colorbar(shown, ax=axes, pad=0.01, aspect=25, extend=extend)
    bar.set_label(
        r"trace of the polymer stress,"
        "\n"
        r"$\tau_{zz} + \tau_{rr} + \tau_{\theta\theta}$ [$\eta_0 \bar{U}/D$]"
    )
    return Drawing(figure, data)


def _with_trace(field: xr.Dataset) -> xr.Dataset:
    trace = field["stress_zz"] + field["stress_rr"] + field["stress_tt"]
    trace.attrs = {
        "long_name": "trace of the polymer stress over zero-shear viscosity times mean velocity "
        "over channel diameter",
        "units": "1",
    }
    kept = ["z", "r", "triangles", "edges", "sphere_position"]
    kept += ["confinement", "length", "deborah", "sp", "sf"]
    data = field.assign(stress_trace=trace)[[*kept, "stress_trace"]]
    return data.sel(sphere=np.isfinite(field["sphere_position"].values))


def _view(spheres: NDArray, z: NDArray) -> tuple[float, float]:
    """The drawn piece of the axis, not longer than the box."""
    return max(spheres.min() - FIELD_MARGIN, z.min()), min(spheres.max() + FIELD_MARGIN, z.max())


def _visible(field: xr.Dataset) -> xr.Dataset:
    """The part of the field that is drawn, with its points numbered anew."""
    z = field["z"].values
    low, high = _view(field["sphere_position"].values, z)
    inside = (z >= low) & (z <= high)
    triangles, edges = field["triangles"].values, field["edges"].values
    triangles, edges = triangles[inside[triangles].any(1)], edges[inside[edges].any(1)]
    kept, renumbered = np.unique(
        np.concatenate([triangles.ravel(), edges.ravel()]), return_inverse=True
    )
    new_triangles = renumbered[: triangles.size].reshape(triangles.shape)
    new_edges = renumbered[triangles.size :].reshape(edges.shape)
    return (
        field.drop_vars(["triangles", "edges"])
        .isel(point=kept)
        .assign(
            triangles=(("triangle", "corner"), new_triangles, field["triangles"].attrs),
            edges=(("edge", "edge_point"), new_edges, field["edges"].attrs),
        )
    )


def _trace_norm(trace: NDArray) -> Normalize:
    """Logarithmic over the upper decades; linear where there is no stress to speak of."""
    largest = float(np.nanmax(trace, initial=0.0))
    if largest < NEGLIGIBLE:
        return Normalize(0.0, 1.0)
    smallest = float(np.nanmin(trace))
    return LogNorm(max(smallest, largest / 10**DECADES), largest, clip=False)


def _field_conditions(field: xr.Dataset) -> str:
    distances = [
        f"{symbol} = " + (f"{s:g} $d$" if math.isfinite(s) else "\N{INFINITY}")
        for symbol, s in (("$s_p$", float(field["sp"])), ("$s_f$", float(field["sf"])))
    ]
    conditions = _conditions(float(field["deborah"]), float(field["confinement"]))
    return ",  ".join([conditions, *distances])


# --------------------------------------------------------------------------------------- trains


@styled
def spacing(trains: xr.Dataset) -> Drawing:
    """Distribution of the distances of successive spheres at each station, over all repeats."""
    measures = ["spacing_density", "mean_spacing", "spacing_mode", "spacing_variation"]
    measures = [*measures, "touching_share"]
    scalars = ["deborah", "confinement", "volume_fraction", "mean_spacing_law"]
    kept = [name + end for name in measures for end in ("", "_halfwidth")] + scalars
    data = trains[kept]
    stations = data["station"].values
    centres = data["spacing_bin"].values
    width = float(data["spacing_bin"].attrs["bin_width"])
    edges = np.append(centres - width / 2, centres[-1] + width / 2)
    figure = Figure(figsize=(COLUMN, 0.75 + 0.78 * len(stations)), layout="constrained")
    figure.get_layout_engine().set(h_pad=0.02, hspace=0.0)
    panels = figure.subplots(len(stations), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    law = float(data["mean_spacing_law"])
    for n, axes in enumerate(panels):
        _draw_distribution(axes, data.isel(station=n), edges)
        mean = axes.axvline(law, color="black", lw=0.8, ls=(0, (4, 2)))
        axes.set_xlim(edges[0] - 2 * width, edges[-1])
        axes.xaxis.set_major_locator(MaxNLocator(8, integer=True, steps=[1, 2, 5, 10]))
        axes.yaxis.set_major_locator(MaxNLocator(3))
        axes.spines[["top", "right"]].set_visible(False)
    high = data["spacing_density"] + data["spacing_density_halfwidth"].fillna(0.0)
    panels[0].set_ylim(0.0, 1.05 * float(high.max()))
    panels[-1].set_xlabel("distance to the sphere ahead, $s^*$ [$d$]")
    figure.supylabel("probability density [$1/d$]", fontsize=STYLE["axes.labelsize"])
    conditions = _conditions(*(float(data[name]) for name in scalars[:3]))
    figure.suptitle(conditions, fontsize=STYLE["axes.titlesize"])
    entries = [(mean, rf"equally spaced: $\frac{{2}}{{3}}\,(d/D)^2/\phi$ = {law:.2f} $d$")]
    if (repeats := trains.sizes["repeat"]) > 1:
        band = Patch(facecolor=BLUE, alpha=0.3, lw=0)
        entries.append((band, f"95 % band, {repeats} repeats"))
    figure.legend(
        *zip(*entries, strict=True), loc="outside lower center", ncols=2, columnspacing=1.2
    )
    return Drawing(figure, data)


def _draw_distribution(axes: Axes, station: xr.Dataset, edges: NDArray):
    density = station["spacing_density"].values
    half = np.nan_to_num(station["spacing_density_halfwidth"].values)
    low, high = np.maximum(density - half, 0), density + half
    axes.stairs(high, edges, baseline=low, fill=True, color=BLUE, alpha=0.3, lw=0)
    axes.stairs(density, edges, color=BLUE, lw=1.0)
    axes.text(
        0.99,
        0.98,
        _measures(station),
        ha="right",
        va="top",
        fontsize=6.5,
        linespacing=1.25,
        transform=axes.transAxes,
    )


def _measures(station: xr.Dataset) -> str:
    """Most frequent spacing, coefficient of variation, share of touching spheres, in words."""

    def words(name: str, decimals: int, factor: float = 1.0) -> str:
        value, half = (factor * float(station[name + end]) for end in ("", "_halfwidth"))
        known = f" \N{PLUS-MINUS SIGN} {half:.{decimals}f}" if math.isfinite(half) else ""
        return f"{value:.{decimals}f}{known}"

    return (
        f"$z$ = {float(station['station']):g} $D$\n"
        f"mode {words('spacing_mode', 1)} $d$\n"
        f"CV {words('spacing_variation', 2)}\n"
        f"touching {words('touching_share', 1, 100)} %"
    )


@styled
def train(trains: xr.Dataset) -> Drawing:
    """Successive spheres against channel position, in a frame that moves with them."""
    tracks = ["track_time", "track_position"]
    scalars = ["deborah", "confinement", "volume_fraction"]
    data = trains[[*tracks, *scalars]].transpose("track_sphere", "track_station")
    entered = data["track_position"].values[:, 0]
    data = data.isel(track_sphere=entered > entered[0] - DRAWN_LENGTH)
    z = data["track_station"].values
    y = moving_frame(z, data["track_time"].values, float(data["confinement"]))
    data["track_position"] = data["track_position"].copy(data=y)  # in the frame of those drawn
    figure = Figure(figsize=(COLUMN, 4.6), layout="constrained")
    axes = figure.add_subplot()
    width = _one_diameter(figure, y)
    start = axes.hlines(y[:, 0], z[0], z[-1], color=GREY, lw=0.5, ls=(0, (1, 2)), zorder=1)
    entries = [(start, "as entered")]
    for pieces, colour, label in zip(
        _pieces(z, y),
        (BLUE, VERMILLION),
        ("sphere", f"touching ($s^*$ < {TOUCHING:g})"),
        strict=True,
    ):
        if pieces:
            axes.add_collection(LineCollection(pieces, colors=colour, linewidths=width))
            entries.append((Line2D([], [], color=colour, lw=2), label))
    axes.set(xlim=(z[0], z[-1]), ylim=(y.min() - 2, y.max() + 2))
    axes.set_xlabel("position along the channel, $z$ [$D$]")
    axes.set_ylabel("position in the frame of the train [$d$]\n(the flow is upwards)")
    axes.set_title(_conditions(*(float(data[name]) for name in scalars)))
    figure.legend(*zip(*entries, strict=True), loc="outside lower center", ncols=3)
    return Drawing(figure, data)


def _one_diameter(figure: Figure, y: NDArray) -> float:
    """Width of a line in points that is about as wide as a sphere."""
    points = 72 * 0.8 * figure.get_figheight() / (y.max() - y.min() + 4)
    return float(np.clip(points, 0.6, 4.0))


def _pieces(z: NDArray, y: NDArray) -> tuple[list[NDArray], list[NDArray]]:
    """Lines of all spheres from station to station: apart from others, and touching one.

    Args:
        z: Stations, shape (station,).
        y: Positions in the moving frame in d, the first sphere ahead, shape (sphere, station).
    """
    near = np.abs(np.diff(y, axis=0)) < TOUCHING
    touches = np.zeros(y.shape, dtype=bool)
    touches[1:] |= near
    touches[:-1] |= near
    alone, touching = [], []
    for sphere, state in zip(y, touches, strict=True):
        cuts = [0, *(np.flatnonzero(state[1:] != state[:-1]) + 1), z.size - 1]
        for start, end in itertools.pairwise(cuts):
            piece = np.stack([z[start : end + 1], sphere[start : end + 1]], axis=-1)
            (touching if state[start] else alone).append(piece)
    return alone, touching
