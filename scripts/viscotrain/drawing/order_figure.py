r"""Figure of the ordering length: where trains order, and what random injection makes of it.

Left: l against the volume fraction phi of an equally spaced train, (2/3) beta^2/s in a tube, with
the length of the channel. Right: CV at the outlet over CV at the inlet, by the linear theory and
simulated.
"""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from viscotrain.drawing.conventions import CHANNEL
from viscotrain.drawing.style import GREY, PAGE, Drawing, deborah_look, styled
from viscotrain.fluid.units import CENTIMETRES
from viscotrain.trains.order import remaining_variation

SHORTEST, LONGEST = 0.5, 30.0  # drawn, over the shortest length and the channel's
EVEN = 1e-6  # CV of spheres that enter evenly, to which nothing is compared
MOST_SCATTER = 1.5  # drawn, over that at the inlet
BAR = 0.025  # between bars that mark unstable trains, over the height of the axes
TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10)  # %


@styled
def draw_order(
    found: xr.Dataset, length: float, units: xr.Dataset, simulated: xr.Dataset | None = None
) -> Drawing:
    """Ordering length and remaining scatter against the volume fraction.

    Args:
        found: Of `order.orders`.
        length: Of the channel, in D.
        units: Physical units of the study.
        simulated: Design map; None for a figure of the theory alone.
    """
    data = _data(found, length, simulated)
    figure = Figure(figsize=(PAGE, 3.3), layout="constrained")
    figure.get_layout_engine().set(wspace=0.06)
    left, right = figure.subplots(1, 2)
    deborah = [De for De in found["deborah"].values if De > 0]
    for n, De in enumerate(deborah):
        _draw_one(left, right, data.sel(deborah=De), n)
    _finish_left(left, data, length, float(units["channel_diameter"]))
    right.set(ylim=(0, MOST_SCATTER), ylabel=f"CV at {length:g} $D$ over CV at the inlet")
    right.axhline(1, color=GREY, lw=0.6)
    right.set_title("small scatter (lines), random injection (symbols)", loc="left")
    for axes in (left, right):
        axes.set(xscale="log", xlabel=r"volume fraction, $\phi$ [%]")
        low, high = axes.get_xlim()
        axes.set_xticks([tick for tick in TICKS if low < tick < high])
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, columnspacing=1.5)
    return Drawing(figure, data)


def _draw_one(left: Axes, right: Axes, own: xr.Dataset, n: int):
    """Curves and symbols of one Deborah number, the n-th."""
    phi, De = 100 * own["volume_fraction"], float(own["deborah"])
    look = deborah_look(De)
    colour = look["color"]
    stable = own["stability"] >= 0
    left.plot(phi, own["ordering_length"].where(stable), color=colour, label=f"De = {De:g}")
    bar = {"transform": left.get_xaxis_transform(), "solid_capstyle": "butt"}
    left.plot(phi, (0 * phi + 0.98 - BAR * n).where(~stable), color=colour, lw=4, **bar)
    right.plot(phi, own["remaining_variation"].where(stable), color=colour)
    right.plot(phi, own["remaining_variation"].where(~stable), color=colour, ls=":", lw=0.8)
    if "simulated_volume_fraction" not in own:
        return
    style = look | {"ls": ""}
    at, known = 100 * own["simulated_volume_fraction"], own["simulated_variation"].notnull()
    right.plot(at[known], own["simulated_variation"][known], **style)
    length = own["ordering_length"].where(stable)[::-1]
    lengths = np.interp(np.log(at), np.log(phi[::-1]), length, left=np.nan, right=np.nan)
    left.plot(at[known], lengths[known], **style | {"mfc": "none"})


def _finish_left(axes: Axes, data: xr.Dataset, length: float, diameter: float):
    """Axes of the ordering length, in D and in cm, with the length of the channel."""
    lengths = data["ordering_length"].where(data["deborah"] > 0)
    finite = lengths.values[np.isfinite(lengths)]
    low = min(finite.min(initial=length), length)
    axes.set(yscale="log", ylim=(SHORTEST * low, LONGEST * length))
    axes.axhline(length, **CHANNEL, label=f"channel, {length:g} $D$")
    axes.set_ylabel("ordering length, $l$ [$D$]")
    centimetres = diameter * CENTIMETRES
    other = axes.secondary_yaxis(
        "right", functions=(lambda D: D * centimetres, lambda cm: cm / centimetres)
    )
    other.set_ylabel("[cm]", labelpad=0)
    for axis in (axes.yaxis, other.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_title("length that orders a train; bars at the top: unstable", loc="left")


def _data(found: xr.Dataset, length: float, simulated: xr.Dataset | None) -> xr.Dataset:
    """What is drawn."""
    kept = found[["ordering_length", "stability", "velocity", "confinement"]]
    kept["remaining_variation"] = (
        ("deborah", "spacing"),
        remaining_variation(found["growth_rate"].values, found["velocity"].values, length),
        {"long_name": f"CV at the outlet, {length:g} D, over CV at the inlet", "units": "1"},
    )
    if simulated is None:
        return kept
    variation = simulated["spacing_variation"]
    entered = variation.isel(station=0)
    ratio = variation.isel(station=-1) / entered.where(entered > EVEN)
    phi = simulated["volume_fraction"].broadcast_like(ratio).transpose(*ratio.dims)
    dims = {"deborah": simulated["deborah"].values}
    shown = xr.Dataset(
        {
            "simulated_variation": (
                ("deborah", "condition"),
                ratio.values,
                {"long_name": "the same of simulated trains", "units": "1"},
            ),
            "simulated_volume_fraction": (
                ("deborah", "condition"),
                phi.values,
                {"long_name": "their volume fraction in the channel", "units": "1"},
            ),
        },
        coords=dims,
    )
    return kept.merge(shown.reindex(deborah=found["deborah"].values))
