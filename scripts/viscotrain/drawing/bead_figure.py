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
from numpy.typing import NDArray

from viscotrain.drawing.style import GREY, MARKERS, PAGE, STYLE, Drawing, fraction_colour, styled

STYLES = ("-", "--")  # by injection
LEAST_SCATTER = 0.5  # that the axis of CV reaches
MISSING = "the table does not say what diameters change"


@styled
def draw_diameter_variation(found: xr.Dataset) -> Drawing:
    """CV at the outlet, simulated and by the linear theory.

    Args:
        found: Result of `diameter_variation.simulate`.
    """
    deborah = np.unique(found["deborah"].values)
    phi = np.unique(found["given_fraction"].values)
    figure = Figure(figsize=(PAGE, 3.1), layout="constrained")
    panels = figure.subplots(1, deborah.size, sharey=True, squeeze=False)[0]
    for n in range(found.sizes["condition"]):
        own = found.isel(condition=n)
        kind = int(np.searchsorted(phi, float(own["given_fraction"])))
        axes = panels[int(np.searchsorted(deborah, float(own["deborah"])))]
        _draw_condition(axes, own, MARKERS[kind % len(MARKERS)])
    for axes, De in zip(panels, deborah, strict=True):
        _finish(axes, found, float(De))
    high = float(np.nanmax(found["spacing_variation"], initial=0.0))
    panels[0].set_ylim(0, 1.05 * max(high, LEAST_SCATTER))
    panels[0].set_ylabel(f"CV of the spacing at {float(found['length']):g} $D$")
    words = f"$d/D$ = {float(found['confinement']):g};  lines: linear theory, symbols: simulated"
    if found["law_variation"].isel({"law_diameter_variation": -1}).isnull().all():
        words += f"\n{MISSING}, or trains are unstable"
    figure.suptitle(words, fontsize=STYLE["axes.titlesize"])
    _legend(figure, found, phi)
    return Drawing(figure, found)


def _draw_condition(axes: Axes, own: xr.Dataset, marker: str):
    colour = fraction_colour(float(own["given_fraction"]))
    per_cent = 100 * own["diameter_variation"].values
    for n in range(own.sizes["injection"]):
        entered = own.isel(injection=n)
        full = {} if n == 0 else {"mfc": "none"}
        axes.plot(
            100 * own["law_diameter_variation"],
            entered["law_variation"],
            color=colour,
            ls=STYLES[n],
            lw=1,
        )
        cv, half = (entered[f"spacing_variation{end}"].values for end in ("", "_halfwidth"))
        axes.errorbar(
            per_cent,
            cv,
            np.nan_to_num(half),
            color=colour,
            marker=marker,
            ms=4,
            ls="",
            lw=0.8,
            **full,
        )


def _finish(axes: Axes, found: xr.Dataset, deborah: float):
    axes.axhline(float(found["ordered_variation"]), color=GREY, lw=0.8, ls=":")
    if (own := float(found["study_variation"])) > 0:
        axes.axvline(100 * own, color=GREY, lw=0.6)
    axes.set_xlim(-0.2, None)
    axes.set_xlabel("CV of the diameters [%]")
    axes.set_title(f"De = {deborah:g}", loc="left")


def _legend(figure: Figure, found: xr.Dataset, phi: NDArray):
    symbol = r"\phi" if found.attrs["given"] == "volume_fraction" else r"\phi_{feed}"
    entries = [
        (
            Line2D([], [], color=colour, marker=MARKERS[n % len(MARKERS)], ms=4),
            f"${symbol}$ = {100 * each:.3g} %",
        )
        for n, (each, colour) in enumerate(zip(phi, fraction_colour(phi), strict=True))
    ]
    for n, injection in enumerate(found["injection"].values):
        look = {"color": "black", "marker": "o", "ms": 4, "ls": STYLES[n], "lw": 1}
        look |= {} if n == 0 else {"mfc": "none"}
        entries.append((Line2D([], [], **look), f"{injection} injection"))
    entries.append((Line2D([], [], color=GREY, lw=0.8, ls=":"), "ordered below"))
    if float(found["study_variation"]) > 0:
        entries.append((Line2D([], [], color=GREY, lw=0.6), "beads of the study"))
    figure.legend(
        *zip(*entries, strict=True), loc="outside lower center", ncols=min(len(entries), 5)
    )
