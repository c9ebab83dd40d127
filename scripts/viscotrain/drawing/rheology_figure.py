"""Figure of the fluid: moduli, viscosity and first normal stress difference.

Lines are the fluid that is simulated, symbols what was measured, if the fluid is fitted. The flow
covers shear rates from 0 on the axis to that at the wall, which is a dotted line for each Deborah
number of the study (`wall`); what it covers at the largest one is shaded. The upper axis is the
Weissenberg number, lambda_1 times the shear rate.
"""

import contextlib
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from viscotrain import files
from viscotrain.drawing.style import (
    BLUE,
    GREY,
    PAGE,
    SMALL,
    VERMILLION,
    Drawing,
    deborah_colour,
    styled,
)
from viscotrain.errors import FluidError
from viscotrain.fluid.fit_problem import model
from viscotrain.fluid.measurements import COLUMNS
from viscotrain.fluid.parameters import DimensionlessFluid, Fluid
from viscotrain.fluid.wall import wall_shear_rate

POINTS = 201  # of a line
MARGIN = 2.0  # factor by which lines go beyond measured rates
MODE_MARGIN = 100.0  # factor by which they go beyond the modes' own rates where none were measured
NEWTONIAN_RATES = (1.0, 1e3)  # 1/s, of a fluid without modes
NUMBERS = ("", "one", "two", "three", "four", "five", "six")
LOOKS = {  # colour, line, symbol, label if a panel has several
    "storage_modulus": (BLUE, "-", "o", "storage modulus $G'$"),
    "loss_modulus": (VERMILLION, "--", "s", "loss modulus $G''$"),
    "viscosity": ("black", "-", "D", None),
    "first_normal_stress_difference": ("black", "-", "^", None),
}
PANELS = (  # quantities, and labels of the axes
    (("storage_modulus", "loss_modulus"), "angular frequency [rad/s]", "moduli [Pa]"),
    (("viscosity",), "shear rate [1/s]", r"viscosity, $\eta$ [Pa s]"),
    (
        ("first_normal_stress_difference",),
        "shear rate [1/s]",
        "first normal stress difference, $N_1$ [Pa]",
    ),
)

COVERED = "#EEEEEE"  # shear rates
OF_THE_FLOW = "covered by the flow", "at the wall"


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
        rates: Mean velocity over channel diameter in 1/s, by Deborah number; those at the wall
            follow.
    """
    if measured is None:
        measured = pd.DataFrame({"quantity": [], "abscissa": [], "measured": []})
    walls = _wall_rates(fluid, rates or {})
    data = _data(fluid, measured, walls)
    shown = [panel for panel in PANELS if set(panel[0]) & set(data["quantity"])]
    figure = Figure(figsize=(PAGE, 3.5), layout="constrained")
    figure.get_layout_engine().set(wspace=0.06)
    figure.suptitle(_heading(fluid), fontsize=SMALL)
    for axes, panel in zip(figure.subplots(1, len(shown)), shown, strict=True):
        quantities, x_label, y_label = panel
        axes.set(xscale="log", yscale="log", xlabel=x_label, ylabel=y_label)
        axes.tick_params(which="both", direction="in", top=True, right=True)
        for quantity, rows in data[data["quantity"].isin(quantities)].groupby(
            "quantity", sort=False
        ):
            _draw(axes, str(quantity), rows)
        axes.margins(x=0)
        _leave_room(axes)
        if x_label.startswith("shear") and fluid.modes:
            _mark_flow(axes, walls, fluid.longest_relaxation_time)
    _add_legend(figure, len(measured) > 0)
    return Drawing(figure, data)


def _add_legend(figure: Figure, with_symbols: bool):
    """One below all panels, where it hides no data; a line and its symbols are one entry."""
    entries: dict[str, list] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, []).append(handle)
    for label in OF_THE_FLOW:  # behind what is measured
        if label in entries:
            entries[label] = entries.pop(label)[:1]
    legend = figure.legend(
        [tuple(handles[:2]) for handles in entries.values()],
        list(entries),
        loc="outside lower center",
        ncols=len(entries),
        columnspacing=1.5,
    )
    if with_symbols:
        legend.set_title("lines: model; symbols: measured")


def _wall_rates(fluid: Fluid, rates: Mapping[float, float]) -> dict[float, float]:
    """Shear rates at the wall in 1/s by De of the study, without those whose flow is not unique."""
    scaled = DimensionlessFluid.from_physical(fluid.solvent_viscosity, fluid.modes)
    walls = {}
    for De, rate in rates.items():
        with contextlib.suppress(FluidError):
            walls[De] = rate * wall_shear_rate(scaled, fluid.longest_relaxation_time * rate)
    return walls


def _data(fluid: Fluid, measured: pd.DataFrame, walls: Mapping[float, float]) -> pd.DataFrame:
    """Rows of lines and symbols, and of the walls: De as the value."""
    parts, marked = [], list(walls.values())
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
    at_walls = {"quantity": "deborah", "unit": "1", "kind": "wall", "against": "shear_rate"}
    lines = {"abscissa_per_second": marked, "value": list(walls)}
    parts.append(pd.DataFrame(lines).assign(**at_walls))
    return pd.concat([part for part in parts if len(part)], ignore_index=True)


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
    axes.plot(curve["abscissa_per_second"], curve["value"], line, color=colour, label=label)
    if len(points):
        style = {"ls": "", "marker": symbol, "ms": 3.5, "mew": 0.7, "mfc": "white"}
        x, y = points["abscissa_per_second"], points["value"]
        axes.plot(x, y, color=colour, label=label, zorder=1.9, **style)


def _leave_room(axes: Axes):
    """Two decades at least, so that a flat line is seen as flat."""
    low, high = axes.get_ylim()
    middle = math.sqrt(low * high)
    axes.set_ylim(min(low, middle / 10), max(high, middle * 10))


def _mark_flow(axes: Axes, walls: Mapping[float, float], relaxation_time: float):
    """Shear rates that the flow covers, and the Weissenberg number on the upper axis."""
    for De, rate in walls.items():
        colour = deborah_colour(De)
        axes.axvline(rate, color=colour, lw=0.9, ls=":", zorder=0.5)
        place = {"xy": (rate, 0), "xycoords": ("data", "axes fraction")}
        offset = {"xytext": (-1, 4), "textcoords": "offset points"}
        turned = {"rotation": 90, "ha": "right", "va": "bottom", "fontsize": SMALL}
        axes.annotate(f"De = {De:g}", **place, **offset, **turned, color=colour)
    if walls:
        low, _ = axes.get_xlim()
        axes.axvspan(
            low,
            max(walls.values()),
            color=COVERED,
            lw=0,
            zorder=0.1,
            label=OF_THE_FLOW[0],
        )
        axes.plot([], [], color=GREY, lw=0.7, ls=":", label=OF_THE_FLOW[1])
    axes.tick_params(which="both", top=False)
    upper = axes.secondary_xaxis(
        "top", functions=(lambda x: x * relaxation_time, lambda x: x / relaxation_time)
    )
    upper.tick_params(which="both", direction="in")
    upper.set_xlabel(r"Weissenberg number, $\lambda_1\dot\gamma$")


def _model(fluid: Fluid) -> str:
    """The name of the constitutive law."""
    if not fluid.modes:
        return "Newtonian fluid"
    count = len(fluid.modes)
    number = NUMBERS[count] if count < len(NUMBERS) else f"{count}"
    law = "Giesekus" if any(mode.mobility > 0 for mode in fluid.modes) else "Oldroyd-B"
    return f"{number}-mode {law} fluid"


def _heading(fluid: Fluid) -> str:
    """The model and its parameters, three to a line."""
    words = [f"solvent $\\eta_s$ = {fluid.solvent_viscosity:.3g} Pa s"]
    for k, mode in enumerate(fluid.modes, start=1):
        words.append(
            rf"mode {k}: $\eta$ = {mode.viscosity:.3g} Pa s, $\lambda$ = "
            rf"{mode.relaxation_time:.3g} s, $\alpha$ = {mode.mobility:.3g}"
        )
    lines = [";   ".join(words[k : k + 3]) for k in range(0, len(words), 3)]
    return "\n".join([_model(fluid), *lines])
