r"""Figures that compare diameters: collapse of velocities, ordering lengths, design maps.

In the first one, relative velocities of pairs are scaled with beta^4 (`table.collapse`); the power
itself stands below, and beside both how the shortest ordering length goes with beta. Velocities of
which a power 4 is true give a power -4 of that: l = -U/Re sigma, with sigma a derivative of them
over xi.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from viscotrain.drawing.conventions import FRACTION_AXES
from viscotrain.drawing.style import (
    MARKERS,
    PAGE,
    VERMILLION,
    Drawing,
    colours_of,
    deborah_colour,
    styled,
)
from viscotrain.table.collapse import EXPECTED, SIGNIFICANT
from viscotrain.trains.design_map import ERRORS

COLUMNS = 3  # of panels, at most
DASHES = ("-", "--", ":", "-.")
POWERS = (0.0, 6.0)  # that are drawn
LEAST = 0.01  # of the largest scaled velocity, that is drawn
TICKS = (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10)  # %


def draw_all(
    found: xr.Dataset, orders: Sequence[xr.Dataset], maps: Sequence[xr.Dataset], length: float
) -> dict[str, tuple[str, Drawing]]:
    """Captions and figures by their file names; without design maps there is no figure of them.

    Arguments are those of the functions below.
    """
    drawn = {
        "confinement": (
            "Velocities and ordering lengths of all diameters",
            draw_confinement(found),
        ),
        "confinement_order": (
            "Ordering length against the volume fraction",
            draw_orders(orders, length),
        ),
    }
    if maps:
        drawn["confinement_design_map"] = ("Simulated trains at the outlet", draw_maps(maps))
    return drawn


@styled
def draw_confinement(found: xr.Dataset) -> Drawing:
    """Collapse and power at the smallest and the largest Deborah number above 0; ordering lengths.

    Args:
        found: Of `studies.confinement.compare`.
    """
    deborah = found["deborah"].values[found["deborah"].values > 0]
    shown = list(dict.fromkeys([deborah[0], deborah[-1]]))
    figure = Figure(figsize=(PAGE, 4.8), layout="constrained")
    panels = figure.subplots(2, len(shown) + 1, squeeze=False)
    for above, below, De in zip(*panels[:, :-1], shown, strict=True):
        _draw_collapse(above, found.sel(deborah=De))
        _draw_power(below, found.sel(deborah=De))
    _draw_lengths(panels[0, -1], panels[1, -1], found.sel(deborah=deborah))
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, columnspacing=1.5)
    return Drawing(figure, _velocities(found))


def _draw_collapse(axes: Axes, own: xr.Dataset):
    """Scaled velocities of one Deborah number: repulsion and, dotted, attraction."""
    beta, xi = own["confinement"].values, own["surface_distance"]
    known = np.abs(own["relative_velocity"]) > SIGNIFICANT * own["relative_velocity_error"]
    scaled = (own["relative_velocity"] / own["confinement"] ** EXPECTED).where(known)
    for n, colour in enumerate(colours_of(beta.size)):
        line, style = (
            scaled.isel(confinement=n),
            {"color": colour, "ms": 3, "markevery": (2 * n, 9)},
        )
        marker = MARKERS[n % len(MARKERS)]
        name = f"$d/D$ = {beta[n]:g}"
        axes.plot(xi, line.where(line > 0), marker=marker, label=name, **style)
        axes.plot(xi, -line.where(line < 0), ls=":", **style)
    axes.set_title(f"De = {float(own['deborah']):g} (dotted: attraction)", loc="left")
    largest = float(np.abs(scaled).max())
    if np.isfinite(largest):  # or nothing is above its error
        axes.set(yscale="log", ylim=(LEAST * largest, 2 * largest))
    axes.set_ylabel(r"velocity of a pair, $|U|/\beta^4$ [$\bar{U}$]")
    _distance(axes, own)


def _draw_power(axes: Axes, own: xr.Dataset):
    """The power at each distance, thick where velocities go with beta^4."""
    largest = own["largest_confinement"].values
    smallest = float(own["confinement"][0])
    for n, (beta, colour) in enumerate(zip(largest, colours_of(largest.size + 1)[1:], strict=True)):
        one = own.isel(largest_confinement=n)
        xi, power = one["surface_distance"], one["exponent"]
        dashes = DASHES[n % len(DASHES)]
        name = rf"$\beta$ = {smallest:g} to {beta:g}"
        axes.plot(xi, power, color=colour, ls=dashes, label=name)
        inside = (xi >= one["collapse_nearest"]) & (xi <= one["collapse_farthest"])
        axes.plot(xi, power.where(inside), color=colour, lw=4, alpha=0.4)
    axes.axhline(EXPECTED, color=VERMILLION, lw=0.8)
    axes.set(ylim=POWERS, ylabel=r"fitted power $n$ of $\beta$")
    axes.legend(loc="upper left")
    _distance(axes, own)


def _distance(axes: Axes, own: xr.Dataset):
    xi = own["surface_distance"].values
    axes.set(xscale="log", xlim=(xi[0], xi[-1]), xlabel=r"distance of surfaces, $\xi$ [$D$]")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _draw_lengths(above: Axes, below: Axes, found: xr.Dataset):
    """Shortest ordering length, and the volume fraction of it, against beta."""
    beta, deborah = found["confinement"].values, found["deborah"].values
    names = "shortest_ordering_length", "shortest_ordering_length_volume_fraction"
    for n, De in enumerate(deborah):
        own, style = found.sel(deborah=De), {"marker": MARKERS[n % len(MARKERS)], "ms": 4}
        colour = deborah_colour(De)
        length = own[names[0]].where(np.isfinite(own[names[0]]))
        above.plot(beta, length, color=colour, label=f"De = {De:g}", **style)
        below.plot(beta, 100 * own[names[1]], color=colour, label=f"De = {De:g}", **style)
    finite = found[names[0]].values[np.isfinite(found[names[0]].values)]
    if finite.size:
        guide = finite.min() * (beta / beta[-1]) ** -EXPECTED
        above.plot(beta, guide, color=VERMILLION, lw=0.8, label=r"$\beta^{-4}$")
    above.set(yscale="log", ylabel="shortest ordering length, $l$ [$D$]")
    below.set(yscale="log", ylabel=r"volume fraction of it, $\phi$ [%]")
    low, high = below.get_ylim()
    ticks = [tick for tick in TICKS if low < tick < high]
    below.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    below.yaxis.set_minor_formatter(NullFormatter())
    for axes in (above, below):
        axes.set(xscale="log", xlabel=r"confinement, $\beta = d/D$")
        axes.set_xticks(beta, [f"{value:g}" for value in beta])
        axes.xaxis.set_minor_formatter(NullFormatter())
    above.legend()


def _velocities(found: xr.Dataset) -> pd.DataFrame:
    """The data of the collapse, and the powers at each distance."""
    U = found["relative_velocity"].to_series().rename("relative_velocity_Ubar")
    table = U.reset_index().rename(columns={"surface_distance": "surface_distance_D"})
    table["scaled_velocity_Ubar"] = (
        table["relative_velocity_Ubar"] / table["confinement"] ** EXPECTED
    )
    return table


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
        for n, (own, style) in enumerate(_of_each(table[table["deborah"] == De])):
            stable = own["ordering_length_D"].where(own["stability"] >= 0)
            axes.plot(own["volume_fraction_percent"], stable, **style, label=_label(own))
            bar = {"transform": axes.get_xaxis_transform(), "solid_capstyle": "butt", "lw": 4}
            height = (0.98 - 0.025 * n) * np.ones(len(own))
            unstable = own["stability"].values < 0
            axes.plot(
                own["volume_fraction_percent"], np.where(unstable, height, np.nan), **style | bar
            )
        axes.axhline(length, color="black", lw=0.8, ls="--", label=f"channel, {length:g} $D$")
        finite = table["ordering_length_D"].where(table["stability"] >= 0)
        lowest = finite[np.isfinite(finite)].min()
        axes.set(yscale="log", ylim=(min(lowest, length) / 2, 30 * length))
        axes.set_title(f"De = {De:g} (bars: unstable)", loc="left")
    return _finished(figure, panels, "ordering length, $l$ [$D$]", table)


@styled
def draw_maps(maps: Sequence[xr.Dataset]) -> Drawing:
    """Simulated scatter of the spacing at the outlet against the volume fraction.

    Args:
        maps: Of `design_map.combine`, of each diameter.
    """
    table = pd.concat([_map_rows(one) for one in maps], ignore_index=True)
    figure, panels = _panels(table)
    threshold = float(maps[0]["ordered_variation"])
    for axes, De in panels:
        for n, (own, style) in enumerate(_of_each(table[table["deborah"] == De])):
            style |= {"marker": MARKERS[n % len(MARKERS)], "ms": 4, "capsize": 2}
            error = own["error"].fillna(0)
            axes.errorbar(
                own["volume_fraction_percent"],
                own["spacing_variation"],
                error,
                **style,
                label=_label(own),
            )
        axes.axhline(threshold, color="black", lw=0.8, ls="--", label="counts as ordered below")
        axes.set_ylim(bottom=0)
        axes.set_title(f"De = {De:g}", loc="left")
    return _finished(figure, panels, "CV of the spacing at the outlet", table)


def _order_rows(found: xr.Dataset) -> pd.DataFrame:
    kept = found[["ordering_length", "stability", "volume_fraction"]].to_dataframe().reset_index()
    kept = kept[kept["deborah"] > 0]
    return pd.DataFrame(
        {
            "deborah": kept["deborah"],
            "confinement": float(found["confinement"]),
            "spacing_d": kept["spacing"],
            "volume_fraction_percent": 100 * kept["volume_fraction"],
            "ordering_length_D": kept["ordering_length"],
            "stability": kept["stability"],
        }
    )


def _map_rows(design_map: xr.Dataset) -> pd.DataFrame:
    outlet = design_map.isel(station=-1)
    variation = outlet["spacing_variation"]
    error = sum(outlet[f"spacing_variation{end}"].fillna(0) for end in ERRORS)
    phi = outlet["volume_fraction"].broadcast_like(variation)
    given = design_map.attrs["given"]
    kept = xr.Dataset({"variation": variation, "error": error, "phi": phi}).transpose(
        "deborah", given
    )
    return pd.DataFrame(
        {
            "deborah": np.repeat(kept["deborah"].values, kept.sizes[given]),
            "confinement": float(design_map["confinement"]),
            "volume_fraction_percent": 100 * kept["phi"].values.ravel(),
            "spacing_variation": kept["variation"].values.ravel(),
            "error": kept["error"].values.ravel(),
        }
    ).dropna(subset="spacing_variation")


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
    """Rows of each diameter, with their colour."""
    diameters = sorted(table["confinement"].unique())
    for beta, colour in zip(diameters, colours_of(len(diameters)), strict=True):
        yield table[table["confinement"] == beta], {"color": colour}


def _label(own: pd.DataFrame) -> str:
    return f"$d/D$ = {own['confinement'].iloc[0]:g}"


def _finished(figure: Figure, panels, words: str, table: pd.DataFrame) -> Drawing:
    for axes, _ in panels:
        axes.set(xscale="log", xlabel=FRACTION_AXES["volume_fraction"])
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    panels[0][0].set_ylabel(words)
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, columnspacing=1.5)
    return Drawing(figure, table)
