r"""Figures about spheres that are conserved and seen: the spacing law, views of all stations.

**Spacing law.** One sphere per length s* d of an equally spaced train gives

    s* phi = phi_mp beta^2,    phi_mp = 2/3 in a tube (beta = d/D),  pi/6 in a square channel
    (beta = d/H),

the latter being the channel of the study's experiments. Simulated trains keep to it whether they
order or not: spheres are conserved. So the figure checks that spheres are injected, moved and
counted consistently; it says nothing about order.
"""

import math

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

from viscotrain.drawing.conventions import (
    FRACTION_AXES,
    MEAN_SPACING,
    POSITION,
    mark_explained,
    marked_deborah,
    remarks,
    train_conditions,
    with_sphere_rate,
)
from viscotrain.drawing.scale_bar import scale_bar
from viscotrain.drawing.style import (
    BLUE,
    PAGE,
    VERMILLION,
    Drawing,
    deborah_look,
    styled,
)
from viscotrain.fluid.units import CENTIMETRES
from viscotrain.trains import design_map
from viscotrain.trains.sizes import contact
from viscotrain.trains.statistics import TOUCHING, touching

TUBE, SQUARE = 2 / 3, math.pi / 6  # phi_mp
DASHES = "-", "--"  # of the study's channel and of the other one

# ------------------------------------------------------------------------------------ spacing law


@styled
def spacing_law(dataset: xr.Dataset) -> Drawing:
    """Consistency check: mean spacing at the outlet against that of as many equidistant spheres."""
    data = _law_data(dataset)
    beta = float(dataset["confinement"])
    figure = Figure(figsize=(PAGE, 3.1), layout="constrained")
    figure.get_layout_engine().set(wspace=0.06)
    left, right = figure.subplots(1, 2)
    phi = data["volume_fraction_percent"]
    line = np.geomspace(phi.min() / 1.5, phi.max() * 1.5, 50)
    laws = _laws(dataset)
    for (share, _, _), dashes in zip(laws, DASHES, strict=True):
        left.plot(line, 100 * share * beta**2 / line, color="black", ls=dashes, lw=0.9)
        right.plot(line, np.full_like(line, share), color="black", ls=dashes, lw=0.9)
    handles = [Line2D([], [], color="black", ls=dashes, lw=0.9) for dashes in DASHES]
    labels = [words for _, _, words in laws]
    deborah, beyond = dataset["deborah"].values, remarks(dataset)
    for n, De in enumerate(deborah):
        own = data[data["deborah"] == De]
        x = own["volume_fraction_percent"] * 1.03 ** (n - (len(deborah) - 1) / 2)
        marker = deborah_look(De) | {"ls": ""}
        known = own["mean_spacing_d_halfwidth"].fillna(0) + own["mean_spacing_d_model_error"]
        left.errorbar(x, own["mean_spacing_d"], known, lw=0.8, capsize=2, **marker)
        scaled = own["volume_fraction_percent"] / 100 / beta**2
        right.errorbar(
            x, own["mean_spacing_d"] * scaled, known * scaled, lw=0.8, capsize=2, **marker
        )
        handles.append(Line2D([], [], **marker))
        ratio = float((own["feed_volume_fraction_percent"] / own["volume_fraction_percent"]).mean())
        labels.append(
            rf"simulated, {marked_deborah(De, beyond[n])} ($\phi_{{feed}}$ = {ratio:.2f} $\phi$)"
        )
    left.set(xscale="log", yscale="log", ylabel=f"mean spacing, ${MEAN_SPACING}$ [$d$]")
    right.set(xscale="log", ylabel=rf"${MEAN_SPACING}\,\phi/\beta^2$")
    right.margins(y=0.3)
    for axes in (left, right):
        axes.set(xlabel=FRACTION_AXES["volume_fraction"], xlim=(line[0], line[-1]))
        ticks = np.unique([float(f"{value:.2g}") for value in phi])  # of a feed: several, close
        axes.set_xticks(ticks, [f"{value:g}" for value in ticks])
        axes.xaxis.set_minor_formatter(NullFormatter())
    left.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    left.yaxis.set_minor_formatter(FuncFormatter(_one_digit))
    left.set_title(
        rf"consistency check: ${MEAN_SPACING}\,\phi$ = $\phi_{{mp}} \beta^2$,  $d/D$ = {beta:g}",
        loc="left",
    )
    right.set_title("the same, scaled (bars: sampling plus model error)", loc="left")
    if words := mark_explained(beyond):
        handles.append(Line2D([], [], ls=""))
        labels.append(words.strip())
    figure.legend(handles, labels, loc="outside lower center", ncols=2, columnspacing=2)
    return Drawing(figure, data)


def _laws(dataset: xr.Dataset) -> list[tuple[float, str, str]]:
    """phi_mp, column and words: of the study's channel, and of another one beside it."""
    tube = TUBE, "tube_d", r"tube: $\phi_{mp}$ = 2/3, $\beta$ = $d/D$"
    if "channel" in dataset.attrs:
        own = TUBE * float(dataset["inscribed_share"])
        return [(own, "duct_d", rf"duct: $\phi_{{mp}}$ = {own:.3f}, $\beta$ = $d/D$"), tube]
    words = r"square channel (study): $\phi_{mp}$ = $\pi$/6, $\beta$ = $d/H$"
    return [tube, (SQUARE, "square_channel_d", words)]


def _one_digit(value: float, _) -> str:
    """Labels of minor ticks on a logarithmic axis: 2 and 5, times powers of ten."""
    digit = round(value / 10 ** math.floor(math.log10(value)))
    return f"{value:g}" if digit in (2, 5) else ""


def _law_data(dataset: xr.Dataset) -> pd.DataFrame:
    table = design_map.table(dataset)
    outlet = table[table["channel_length_D"] == table["channel_length_D"].max()]
    kept = ["deborah", "volume_fraction_percent", "feed_volume_fraction_percent", "injection"]
    kept += ["mean_spacing_d", "mean_spacing_d_halfwidth", "mean_spacing_d_model_error"]
    scaled = 100 * float(dataset["confinement"]) ** 2 / outlet["volume_fraction_percent"]
    laws = {column: share * scaled for share, column, _ in _laws(dataset)}
    return outlet[kept].assign(**laws).reset_index(drop=True)


# --------------------------------------------------------------------------------------- stations


@styled
def stations(film: xr.Dataset, units: xr.Dataset) -> Drawing:
    """What the cameras at all stations see at the same moment, one under the other, to scale.

    Args:
        film: Result of `films.film`.
        units: Result of `units.physical_units`.
    """
    frame = film.sizes["frame"] // 2
    names = ["position", "diameter", "window_start", "time"]
    scalars = ["field_of_view", "confinement", "deborah", "injection_rate", "memory_number"]
    scalars += ["volume_fraction", "feed_volume_fraction", "diameter_variation"]
    data = film[[*names, *scalars]].isel(frame=frame)
    data.attrs = {"injection": film.attrs["injection"]}
    data["channel_diameter"] = units["channel_diameter"].variable
    view, beta = float(data["field_of_view"]), float(data["confinement"])
    diameter = float(data["channel_diameter"])
    count = data.sizes["station"]
    height = (PAGE - 1.0) / view
    figure = Figure(figsize=(PAGE, 0.75 + count * (height + 0.28)), layout="constrained")
    panels = figure.subplots(count, 1, squeeze=False)[:, 0]
    for axes, n in zip(panels, range(count), strict=True):
        z = data["position"].values[n]
        there = np.isfinite(z)
        z, ratio = z[there], data["diameter"].values[n][there]
        start, station = float(data["window_start"][n]), float(data["station"][n])
        near_ones = touching(z, beta, contact(ratio - 1))
        for place, own, near in zip(z, ratio, near_ones, strict=True):
            colour = VERMILLION if near else BLUE
            axes.add_patch(Circle((place, 0), own * beta / 2, facecolor=colour, lw=0))
        axes.plot([station], [-0.5], "^", color="black", ms=5, clip_on=False, zorder=5)
        axes.set(aspect="equal", xlim=(start, start + view), ylim=(-0.5, 0.5), yticks=[])
        axes.set_facecolor("#EAF1F6")
        axes.spines[["left", "right"]].set_visible(False)
        axes.spines[["top", "bottom"]].set_linewidth(1.2)
        axes.xaxis.set_major_locator(MaxNLocator(6))
        axes.set_ylabel(
            f"$z$ = {station:g} $D$\n{CENTIMETRES * diameter * station:.3g} cm",
            rotation=0,
            ha="right",
            va="center",
        )
    length, name = scale_bar(view, diameter)
    low = panels[0].get_xlim()[0] + 0.02 * view
    panels[0].plot([low, low + length], [0.62, 0.62], color="black", lw=2.5, clip_on=False)
    panels[0].text(low + length + 0.01 * view, 0.62, name, va="center")
    panels[0].text(1, 1.05, r"flow $\longrightarrow$", ha="right", transform=panels[0].transAxes)
    panels[-1].set_xlabel(POSITION)
    words = train_conditions(with_sphere_rate(data, units))
    figure.suptitle(f"{words},  all stations at the same moment")
    marks = [
        (Line2D([], [], ls="", marker="o", color=BLUE, ms=5), "sphere"),
        (
            Line2D([], [], ls="", marker="o", color=VERMILLION, ms=5),
            f"touching ($s$ < {TOUCHING:g})",
        ),
        (Line2D([], [], ls="", marker="^", color="black", ms=5), "station"),
    ]
    figure.legend(*zip(*marks, strict=True), loc="outside lower center", ncols=3)
    return Drawing(figure, data)
