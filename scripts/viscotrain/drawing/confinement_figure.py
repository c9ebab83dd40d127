r"""Figures that compare diameters: velocities of pairs, ordering lengths, simulated trains.

Relative velocities of pairs are scaled with (d/D)^4 (`table.collapse`), and the power itself stands
below. Velocities of which a power 4 is true give a power -4 of the shortest ordering length: it is
-U/Re sigma, with sigma a derivative of them over xi.

**Unstable** are trains of which a disturbance grows. Where it takes more than `LONGEST` channels to
grow by e, as far from each other, where spheres attract each other by some 10^-6 Ubar, this is
nothing to be seen: thin.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from viscotrain.drawing.conventions import CHANNEL, FRACTION_AXES, MEAN_SPACING
from viscotrain.drawing.style import (
    GREY,
    PAGE,
    SMALL,
    Drawing,
    confinement_look,
    deborah_look,
    styled,
)
from viscotrain.table.collapse import AGREEMENT, EXPECTED, SIGNIFICANT
from viscotrain.trains.design_map import ERRORS

COLUMNS = 3  # of panels, at most
POWERS = (0.0, 6.0)  # that are drawn
NAMED = (0.1, 0.3, 0.6, 1.0)  # D: about there a power has an error bar
LARGEST_ERROR = 2.0  # of a power, that is drawn
LEAST = 0.01  # of the largest scaled velocity, that is drawn
LONGEST = 30  # channels: ordering lengths that are drawn, and growth that is seen
TICKS = (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10)  # %
SPACINGS = (2, 3, 5, 10, 20, 50)  # d
ATTRACTION = {"ls": (0, (1, 1)), "marker": ""}
BAR = 0.045  # of the height of a panel: from one bar to the next
THICK, THIN = 4, 0.8  # of bars, in points
STRIP = 0.06  # the same, of a bar in the strip above
BARS = "bars: error of sampling (95 %) plus that of the model, at the outlet"


def draw_all(
    found: xr.Dataset, orders: Sequence[xr.Dataset], maps: Sequence[xr.Dataset], length: float
) -> dict[str, tuple[str, Drawing]]:
    """Captions and figures by their file names; without design maps there is no figure of them.

    Arguments are those of the functions below.
    """
    drawn = {
        "confinement": ("Velocities of pairs of all diameters", draw_velocities(found)),
        "confinement_length": ("The shortest ordering length", draw_lengths(found, length)),
        "confinement_order": (
            "Ordering length against the volume fraction",
            draw_orders(orders, length),
        ),
    }
    if maps:
        drawn["confinement_design_map"] = ("Simulated trains at the outlet", draw_maps(maps))
    return drawn


# --------------------------------------------------------------------------------- velocities


@styled
def draw_velocities(found: xr.Dataset) -> Drawing:
    """Collapse and power at the smallest and the largest Deborah number above 0.

    Args:
        found: Of `studies.confinement.compare`.
    """
    deborah = found["deborah"].values[found["deborah"].values > 0]
    shown = list(dict.fromkeys([deborah[0], deborah[-1]]))
    figure = Figure(figsize=(PAGE, 5.2), layout="constrained")
    panels = figure.subplots(2, len(shown), squeeze=False, sharex=True, sharey="row")
    for above, below, De in zip(*panels, shown, strict=True):
        _draw_collapse(above, found.sel(deborah=De))
        _draw_power(below, found.sel(deborah=De))
        below.set_xlabel(r"gap between the surfaces, $\xi$ [$D$]")
    xi = found["surface_distance"].values
    panels[0, 0].set(xscale="log", xlim=(xi[0], xi[-1]))
    panels[0, 0].xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    # or nothing is above its error
    if np.isfinite(largest := float(np.abs(_scaled(found.sel(deborah=shown))).max())):
        panels[0, 0].set(yscale="log", ylim=(LEAST * largest, 2 * largest))
    panels[0, 0].set_ylabel("relative velocity of a pair,\n$|U|/(d/D)^4$ [$\\bar{U}$]")
    panels[1, 0].set(ylim=POWERS, ylabel="power of $d/D$ that fits best")
    words = f"fits over ranges of $d/D$ (errors: 95 %; above {LARGEST_ERROR:g} left out)"
    panels[1, 0].set_title(words, loc="left")
    panels[1, 0].legend(ncols=3, loc="upper left", title="range of $d/D$", columnspacing=1.2)
    words = f"strips: $U/(d/D)^{EXPECTED:g}$\nagree within {100 * AGREEMENT:g} %"
    panels[1, 0].text(0.02, 0.03, words, fontsize=SMALL, transform=panels[1, 0].transAxes)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    handles += [Line2D([], [], color="black"), Line2D([], [], color="black", **ATTRACTION)]
    labels += ["driven apart", "drawn together"]
    figure.legend(handles, labels, loc="outside lower center", ncols=6, columnspacing=1.5)
    return Drawing(figure, _velocities(found))


def _scaled(found: xr.Dataset) -> xr.DataArray:
    """Relative velocities over (d/D)^4, where they are well above their errors."""
    known = np.abs(found["relative_velocity"]) > SIGNIFICANT * found["relative_velocity_error"]
    return (found["relative_velocity"] / found["confinement"] ** EXPECTED).where(known)


def _draw_collapse(axes: Axes, own: xr.Dataset):
    """Scaled velocities of one Deborah number: repulsion and, dotted, attraction."""
    xi = own["surface_distance"]
    for n, line in enumerate(_scaled(own).transpose("confinement", ...)):
        beta = float(line["confinement"])
        look = confinement_look(beta) | {"markevery": (2 * n, 9)}
        axes.plot(xi, line.where(line > 0), label=f"$d/D$ = {beta:g}", **look)
        axes.plot(xi, -line.where(line < 0), **look | ATTRACTION)
    axes.set_title(f"De = {float(own['deborah']):g}", loc="left")


def _draw_power(axes: Axes, own: xr.Dataset):
    """The power at each distance, and in bars where velocities go with the fourth."""
    xi = own["surface_distance"]
    for n, beta in enumerate(own["largest_confinement"].values):
        one = own.sel(largest_confinement=beta)
        look = confinement_look(beta) | {"markevery": (2 * n, 9)}
        own_range = f"{float(own['confinement'][0]):g}\N{EN DASH}{beta:g}"
        together = own["relative_velocity"].sel(confinement=beta) < 0
        axes.plot(xi, one["exponent"].where(~together), label=own_range, **look)
        axes.plot(xi, one["exponent"].where(together), **look | ATTRACTION)
        at = one.sel(surface_distance=list(NAMED), method="nearest")
        shift = at["surface_distance"] * (1 + 0.06 * n)
        bars = {"ls": "", "color": look["color"], "capsize": 2, "elinewidth": 0.8}
        error = at["exponent_halfwidth"]
        axes.errorbar(shift, at["exponent"], error.where(error <= LARGEST_ERROR), **bars)
        ends = one["collapse_nearest"], one["collapse_farthest"]
        bar = {"transform": axes.get_xaxis_transform(), "solid_capstyle": "butt", "lw": 3}
        axes.plot(ends, 2 * [0.03 + BAR * n], color=look["color"], **bar)
    axes.axhline(EXPECTED, color=GREY, lw=0.8, zorder=0)


def _velocities(found: xr.Dataset) -> pd.DataFrame:
    """The data of the collapse, and the powers at each distance."""
    U = found["relative_velocity"].to_series().rename("relative_velocity_Ubar")
    table = U.reset_index().rename(columns={"surface_distance": "surface_distance_D"})
    table["scaled_velocity_Ubar"] = (
        table["relative_velocity_Ubar"] / table["confinement"] ** EXPECTED
    )
    return table


# ------------------------------------------------------------------------------------ lengths


@styled
def draw_lengths(found: xr.Dataset, length: float) -> Drawing:
    """Shortest ordering length, and the volume fraction of it, against d/D.

    Args:
        found: Of `studies.confinement.compare`.
        length: Of the channel, in D.
    """
    names = "shortest_ordering_length", "shortest_ordering_length_volume_fraction"
    figure = Figure(figsize=(PAGE, 2.7), layout="constrained")
    left, right = figure.subplots(1, 2)
    own = found[list(names)].where(np.isfinite(found[names[0]]))
    own = own.sel(deborah=own["deborah"] > 0)
    beta = own["confinement"].values
    for De in own["deborah"].values:
        look = deborah_look(De) | {"label": f"De = {De:g}"}
        left.plot(beta, own[names[0]].sel(deborah=De), **look)
        right.plot(beta, 100 * own[names[1]].sel(deborah=De), **look)
    finite = own[names[0]].values[np.isfinite(own[names[0]].values)]
    if finite.size:
        guide = finite.min() * (beta / beta[-1]) ** -EXPECTED
        left.plot(beta, guide, color=GREY, lw=0.8, label=f"as $(d/D)^{{-{EXPECTED:g}}}$")
    left.axhline(length, **CHANNEL, label=f"channel, {length:g} $D$")
    left.set(yscale="log", ylabel="shortest ordering length, $l$ [$D$]")
    right.set(yscale="log", ylabel=r"volume fraction of that train, $\phi$ [%]")
    low, high = right.get_ylim()
    ticks = [tick for tick in TICKS if low < tick < high]
    right.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    right.yaxis.set_minor_formatter(NullFormatter())
    left.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    for axes in (left, right):
        axes.set(xscale="log", xlabel="diameter of spheres over that of the channel, $d/D$")
        axes.set_xticks(beta, [f"{value:g}" for value in beta])
        axes.xaxis.set_minor_formatter(NullFormatter())
    left.legend()
    units = {names[0]: f"{names[0]}_D"}
    return Drawing(figure, own.to_dataframe().reset_index().rename(columns=units))


@styled
def draw_orders(found: Sequence[xr.Dataset], length: float) -> Drawing:
    """Ordering length of equally spaced trains against the volume fraction, by De and diameter.

    Args:
        found: Of `order.orders`, of each diameter.
        length: Of the channel, in D.
    """
    table = pd.concat([_order_rows(one) for one in found], ignore_index=True)
    figure, panels = _panels(table)
    for axes, De in panels:
        parts = list(_of_each(table[table["deborah"] == De]))
        for n, (own, look) in enumerate(parts):
            phi = own["volume_fraction_percent"].values
            stable = own["ordering_length_D"].where(own["stability"] >= 0)
            axes.plot(phi, stable, **look | {"marker": ""}, label=_label(own))
            _draw_unstable(axes, own, length, 1.03 + STRIP * (len(parts) - 1 - n), look["color"])
        axes.axhline(length, **CHANNEL, label=f"channel, {length:g} $D$")
        finite = table["ordering_length_D"].where(table["stability"] >= 0)
        lowest = finite[np.isfinite(finite)].min()
        axes.set(yscale="log", ylim=(np.fmin(lowest, length) / 2, LONGEST * length))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.set_title(f"De = {De:g}", loc="left", pad=6 + 7.5 * len(parts))
    first = panels[0][0]
    first.plot([], [], color="black", lw=THICK, label="unstable")
    words = f"unstable, seen after {LONGEST} channels only"
    first.plot([], [], color="black", lw=THIN, label=words)
    _name_fractions(panels)
    return _finished(figure, panels, "ordering length, $l$ [$D$]", table)


def _draw_unstable(axes: Axes, own: pd.DataFrame, length: float, height: float, colour):
    """A bar above the panel where trains are unstable; thin where that is not seen."""
    unstable = own["stability"].values < 0
    seen = unstable & (own["growth_length_D"].values < LONGEST * length)
    bar = {"transform": axes.get_xaxis_transform(), "solid_capstyle": "butt", "clip_on": False}
    for where, width in ((unstable & ~seen, THIN), (seen, THICK)):
        line = np.where(where, height, np.nan)
        axes.plot(own["volume_fraction_percent"], line, color=colour, lw=width, **bar)


@styled
def draw_maps(maps: Sequence[xr.Dataset]) -> Drawing:
    """How much of the scatter with which trains enter is left at the outlet, by mean spacing.

    Args:
        maps: Of `design_map.combine`, of each diameter.
    """
    table = pd.concat([_map_rows(one) for one in maps], ignore_index=True)
    figure, panels = _panels(table)
    for axes, De in panels:
        for own, look in _of_each(table[table["deborah"] == De]):
            bars = {"capsize": 2, "elinewidth": 0.8, "label": _label(own)}
            axes.errorbar(
                own["mean_spacing_d"], own["remaining"], own["remaining_error"], **look | bars
            )
        axes.axhline(1, color=GREY, lw=0.8, zorder=0)
        place = {"transform": axes.get_yaxis_transform(), "ha": "right", "va": "bottom"}
        axes.text(0.98, 1.03, "as they enter", color=GREY, fontsize=SMALL, **place)
        axes.set_title(f"De = {De:g}", loc="left")
        axes.set(xscale="log", xlabel=rf"mean spacing at the outlet, ${MEAN_SPACING}$ [$d$]")
        axes.set_xticks(SPACINGS, [f"{s:g}" for s in SPACINGS])
        axes.xaxis.set_minor_formatter(NullFormatter())
        spacing = table["mean_spacing_d"]
        axes.set_xlim(spacing.min() / 1.2, spacing.max() * 1.2)
    length = float(maps[0]["station"][-1])
    words = f"CV at {length:g} $D$ over CV at the inlet"
    return _finished(figure, panels, words, table, BARS)


def _order_rows(found: xr.Dataset) -> pd.DataFrame:
    growth = found["growth_rate"].max("wave_number")
    names = ["ordering_length", "stability", "volume_fraction"]
    kept = found[names].assign(growth_length=found["velocity"] / growth.where(growth > 0))
    kept = kept.to_dataframe().reset_index()
    kept = kept[kept["deborah"] > 0]
    return pd.DataFrame(
        {
            "deborah": kept["deborah"],
            "confinement": float(found["confinement"]),
            "spacing_d": kept["spacing"],
            "volume_fraction_percent": 100 * kept["volume_fraction"],
            "ordering_length_D": kept["ordering_length"],
            "growth_length_D": kept["growth_length"],
            "stability": kept["stability"],
        }
    )


def _map_rows(design_map: xr.Dataset) -> pd.DataFrame:
    """CV at inlet and outlet, and their ratio with the error of the latter."""
    inlet, outlet = (design_map.isel(station=n) for n in (0, -1))
    variation, given = outlet["spacing_variation"], design_map.attrs["given"]
    error = sum((outlet[f"spacing_variation{end}"].fillna(0) for end in ERRORS), 0 * variation)
    columns = {
        "volume_fraction_percent": 100 * outlet["volume_fraction"].broadcast_like(variation),
        "mean_spacing_d": outlet["mean_spacing"],
        "spacing_variation_inlet": inlet["spacing_variation"],
        "spacing_variation": variation,
        "error": error,
        "remaining": variation / inlet["spacing_variation"],
        "remaining_error": error / inlet["spacing_variation"],
    }
    kept = {
        name: value.transpose("deborah", given).values.ravel() for name, value in columns.items()
    }
    first = {
        "deborah": np.repeat(outlet["deborah"].values, outlet.sizes[given]),
        "confinement": float(design_map["confinement"]),
    }
    return pd.DataFrame(first | kept).dropna(subset="spacing_variation")


def _panels(table: pd.DataFrame) -> tuple[Figure, list[tuple[Axes, float]]]:
    """A panel for each Deborah number."""
    deborah = sorted(table["deborah"].unique())
    columns = min(COLUMNS, len(deborah))
    lines = -(-len(deborah) // columns)
    figure = Figure(figsize=(PAGE, 0.7 + 2.6 * lines), layout="constrained")
    panels = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True).flatten()
    for unused in panels[len(deborah) :]:
        unused.set_axis_off()
    return figure, list(zip(panels, deborah, strict=False))


def _of_each(table: pd.DataFrame):
    """Rows of each diameter, with their colour and marker."""
    for beta in sorted(table["confinement"].unique()):
        yield table[table["confinement"] == beta], confinement_look(beta)


def _label(own: pd.DataFrame) -> str:
    return f"$d/D$ = {own['confinement'].iloc[0]:g}"


def _name_fractions(panels):
    for axes, _ in panels:
        axes.set(xscale="log", xlabel=FRACTION_AXES["volume_fraction"])
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _finished(
    figure: Figure, panels, words: str, table: pd.DataFrame, title: str | None = None
) -> Drawing:
    panels[0][0].set_ylabel(words)
    handles, labels = panels[0][0].get_legend_handles_labels()
    place = {"loc": "outside lower center", "ncols": 4, "columnspacing": 1.5}
    figure.legend(handles, labels, title=title, **place)
    return Drawing(figure, table)
