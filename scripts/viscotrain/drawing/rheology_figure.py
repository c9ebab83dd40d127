"""Figure of the fluid: moduli against frequency and viscosity against shear rate.

Lines are the fluid that is simulated, symbols what was measured, if the fluid is fitted. Dotted
lines mark the mean velocity over the channel diameter, the shear rate of the flow, at the Deborah
numbers of the study, to which the viscosity is drawn in any case.
"""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from viscotrain import files
from viscotrain.drawing.style import BLUE, GREY, PAGE, SMALL, VERMILLION, Drawing, styled
from viscotrain.fluid.fit_problem import model
from viscotrain.fluid.measurements import COLUMNS
from viscotrain.fluid.parameters import Fluid

POINTS = 201  # of a line
MARGIN = 2.0  # factor by which lines go beyond measured rates
MODE_MARGIN = 100.0  # factor by which they go beyond the modes' own rates where none were measured
NEWTONIAN_RATES = (1.0, 1e3)  # 1/s, of a fluid without modes
LOOKS = {  # colour, line, symbol, label
    "storage_modulus": (BLUE, "-", "o", "storage modulus $G'$"),
    "loss_modulus": (VERMILLION, "--", "s", "loss modulus $G''$"),
    "viscosity": ("black", "-", "D", r"viscosity $\eta$"),
}
PANELS = {
    "small oscillation": ("angular frequency [rad/s]", "moduli [Pa]"),
    "steady shear": ("shear rate [1/s]", "viscosity [Pa s]"),
}


def measured(fit: str | Path) -> pd.DataFrame:
    """What a fluid was fitted to, from the netCDF file of its fit."""
    numbers = files.read_dataset(fit)[["quantity", "abscissa", "measured"]]
    return numbers.drop_vars(
        ["parameter", "other_parameter", "modes"], errors="ignore"
    ).to_dataframe()


@styled
def rheology(
    fluid: Fluid,
    measured: pd.DataFrame | None = None,
    rates: Mapping[float, float] | None = None,
) -> Drawing:
    """Figure and its data.

    Args:
        fluid: In physical units.
        measured: Columns quantity, abscissa (1/s) and measured, as from `measurements.read`; None
            for a fluid that was not measured.
        rates: Mean velocity over channel diameter in 1/s, by Deborah number.
    """
    if measured is None:
        measured = pd.DataFrame({"quantity": [], "abscissa": [], "measured": []})
    rates = rates or {}
    data = _data(fluid, measured, list(rates.values()))
    figure = Figure(figsize=(PAGE, 3.2), layout="constrained")
    figure.get_layout_engine().set(wspace=0.06)
    figure.suptitle(_heading(fluid), fontsize=SMALL)
    panels = dict(zip(PANELS, figure.subplots(1, 2), strict=True))
    for title, axes in panels.items():
        x_label, y_label = PANELS[title]
        axes.set(xscale="log", yscale="log", xlabel=x_label, ylabel=y_label)
        axes.set_title(title, loc="left")
        axes.tick_params(which="both", direction="in", top=True, right=True)
    for quantity, rows in data.groupby("quantity", sort=False):
        oscillation = COLUMNS[quantity].abscissa == "angular_frequency"
        _draw(panels["small oscillation" if oscillation else "steady shear"], quantity, rows)
    for axes in panels.values():
        axes.margins(x=0)
        _leave_room(axes)
    _mark_rates(panels["steady shear"], rates)
    panels["small oscillation"].legend(loc="lower right")  # moduli rise, viscosities fall
    # On white: dotted lines pass behind it.
    cover = {"frameon": True, "facecolor": "white", "edgecolor": "none", "framealpha": 1.0}
    panels["steady shear"].legend(loc="upper right", **cover)
    return Drawing(figure, data)


def _data(fluid: Fluid, measured: pd.DataFrame, marked: list[float]) -> pd.DataFrame:
    parts = []
    for quantity in LOOKS:
        column = COLUMNS[quantity]
        of_flow = marked if column.abscissa == "shear_rate" else []
        x = _rates(fluid, measured, column.abscissa, of_flow)
        y = model(quantity, x, fluid)
        if np.any(y > 0):  # a logarithmic axis has no place for the storage modulus of a solvent
            parts.append(_rows(quantity, "model", x, y))
        own = measured[measured["quantity"] == quantity]
        if len(own):
            parts.append(_rows(quantity, "measured", own["abscissa"], own["measured"]))
    return pd.concat(parts, ignore_index=True)


def _rows(quantity: str, kind: str, x, y) -> pd.DataFrame:
    column = COLUMNS[quantity]
    return pd.DataFrame(
        {
            "quantity": quantity,
            "unit": column.unit,
            "kind": kind,
            "against": column.abscissa,
            "abscissa_per_second": np.asarray(x, dtype=float),
            "value": np.asarray(y, dtype=float),
        }
    )


def _rates(
    fluid: Fluid, measured: pd.DataFrame, abscissa: str | None, marked: list[float]
) -> NDArray:
    """Rates of a line in 1/s: those measured, else those where modes act, and the marked ones."""
    of_this = [name for name, column in COLUMNS.items() if column.abscissa == abscissa]
    own = measured.loc[measured["quantity"].isin(of_this), "abscissa"]
    if len(own):
        ends = [own.min() / MARGIN, own.max() * MARGIN]
    elif fluid.modes:
        times = [mode.relaxation_time for mode in fluid.modes]
        ends = [1 / (MODE_MARGIN * max(times)), MODE_MARGIN / min(times)]
    else:
        ends = list(NEWTONIAN_RATES)
    ends += [rate * factor for rate in marked for factor in (1 / MARGIN, MARGIN)]
    return np.geomspace(min(ends), max(ends), POINTS)


def _draw(axes: Axes, quantity: str, rows: pd.DataFrame):
    colour, line, symbol, label = LOOKS[quantity]
    curve, points = (rows[rows["kind"] == kind] for kind in ("model", "measured"))
    name = f"{label}, model" if len(points) else label
    axes.plot(curve["abscissa_per_second"], curve["value"], line, color=colour, label=name)
    if len(points):
        style = {"ls": "", "marker": symbol, "ms": 3.5, "mew": 0.7, "mfc": "white"}
        x, y = points["abscissa_per_second"], points["value"]
        axes.plot(x, y, color=colour, label="measured", zorder=1.9, **style)


def _leave_room(axes: Axes):
    """Two decades at least, so that a flat line is seen as flat."""
    low, high = axes.get_ylim()
    middle = math.sqrt(low * high)
    axes.set_ylim(min(low, middle / 10), max(high, middle * 10))


def _mark_rates(axes: Axes, rates: Mapping[float, float]):
    for De, rate in rates.items():
        axes.axvline(rate, color=GREY, lw=0.7, ls=":", zorder=0.5)
        place = {"xy": (rate, 0), "xycoords": ("data", "axes fraction")}
        offset = {"xytext": (-1, 3), "textcoords": "offset points"}
        turned = {"rotation": 90, "ha": "right", "va": "bottom", "fontsize": SMALL, "color": GREY}
        axes.annotate(f"De = {De:g}", **place, **offset, **turned)
    if rates:
        axes.plot([], [], color=GREY, lw=0.7, ls=":", label=r"$\bar{U}/D$ of the study")


def _heading(fluid: Fluid) -> str:
    words = [rf"solvent $\eta_s$ = {fluid.solvent_viscosity:.3g} Pa s"]
    for k, mode in enumerate(fluid.modes, start=1):
        words.append(
            rf"mode {k}: $\eta$ = {mode.viscosity:.3g} Pa s, $\lambda$ = "
            rf"{mode.relaxation_time:.3g} s, $\alpha$ = {mode.mobility:.3g}"
        )
    lines = [";   ".join(words[k : k + 3]) for k in range(0, len(words), 3)]
    return "\n".join(lines)
