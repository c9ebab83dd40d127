r"""Figures that a device is designed with: schematic, spacing law, design map, views of stations.

Style, colours and conventions are those of `figures`. Cells of the design map are the conditions
that were simulated; nothing is interpolated between them.

**Spacing law.** One sphere per length s* d of an equally spaced train gives

    s* phi = phi_mp beta^2,    phi_mp = 2/3 in a tube (beta = d/D),  pi/6 in a square channel
    (beta = d/H),

the latter being the channel of the study's experiments.
"""

import math

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from viscotrain.drawing.conventions import (
    mark_explained,
    marked_deborah,
    train_conditions,
    with_sphere_rate,
)
from viscotrain.drawing.scale_bar import scale_bar
from viscotrain.drawing.style import (
    BLUE,
    GREY,
    MARKERS,
    PAGE,
    PALE_GREY,
    SMALL,
    VERMILLION,
    Drawing,
    deborah_colour,
    fraction_colour,
    styled,
)
from viscotrain.fluid.units import CENTIMETRES, MICROMETRES
from viscotrain.table.memory import remark
from viscotrain.trains import design_map
from viscotrain.trains.sizes import contact
from viscotrain.trains.statistics import TOUCHING, touching
from viscotrain.trains.variables import rate_in_words, unequal, with_errors

TUBE, SQUARE = 2 / 3, math.pi / 6  # phi_mp
DASHES = "-", "--"  # of the study's channel and of the other one
WIDEST_WORDS = 25.0  # size of words in a cell times cells in a row, at most
DARK = 0.55  # share of the colour map below which words in a cell are white
CURVES = (
    ("spacing_variation", "CV of the\nspacing", 1),
    ("touching_share", "touching\nspheres [%]", 100),
    ("even_share", "spacings within\n20 % of mean [%]", 100),
)
AXES = {
    "volume_fraction": r"volume fraction in the channel, $\phi$ [%]",
    "feed_volume_fraction": r"volume fraction in the feed, $\phi_{feed}$ [%]",
}

# ------------------------------------------------------------------------------------ spacing law


@styled
def spacing_law(dataset: xr.Dataset) -> Drawing:
    """Mean spacing at the outlet over volume fraction, against that of an equally spaced train."""
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
    deborah, beyond = dataset["deborah"].values, _remarks(dataset)
    for n, (De, colour) in enumerate(zip(deborah, deborah_colour(deborah), strict=True)):
        own = data[data["deborah"] == De]
        x = own["volume_fraction_percent"] * 1.03 ** (n - (len(deborah) - 1) / 2)
        marker = {"marker": MARKERS[n % len(MARKERS)], "ms": 4, "ls": "", "color": colour}
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
    left.set(xscale="log", yscale="log", ylabel="mean spacing at the outlet, $s^*$ [$d$]")
    right.set(xscale="log", ylabel=r"$s^* \phi/\beta^2$")
    right.margins(y=0.3)
    for axes in (left, right):
        axes.set(xlabel=AXES["volume_fraction"], xlim=(line[0], line[-1]))
        ticks = np.unique([float(f"{value:.2g}") for value in phi])  # of a feed: several, close
        axes.set_xticks(ticks, [f"{value:g}" for value in ticks])
        axes.xaxis.set_minor_formatter(NullFormatter())
    left.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    left.yaxis.set_minor_formatter(FuncFormatter(_one_digit))
    left.set_title(
        rf"spacing law $s^* \phi$ = $\phi_{{mp}} \beta^2$,  $d/D$ = {beta:g}", loc="left"
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


def _remarks(dataset: xr.Dataset) -> list[str]:
    """Of each Deborah number of the map: whether a condition is beyond the quasi-steady range."""
    return [remark(dataset.sel(deborah=De)) for De in dataset["deborah"].values]


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


# ------------------------------------------------------------------------------------- design map


@styled
def draw_design_map(dataset: xr.Dataset) -> Drawing:
    """Measures at the outlet over (De, phi) as cells, and along the channel as curves."""
    deborah = dataset["deborah"].values
    rows = len(deborah)
    cells, curves = 0.62 + 0.42 * rows, 1.05
    figure = Figure(figsize=(PAGE, 1.0 + 2 * cells + 3 * curves), layout="constrained")
    figure.get_layout_engine().set(hspace=0.04, h_pad=0.03)
    upper, lower = figure.subfigures(2, 1, height_ratios=[2 * cells, 3 * curves + 0.5])
    _draw_cells(upper.subplots(2, 3, sharex=True, sharey=True), dataset)
    _draw_curves(lower, lower.subplots(3, rows, sharex=True, sharey="row", squeeze=False), dataset)
    length = float(dataset["station"][-1])
    figure.suptitle(
        f"$d/D$ = {float(dataset['confinement']):g},  "
        f"$D$ = {MICROMETRES * float(dataset['channel_diameter']):g} \N{MICRO SIGN}m,  "
        f"channel of {length:g} $D$ = {float(dataset['length'][-1]):.3g} cm,  "
        f"{dataset.attrs['injection']} injection{unequal(dataset)}\n"
        "(first \N{PLUS-MINUS SIGN}, bands: sampling error, 95 %; "
        "second \N{PLUS-MINUS SIGN}: model error)" + mark_explained(_remarks(dataset))
    )
    return Drawing(figure, design_map.table(dataset))


def _draw_cells(panels: NDArray, dataset: xr.Dataset):
    outlet = dataset.isel(station=-1).transpose("deborah", dataset.attrs["given"])
    shown = (  # statistic, title, decimals, factor
        ("spacing_variation", "CV of the spacing at the outlet", 3, 1),
        ("even_share", "spacings within 20 % of mean [%]", 1, 100),
        ("touching_share", "touching spheres at the outlet [%]", 1, 100),
        ("spacing_mode", "mode of the spacing at the outlet [$d$]", 1, 1),
    )
    for axes, (name, title, decimals, factor) in zip(panels.flat, shown, strict=False):
        values = factor * outlet[name].values
        colours = "viridis" if name in ("even_share", "spacing_mode") else "viridis_r"
        _draw_grid(axes, values, _in_words(outlet, name, decimals, factor), cmap=colours)
        axes.set_title(title)
    _draw_order(panels[1, 1], outlet, float(dataset["length"][-1]))
    _draw_entry(panels[1, 2], outlet)
    for axes in panels.flat:
        axes.set_title(axes.get_title(), fontsize=SMALL, loc="left", pad=4)
        axes.set_title("")
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
    for axes in panels[-1]:
        axes.set_xlabel(AXES[dataset.attrs["given"]], fontsize=SMALL)
    fractions = 100 * dataset[dataset.attrs["given"]].values
    panels[0, 0].set_xticks(range(fractions.size), [f"{value:g}" for value in fractions])
    panels[0, 0].set_yticks(range(dataset.sizes["deborah"]), _condition_names(dataset))


def _draw_order(axes: Axes, outlet: xr.Dataset, end: float):
    """The ordered position with the range that its errors leave; `end` is that of the channel."""
    diameter = CENTIMETRES * float(outlet["channel_diameter"])
    order, *ends = (
        diameter * outlet[f"ordered_position{end}"].values for end in ("", "_earliest", "_latest")
    )

    def words(length, earliest, latest):
        if math.isnan(length):
            return ""
        if length == latest == 0:
            return "from the\ninlet on"
        if math.isinf(earliest):
            return "not\nreached"
        low, high = (f"{x:.1f}" if math.isfinite(x) else "never" for x in (earliest, latest))
        own = f"{length:.1f}" if math.isfinite(length) else "not\nreached"
        return f"{own}\n{low} to {high}" if low != high else own

    texts = np.vectorize(words, otypes=[object])(order, *ends)
    _draw_grid(axes, order, texts, cmap="viridis_r", largest=end)
    threshold = float(outlet["ordered_variation"])
    axes.set_title(f"length from which on CV \N{LESS-THAN OR EQUAL TO} {threshold:g} [cm]")


def _draw_entry(axes: Axes, outlet: xr.Dataset):
    """The volume fraction that the axis does not show, spheres/s, and what the law makes."""
    feed = outlet.attrs["given"] == "volume_fraction"
    other = outlet["feed_volume_fraction" if feed else "volume_fraction"].values

    def words(fraction, rate, variation, touching_share):
        if math.isnan(fraction):
            return ""
        enter = f"{rate_in_words(rate)}/s\n" if math.isfinite(rate) else ""
        return f"{100 * fraction:.3g} %\n{enter}CV {variation:.2f}\n{100 * touching_share:.1f} %"

    names = ("sphere_rate", "spacing_variation_injected", "touching_share_injected")
    own = (outlet[name].values for name in names)
    texts = np.vectorize(words, otypes=[object])(other, *own)
    _draw_grid(axes, np.where(np.isnan(other), np.nan, np.inf), texts, cmap="viridis")
    name = r"\phi_{feed}" if feed else r"\phi"
    axes.set_title(f"enter: ${name}$, per s, CV, touching")


def _condition_names(dataset: xr.Dataset) -> list[str]:
    """A Deborah number with its flow rate and the pressure drop of the whole channel."""
    names = []
    for De in dataset["deborah"].values:
        own = dataset.sel(deborah=De)
        Q, drop = float(own["flow_rate"]), float(own["pressure_drop"][-1])
        bench = f"\n{Q:.3g} \N{MICRO SIGN}L/min, {drop:.2g} bar" if math.isfinite(Q) else ""
        names.append(f"{marked_deborah(De, remark(own))}{bench}")
    return names


def _in_words(outlet: xr.Dataset, name: str, decimals: int, factor: float) -> NDArray:
    """A statistic with both errors in words; empty where nothing was simulated."""
    given = outlet.attrs["given"]
    words = np.full((outlet.sizes["deborah"], outlet.sizes[given]), "", dtype=object)
    for row, column in np.argwhere(np.isfinite(outlet["mean_spacing"].values)):
        own = outlet.isel({"deborah": row, given: column})
        text = with_errors(own, name, decimals, factor, "\n\N{PLUS-MINUS SIGN} ")
        words[row, column] = text
    return words


def _draw_grid(
    axes: Axes, values: NDArray, words: NDArray, *, cmap: str, largest: float | None = None
):
    """A cell per condition with its words, coloured from 0 to the largest value; else grey."""
    finite = values[np.isfinite(values)]
    norm = Normalize(0, largest or (float(finite.max(initial=0)) or 1))
    colours, size = matplotlib.colormaps[cmap], min(5.5, WIDEST_WORDS / values.shape[1])
    for (row, column), value in np.ndenumerate(values):
        if not words[row, column]:
            continue
        face = colours(norm(value)) if math.isfinite(value) else PALE_GREY
        axes.add_patch(Rectangle((column - 0.48, row - 0.46), 0.96, 0.92, facecolor=face, lw=0))
        brightness = np.dot(matplotlib.colors.to_rgb(face), (0.299, 0.587, 0.114))
        axes.text(
            column,
            row,
            words[row, column],
            ha="center",
            va="center",
            fontsize=size,
            color="white" if brightness < DARK else "black",
        )
    axes.set(xlim=(-0.5, values.shape[1] - 0.5), ylim=(-0.5, values.shape[0] - 0.5))


def _draw_curves(figure, panels: NDArray, dataset: xr.Dataset):
    given = dataset.attrs["given"]
    z, phi = dataset["station"].values, dataset[given].values
    cm = 100 * CENTIMETRES * float(dataset["channel_diameter"])
    colours = fraction_colour(phi)
    for column, De in enumerate(dataset["deborah"].values):
        for row, (name, label, factor) in enumerate(CURVES):
            axes = panels[row, column]
            for value, colour in zip(phi, colours, strict=True):
                own = dataset.sel({"deborah": De, given: value})
                y = factor * own[name].values
                axes.plot(z, y, color=colour, lw=1)
                half = factor * own[f"{name}_halfwidth"].values
                axes.fill_between(z, y - half, y + half, color=colour, alpha=0.2, lw=0)
                error = factor * float(own[f"{name}_model_error"][-1])
                axes.errorbar(z[-1], y[-1], error, color=colour, lw=2, clip_on=False)
            if column == 0:
                axes.set_ylabel(label)
            axes.yaxis.set_major_locator(MaxNLocator(4))
        panels[0, column].axhline(float(dataset["ordered_variation"]), color=GREY, lw=0.8, ls="--")
        title = marked_deborah(De, remark(dataset.sel(deborah=De)))
        panels[0, column].set_title(title, loc="left", pad=4)
        bottom = panels[-1, column]
        bottom.set_xlim(z[0], z[-1])
        bottom.set_xlabel("length, $L$ [$D$]")
        bottom.xaxis.set_major_locator(MaxNLocator(4))
    for axes in panels[:, 0]:  # rows share their axes
        axes.set_ylim(bottom=0)
    words = f"over the length of the channel (100 $D$ = {cm:.3g} cm; bars at its end: model error)"
    figure.suptitle(words, fontsize=matplotlib.rcParams["axes.titlesize"])
    handles = [Line2D([], [], color=colour) for colour in colours]
    symbol = r"\phi" if given == "volume_fraction" else r"\phi_{feed}"
    labels = [f"${symbol}$ = {100 * value:g} %" for value in phi]
    handles.append(Line2D([], [], color=GREY, lw=0.8, ls="--"))
    labels.append("ordered below")
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 7))


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
            f"$L/D$ = {station:g}\n{CENTIMETRES * diameter * station:.3g} cm",
            rotation=0,
            ha="right",
            va="center",
        )
    length, name = scale_bar(view, diameter)
    low = panels[0].get_xlim()[0] + 0.02 * view
    panels[0].plot([low, low + length], [0.62, 0.62], color="black", lw=2.5, clip_on=False)
    panels[0].text(low + length + 0.01 * view, 0.62, name, va="center")
    panels[0].text(1, 1.05, r"flow $\longrightarrow$", ha="right", transform=panels[0].transAxes)
    panels[-1].set_xlabel("position along the channel, $z$ [$D$]")
    words = train_conditions(with_sphere_rate(data, units))
    figure.suptitle(f"{words},  all stations at the same moment")
    marks = [
        (Line2D([], [], ls="", marker="o", color=BLUE, ms=5), "sphere"),
        (
            Line2D([], [], ls="", marker="o", color=VERMILLION, ms=5),
            f"touching ($s^*$ < {TOUCHING:g})",
        ),
        (Line2D([], [], ls="", marker="^", color="black", ms=5), "station"),
    ]
    figure.legend(*zip(*marks, strict=True), loc="outside lower center", ncols=3)
    return Drawing(figure, data)
