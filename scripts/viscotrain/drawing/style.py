"""The style of all figures: fonts, widths, colours, and what a drawing is.

A Deborah number, a volume fraction and a diameter have one colour and one marker each, functions
of the value alone, so that they are the same in every figure of every study. Each quantity has a
family of colours: De viridis (0 is black), phi from yellow to brown, d/D from pink to purple,
positions along the channel greys. Markers change with every octave of De, every sixth of a decade
of phi and every 0.05 of d/D.

RdBu_r where signs count, Okabe and Ito for lines that are none of these.
Figures are made without pyplot, so that importing this room changes no backend or setting.
"""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

BLUE, VERMILLION, GREY, PALE_GREY = "#0072B2", "#D55E00", "#777777", "#CCCCCC"  # Okabe and Ito
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
    "hatch.color": GREY,
    "axes.unicode_minus": True,
    "pdf.fonttype": 42,  # text stays text
    "savefig.dpi": 200,
    "svg.hashsalt": "viscotrain",  # the same bytes each time
}
COLUMN, PAGE = 90 / 25.4, 180 / 25.4  # widths of figures in inches, as papers print them
SMALL = 7  # size of text in a figure, as that of ticks and legends
MARKERS = "osD^vP*X"
NO_ELASTICITY = "h"  # the marker of De = 0
MARKER_SIZE = 4  # points


class Family(NamedTuple):
    """Colours of a quantity: a piece of a colour map for values between two, on log axes."""

    name: str
    begin: float
    end: float
    low: float
    high: float

    def __call__(self, value: ArrayLike) -> NDArray:
        """Colours of positive values, those beyond the range as at its ends; shape (..., 4)."""
        of_range = np.log(np.asarray(value, dtype=float) / self.low)
        place = np.clip(of_range / np.log(self.high / self.low), 0, 1)
        colours = matplotlib.colormaps[self.name]
        return np.asarray(colours(self.begin + (self.end - self.begin) * place))


elastic_colour = Family("viridis", 0.05, 0.93, 0.4, 100.0)  # of De > 0
fraction_colour = Family("afmhot_r", 0.27, 0.85, 5e-4, 5e-2)  # of a volume fraction
confinement_colour = Family("RdPu", 0.33, 1.0, 0.09, 0.42)  # of d/D


class Drawing(NamedTuple):
    """A figure and the data it shows: a dataset is kept as netCDF, a data frame as CSV."""

    figure: Figure
    data: xr.Dataset | pd.DataFrame


def deborah_colour(deborah: ArrayLike) -> NDArray:
    """The colour of a Deborah number, the same in every figure; shape (..., 4)."""
    De = np.asarray(deborah, dtype=float)
    colours = elastic_colour(np.maximum(De, elastic_colour.low))
    return np.where(De[..., None] > 0, colours, (0.0, 0.0, 0.0, 1.0))


def station_colour(share: ArrayLike) -> NDArray:
    """The colour of a position z/L along the channel, 0 to 1; shape (..., 4)."""
    return np.asarray(matplotlib.colormaps["Greys"](0.3 + 0.6 * np.asarray(share, dtype=float)))


def deborah_look(deborah: float) -> dict[str, Any]:
    """Colour and marker of a Deborah number, as matplotlib's plot takes them."""
    marker = _marker(math.log2(deborah)) if deborah > 0 else NO_ELASTICITY
    return {"color": deborah_colour(deborah), "marker": marker, "ms": MARKER_SIZE}


def fraction_look(volume_fraction: float) -> dict[str, Any]:
    """Colour and marker of a volume fraction."""
    marker = _marker(6 * math.log10(volume_fraction / 1e-3))
    return {"color": fraction_colour(volume_fraction), "marker": marker, "ms": MARKER_SIZE}


def confinement_look(confinement: float) -> dict[str, Any]:
    """Colour and marker of a diameter d/D."""
    marker = _marker(confinement / 0.05)
    return {"color": confinement_colour(confinement), "marker": marker, "ms": MARKER_SIZE}


def _marker(place: float) -> str:
    """One of the markers, in turn."""
    return MARKERS[round(place) % len(MARKERS)]


def styled(function: Callable) -> Callable:
    """Run a function with the style of all figures, and leave the user's settings alone."""

    @functools.wraps(function)
    def with_style(*args, **kwargs):
        with matplotlib.rc_context():
            matplotlib.rcdefaults()
            matplotlib.rcParams.update(STYLE)
            return function(*args, **kwargs)

    return with_style
