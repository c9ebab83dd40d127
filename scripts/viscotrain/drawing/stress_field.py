r"""The figure of the field: what the spheres of one triplet do to the stress of the polymer.

Drawn is the trace of the polymer stress less that of the flow without spheres, which is largest at
the wall and moves nothing, with the streamlines in the frame of the middle sphere: contours of

    psi(r, z) = int_0^r (u_z - U_2) r' dr'.
"""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import SymLogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from viscotrain.drawing.conventions import SIGNED
from viscotrain.drawing.style import GREY, PAGE, SMALL, Drawing, styled
from viscotrain.words import NEGLIGIBLE

FIELD_MARGIN = 0.8  # of the drawn field beyond the outer spheres' centres, in D
LINEAR, LARGEST = 0.02, 0.5  # of the colours, over the largest stress: linear below, full above
STREAMLINES = 14
BESIDE = 0.8  # width of a panel over that of the figure
FARTHEST = 1.5  # drawn radius, in d, or up to the wall
ROUND_IT = 0.32, 0.6  # height of title and axes in inches: of each panel, of all


@styled
def stress_field(field: xr.Dataset) -> Drawing:
    """Change of the polymer stress around one triplet, a panel for each Deborah number."""
    data = _shown(field)
    z = data["z"].values
    view, edge = (z[0], z[-1]), min(FARTHEST * float(data["confinement"]), 0.5)
    panel = 2 * edge * BESIDE * PAGE / (view[1] - view[0]) + ROUND_IT[0]
    height = panel * data.sizes["deborah"] + ROUND_IT[1]
    figure = Figure(figsize=(PAGE, height), layout="compressed")
    panels = figure.subplots(data.sizes["deborah"], 1, sharex=True, squeeze=False)[:, 0]
    norm = _norm(data["stress_change"].values)
    for axes, De in zip(panels, data["deborah"].values, strict=True):
        own = data.sel(deborah=De)
        shown = _draw_change(axes, own, norm)
        _draw_streamlines(axes, own)
        _draw_spheres(axes, own)
        axes.set(aspect="equal", xlim=view, ylim=(-edge, edge), ylabel="$r$ [$D$]")
        axes.yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
        axes.set_title(f"De = {De:g}", loc="left")
    _draw_mesh(panels[-1], data)
    panels[0].set_title(_conditions(data))
    panels[0].set_title(r"flow $\longrightarrow$", loc="right")
    panels[-1].set_xlabel("position along the channel from the middle sphere, $z$ [$D$]")
    bar = figure.colorbar(shown, ax=list(panels), pad=0.01, aspect=50, extend="both")
    bar.set_label(
        r"change of the polymer stress, $\Delta\,\mathrm{tr}\,\tau$ [$\eta_0 \bar{U}/D$]"
        "\n(more than without spheres: red)"
    )
    return Drawing(figure, data)


def _shown(field: xr.Dataset) -> xr.Dataset:
    """The drawn part of the field: change of the stress, streamfunction, mesh and spheres."""
    field = field.isel(sphere=np.isfinite(field["sphere_position"].values))
    centre = float(field["sphere_position"].sel(sphere="middle"))
    data = field[["confinement", "sp", "sf", "sphere_velocity"]]
    trace = field["stress_zz"] + field["stress_rr"] + field["stress_tt"]
    change = trace - field["undisturbed_stress_zz"] - field["undisturbed_stress_rr"]
    data["stress_change"] = change.transpose("deborah", "r", "z")
    data["stress_change"].attrs = {
        "long_name": "trace of the polymer stress less that of the flow without spheres, over "
        "zero-shear viscosity times mean velocity over channel diameter",
        "units": "1",
    }
    data["streamfunction"] = _streamfunction(field)
    for name in ("sphere_position", "edge_z"):
        data[name] = (field[name] - centre).assign_attrs(field[name].attrs)
    data["edge_r"] = field["edge_r"]
    data = data.assign_coords(z=(field["z"] - centre).assign_attrs(field["z"].attrs))
    low, high = data["sphere_position"].values[[0, -1]] + FIELD_MARGIN * np.array([-1, 1])
    return data.sel(z=slice(low, high))


def _streamfunction(field: xr.Dataset) -> xr.DataArray:
    """Psi in Ubar D^2, (deborah, r, z); within the spheres the flow is taken to move with them."""
    U = field["sphere_velocity"].sel(sphere="middle", drop=True)
    flux = ((field["velocity_z"] - U).fillna(0.0) * field["r"]).transpose("deborah", "z", "r")
    psi = cumulative_trapezoid(flux.values, field["r"].values, initial=0.0, axis=-1)
    words = {
        "long_name": "streamfunction in the frame of the middle sphere, over mean velocity times "
        "squared channel diameter",
        "units": "1",
    }
    return flux.copy(data=psi).transpose("deborah", "r", "z").assign_attrs(words)


def _norm(change: NDArray) -> SymLogNorm:
    """Centred at zero; logarithmic, since strands are thin and strong, and wakes wide and weak."""
    largest = max(float(np.nanmax(np.abs(change), initial=0.0)), NEGLIGIBLE)
    end = LARGEST * largest
    return SymLogNorm(LINEAR * largest, vmin=-end, vmax=end)


def _draw_change(axes: Axes, own: xr.Dataset, norm: SymLogNorm):
    """The change of the stress, in both halves of the channel."""
    r, change = own["r"].values, own["stress_change"].values
    both = np.concatenate([-r[:0:-1], r]), np.concatenate([change[:0:-1], change])
    style = {"norm": norm, "cmap": SIGNED, "shading": "gouraud", "rasterized": True}
    return axes.pcolormesh(own["z"].values, both[0], np.nan_to_num(both[1]), **style)


def _draw_streamlines(axes: Axes, own: xr.Dataset):
    """In the upper half: as many towards the wall as psi has values, evenly in its root."""
    psi = own["streamfunction"].values
    share = np.linspace(-1, 1, 2 * STREAMLINES + 1)
    levels = np.unique(np.sign(share) * share**2 * np.abs(psi).max())
    style = {"colors": "black", "linewidths": 0.4, "linestyles": "solid", "alpha": 0.7}
    axes.contour(own["z"].values, own["r"].values, psi, levels=levels, **style)


def _draw_spheres(axes: Axes, own: xr.Dataset):
    radius = float(own["confinement"]) / 2
    for position, name in zip(own["sphere_position"].values, own["sphere"].values, strict=True):
        sphere = Circle((position, 0), radius, facecolor="white", edgecolor="black", lw=0.8)
        axes.add_patch(sphere).set_zorder(3)
        middle = {"ha": "center", "va": "center", "fontsize": SMALL, "zorder": 4}
        axes.text(position, 0, NUMBERS[str(name)], **middle)


def _draw_mesh(axes: Axes, data: xr.Dataset):
    lines = np.stack([data["edge_z"].values, -data["edge_r"].values], axis=-1)
    axes.add_collection(LineCollection(lines, colors=GREY, linewidths=0.25))


def _conditions(data: xr.Dataset) -> str:
    distances = [
        f"{symbol} = " + (f"{s:g} $d$" if math.isfinite(s) else "\N{INFINITY}")
        for symbol, s in (("$s_p$", float(data["sp"])), ("$s_f$", float(data["sf"])))
    ]
    return ",  ".join([f"$d/D$ = {float(data['confinement']):g}", *distances])


NUMBERS = {"trailing": "1", "middle": "2", "leading": "3"}  # as in the equations
