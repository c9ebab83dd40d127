"""The style of all figures: fonts, widths, colours, and what a drawing is.

Colours are safe for the colour-blind: viridis, RdBu_r where signs count, those of Okabe and Ito for
lines. Figures are made without pyplot, so that importing this room changes no backend or setting.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import matplotlib
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

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
MARKERS = "osD^vP*X"


class Drawing(NamedTuple):
    """A figure and the data it shows: a dataset is kept as netCDF, a data frame as CSV."""

    figure: Figure
    data: xr.Dataset | pd.DataFrame


def colours_of(count: int) -> NDArray:
    """A colour for each of so many Deborah numbers or volume fractions, shape (count, 4)."""
    return matplotlib.colormaps["viridis"](np.linspace(0, 0.85, count))


def styled(function: Callable) -> Callable:
    """Run a function with the style of all figures, and leave the user's settings alone."""

    @functools.wraps(function)
    def with_style(*args, **kwargs):
        with matplotlib.rc_context():
            matplotlib.rcdefaults()
            matplotlib.rcParams.update(STYLE)
            return function(*args, **kwargs)

    return with_style
