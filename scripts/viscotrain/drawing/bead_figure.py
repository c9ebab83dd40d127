r"""Figure of unequal spheres: CV of the spacing at the outlet against the variation of diameters.

A panel for each Deborah number, a colour for each volume fraction; lines by the linear theory,
symbols as simulated: full and solid for the injection of the study, open and dashed for spheres
that enter evenly.
"""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from viscotrain.drawing.conventions import INJECTIONS, draw_ordered
from viscotrain.drawing.style import GREY, PAGE, STYLE, Drawing, fraction_look, styled

STYLES = ("-", "--")  # by injection
ASIDE = (-2.0 / 72, 2.0 / 72)  # inches that symbols of an injection are moved by
LARGEST = 1.0  # CV that the axis reaches at least: that of spheres at random
ROOM = 0.03  # below zero, over the height of the axis: symbols are whole
MISSING = "the table does not say what diameters change"


@styled
def draw_diameter_variation(found: xr.Dataset) -> Drawing:
    """CV at the outlet, simulated and by the linear theory.

    Args:
        found: Result of `diameter_variation.simulate`.
    """
    deborah = np.unique(found["deborah"].values)
    phi = np.unique(found["given_fraction"].values)
    symbol = r"\phi" if found.attrs["given"] == "volume_fraction" else r"\phi_{feed}"
    figure = Figure(figsize=(PAGE, 3.1), layout="constrained")
    panels = figure.subplots(1, deborah.size, sharey=True, squeeze=False)[0]
    for n in range(found.sizes["condition"]):
        own = found.isel(condition=n)
        _draw_condition(panels[int(np.searchsorted(deborah, float(own["deborah"])))], own)
    for axes, De in zip(panels, deborah, strict=True):
        ordered = _finish(axes, found, float(De))
    error = found["spacing_variation_halfwidth"].fillna(0.0)
    high = [found["spacing_variation"] + error, found["law_variation"]]
    most = max(LARGEST, *(float(values.fillna(0.0).max()) for values in high))
    panels[0].set_ylim(-ROOM * most, (1 + ROOM) * most)
    panels[0].set_ylabel(f"CV of the spacing at $z$ = {float(found['length']):g} $D$")
    words = f"$d/D$ = {float(found['confinement']):g};  lines: linear theory, symbols: simulated "
    words += "(bars: sampling, 95 %)"
    if phi.size == 1:
        words = f"${symbol}$ = {100 * phi[0]:.3g} %,  {words}"
    if found["law_variation"].isel({"law_diameter_variation": -1}).isnull().all():
        words += f"\n{MISSING}, or trains are unstable"
    figure.suptitle(words, fontsize=STYLE["axes.titlesize"])
    _legend(figure, found, [(each, f"${symbol}$ = {100 * each:.3g} %") for each in phi], ordered)
    return Drawing(figure, found)


def _draw_condition(axes: Axes, own: xr.Dataset):
    look = fraction_look(float(own["given_fraction"]))
    per_cent = 100 * own["diameter_variation"].values
    for n in range(own.sizes["injection"]):
        entered = own.isel(injection=n)
        full = {} if n == 0 else {"mfc": "none"}
        axes.plot(
            100 * own["law_diameter_variation"],
            entered["law_variation"],
            color=look["color"],
            ls=STYLES[n],
            lw=1,
        )
        cv, half = (entered[f"spacing_variation{end}"].values for end in ("", "_halfwidth"))
        moved = axes.transData + ScaledTranslation(ASIDE[n], 0, axes.figure.dpi_scale_trans)
        drawn = {"ls": "", "lw": 0.8, "transform": moved} | look | full
        axes.errorbar(per_cent, cv, np.nan_to_num(half), **drawn)


def _finish(axes: Axes, found: xr.Dataset, deborah: float) -> Line2D:
    """Limits and words of a panel; the line up to which trains count as ordered."""
    if (own := float(found["study_variation"])) > 0:
        axes.axvline(100 * own, color=GREY, lw=0.6)
    axes.set_xlim(-0.2, None)
    axes.set_xlabel("CV of the diameters [%]")
    axes.set_title(f"De = {deborah:g}", loc="left")
    return draw_ordered(axes, float(found["ordered_variation"]))


def _legend(figure: Figure, found: xr.Dataset, fractions: list, ordered: Line2D):
    """Volume fractions, with their words, if there are several; injections and limits."""
    entries = [
        (Line2D([], [], **fraction_look(phi)), words) for phi, words in fractions if fractions[1:]
    ]
    for n, injection in enumerate(found["injection"].values):
        look = {"color": "black", "marker": "o", "ms": 4, "ls": STYLES[n], "lw": 1}
        look |= {} if n == 0 else {"mfc": "none"}
        entries.append((Line2D([], [], **look), f"injection: {INJECTIONS[str(injection)]}"))
    entries.append((ordered, str(ordered.get_label())))
    if float(found["study_variation"]) > 0:
        entries.append((Line2D([], [], color=GREY, lw=0.6), "beads of the study"))
    figure.legend(
        *zip(*entries, strict=True), loc="outside lower center", ncols=min(len(entries), 4)
    )
