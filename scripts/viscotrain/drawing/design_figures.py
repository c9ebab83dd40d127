r"""Figure of the spacing law: a check that spheres are conserved.

One sphere per length <s> d of an equally spaced train gives

    <s> phi = phi_mp beta^2,    phi_mp = 2/3 in a tube (beta = d/D),  pi/6 in a square channel
    (beta = d/H),

the latter being the channel of the study's experiments. Simulated trains keep to it whether they
order or not: spheres are conserved. So the figure checks that spheres are injected, moved and
counted consistently; it says nothing about order. Beside it stands what it does not say: spheres on
the axis are faster than the mean flow, so a suspension that is poured in needs more of them.
"""

import math

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from viscotrain.drawing.conventions import (
    FRACTION_AXES,
    MEAN_SPACING,
)
from viscotrain.drawing.style import (
    PAGE,
    SMALL,
    Drawing,
    deborah_look,
    styled,
)
from viscotrain.trains import design_map

TUBE, SQUARE = 2 / 3, math.pi / 6  # phi_mp
STEP = 1.03  # between the symbols of two De at a volume fraction, which else hide each other
BESIDE = 1.3  # beyond the volume fractions


@styled
def spacing_law(dataset: xr.Dataset) -> Drawing:
    """Consistency check: mean spacing at the outlet against that of as many equidistant spheres.

    Beside it what must be poured in for a volume fraction in the channel.
    """
    data = _law_data(dataset)
    figure = Figure(figsize=(PAGE, 2.3), layout="constrained")
    figure.get_layout_engine().set(wspace=0.06)
    left, right = figure.subplots(1, 2, width_ratios=[1.6, 1])
    _draw_law(left, data, dataset)
    _draw_feed(right, data)
    figure.legend(loc="outside lower center", ncols=7, columnspacing=1.2)
    return Drawing(figure, data)


def _draw_law(axes: Axes, data: pd.DataFrame, dataset: xr.Dataset):
    """Mean spacings, scaled so that the law is a constant."""
    phi = data["volume_fraction_percent"]
    scaled = phi / 100 / float(dataset["confinement"]) ** 2
    deborah = np.unique(data["deborah"])
    limits = phi.min() / BESIDE, phi.max() * BESIDE
    for n, (share, _, words) in enumerate(_laws(dataset)):
        axes.axhline(share, color="black", lw=0.9, ls="-" if n == 0 else ":")
        place = {"transform": axes.get_yaxis_transform(), "va": "center", "fontsize": SMALL}
        axes.text(1.02, share, words, **place)
    for n, De in enumerate(deborah):
        own = data["deborah"] == De
        error = data["mean_spacing_d_halfwidth"].fillna(0) + data["mean_spacing_d_model_error"]
        beside = STEP ** (n - (len(deborah) - 1) / 2)
        look = deborah_look(De) | {"ls": "", "lw": 0.8, "capsize": 2, "label": f"De = {De:g}"}
        y, bar = ((scaled * values)[own] for values in (data["mean_spacing_d"], error))
        axes.errorbar(phi[own] * beside, y, bar, **look)
    axes.set(xscale="log", xlim=limits, xlabel=FRACTION_AXES["volume_fraction"])
    axes.set_ylabel(rf"${MEAN_SPACING}\,\phi\,D^2/d^2$ at the outlet")
    ticks = np.unique([float(f"{value:.2g}") for value in phi])  # of a feed: several, close
    axes.set_xticks(ticks, [f"{value:g}" for value in ticks])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.margins(y=0.3)
    axes.set_title(
        rf"consistency check: no sphere is lost ($d/D$ = {float(dataset['confinement']):g}; "
        "bars: all errors)",
        loc="left",
    )


def _draw_feed(axes: Axes, data: pd.DataFrame):
    """Volume fraction in the feed over that in the channel, the mean of the conditions at a De."""
    ratio = data["feed_volume_fraction_percent"] / data["volume_fraction_percent"]
    mean = ratio.groupby(data["deborah"]).mean()
    for n, (De, value) in enumerate(mean.items()):
        axes.plot(n, value, ls="", **deborah_look(float(str(De))))
    axes.set_xticks(range(len(mean)), [f"{De:g}" for De in mean.index])
    axes.set(xlabel="De", ylabel=r"$\phi_{feed}/\phi$", xlim=(-0.5, len(mean) - 0.5))
    axes.margins(y=0.3)
    axes.set_title(r"what to pour in, $\phi_{feed}$", loc="left")


def _laws(dataset: xr.Dataset) -> list[tuple[float, str, str]]:
    """phi_mp, column and words: of what is simulated, and of another channel beside it."""
    if "channel" in dataset.attrs:
        own = TUBE * float(dataset["inscribed_share"])
        return [
            (own, "duct_d", f"duct: {own:.3f}"),
            (TUBE, "tube_d", "inscribed tube: 2/3"),
        ]
    words = "square channel:\n$\\pi$/6, not simulated"
    return [(TUBE, "tube_d", "tube: 2/3"), (SQUARE, "square_channel_d", words)]


def _law_data(dataset: xr.Dataset) -> pd.DataFrame:
    table = design_map.table(dataset)
    outlet = table[table["channel_length_D"] == table["channel_length_D"].max()]
    kept = ["deborah", "volume_fraction_percent", "feed_volume_fraction_percent", "injection"]
    kept += ["mean_spacing_d", "mean_spacing_d_halfwidth", "mean_spacing_d_model_error"]
    scaled = 100 * float(dataset["confinement"]) ** 2 / outlet["volume_fraction_percent"]
    laws = {column: share * scaled for share, column, _ in _laws(dataset)}
    return outlet[kept].assign(**laws).reset_index(drop=True)
