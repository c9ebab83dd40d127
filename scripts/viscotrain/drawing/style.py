"""The style of all figures: fonts, widths, colours, and what a drawing is.

Colours are safe for the colour-blind: a Deborah number has the same one of viridis and a volume
fraction the same one of plasma in every figure; RdBu_r where signs count, Okabe and Ito for lines.
Figures are made without pyplot, so that importing this room changes no backend or setting.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

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
    "svg.hashsalt": "viscotrain",  # the same bytes each time
}
COLUMN, PAGE = 90 / 25.4, 180 / 25.4  # widths of figures in inches, as papers print them
SMALL = 7  # size of text in a figure, as that of ticks and legends
BLUE, VERMILLION, GREY, PALE_GREY = "#0072B2", "#D55E00", "#777777", "#CCCCCC"  # Okabe and Ito
MARKERS = "osD^vP*X"
DARKEST_TO_BRIGHTEST_DEBORAH = 100.0  # from 0; larger ones have the colour of this one
FRACTIONS = 1e-3, 5e-2  # volume fractions of the first and of the last colour


class Drawing(NamedTuple):
    """A figure and the data it shows: a dataset is kept as netCDF, a data frame as CSV."""

    figure: Figure
    data: xr.Dataset | pd.DataFrame


def colours_of(count: int) -> NDArray:
    """A colour for each of so many things that are neither; shape (count, 4)."""
    return matplotlib.colormaps["viridis"](np.linspace(0, 0.85, count))


def deborah_colour(deborah: ArrayLike) -> NDArray:
    """The colour of a Deborah number, the same in every figure; shape (..., 4)."""
    place = np.log1p(np.asarray(deborah, dtype=float)) / np.log1p(DARKEST_TO_BRIGHTEST_DEBORAH)
    return np.asarray(matplotlib.colormaps["viridis"](np.clip(place, 0, 1) * 0.9))


def fraction_colour(volume_fraction: ArrayLike) -> NDArray:
    """The colour of a volume fraction, the same in every figure; shape (..., 4)."""
    low, high = np.log(FRACTIONS)
    place = (np.log(np.asarray(volume_fraction, dtype=float)) - low) / (high - low)
    return np.asarray(matplotlib.colormaps["plasma"](np.clip(place, 0, 1) * 0.9))


def styled(function: Callable) -> Callable:
    """Run a function with the style of all figures, and leave the user's settings alone."""

    @functools.wraps(function)
    def with_style(*args, **kwargs):
        with matplotlib.rc_context():
            matplotlib.rcdefaults()
            matplotlib.rcParams.update(STYLE)
            return function(*args, **kwargs)

    return with_style
