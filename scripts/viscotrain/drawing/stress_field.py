"""The figure of the field: mesh and polymer stress around the spheres of one point."""

import math

import numpy as np
import xarray as xr
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from viscotrain.drawing.conventions import conditions
from viscotrain.drawing.style import GREY, PAGE, Drawing, styled
from viscotrain.words import NEGLIGIBLE

FIELD_MARGIN = 0.7  # of the drawn field beyond the outer spheres' centres, in D
DECADES = 3  # of a logarithmic colour map


@styled
def stress_field(field: xr.Dataset) -> Drawing:
    """Mesh (upper half) and polymer stress (lower half) around the spheres of one point."""
    data = _visible(_with_trace(field))
    centre = float(data["sphere_position"].sel(sphere="middle"))
    z, r = data["z"].values - centre, data["r"].values
    trace = data["stress_trace"].values
    view = _view(data["sphere_position"].values - centre, z)
    norm = _trace_norm(trace)
    figure = Figure(figsize=(PAGE, PAGE * 0.8 / (view[1] - view[0]) + 0.75), layout="compressed")
    axes = figure.add_subplot()
    shown = axes.tripcolor(
        z,
        -r,
        data["triangles"].values,
        np.maximum(trace, norm.vmin),
        norm=norm,
        cmap="viridis",
        shading="gouraud",
        rasterized=True,
    )
    lines = data["edges"].values
    axes.add_collection(
        LineCollection(np.stack([z[lines], r[lines]], axis=-1), colors=GREY, linewidths=0.4)
    )
    radius = float(data["confinement"]) / 2
    for position, name in zip(data["sphere_position"].values, data["sphere"].values, strict=True):
        where = (position - centre, 0)
        sphere = Circle(where, radius, facecolor="white", edgecolor="black", lw=0.8, zorder=3)
        axes.add_patch(sphere)
        axes.text(*where, str(name), ha="center", va="center", fontsize=6)
    for height, words in ((0.44, "mesh"), (-0.44, "polymer stress")):
        white = {"facecolor": "white", "edgecolor": "none", "pad": 1.5, "alpha": 0.9}
        axes.text(view[0] + 0.04, height, words, ha="left", va="center", bbox=white)
    axes.set(aspect="equal", xlim=view, ylim=(-0.5, 0.5))
    axes.set_xlabel("position along the channel from the middle sphere, $z$ [$D$]")
    axes.set_ylabel("radius, $r$ [$D$]")
    axes.yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    axes.set_title(_field_conditions(data), loc="left")
    axes.set_title(r"flow $\longrightarrow$", loc="right")
    extend = "min" if np.nanmin(trace) < norm.vmin else "neither"
    bar = figure.colorbar(shown, ax=axes, pad=0.01, aspect=25, extend=extend)
    bar.set_label(
        r"trace of the polymer stress,"
        "\n"
        r"$\tau_{zz} + \tau_{rr} + \tau_{\theta\theta}$ [$\eta_0 \bar{U}/D$]"
    )
    return Drawing(figure, data)


def _with_trace(field: xr.Dataset) -> xr.Dataset:
    trace = field["stress_zz"] + field["stress_rr"] + field["stress_tt"]
    trace.attrs = {
        "long_name": "trace of the polymer stress over zero-shear viscosity times mean velocity "
        "over channel diameter",
        "units": "1",
    }
    kept = ["z", "r", "triangles", "edges", "sphere_position"]
    kept += ["confinement", "length", "deborah", "sp", "sf"]
    data = field.assign(stress_trace=trace)[[*kept, "stress_trace"]]
    return data.sel(sphere=np.isfinite(field["sphere_position"].values))


def _view(spheres: NDArray, z: NDArray) -> tuple[float, float]:
    """The drawn piece of the axis, not longer than the box."""
    return max(spheres.min() - FIELD_MARGIN, z.min()), min(spheres.max() + FIELD_MARGIN, z.max())


def _visible(field: xr.Dataset) -> xr.Dataset:
    """The part of the field that is drawn, with its points numbered anew."""
    z = field["z"].values
    low, high = _view(field["sphere_position"].values, z)
    inside = (z >= low) & (z <= high)
    triangles, edges = field["triangles"].values, field["edges"].values
    triangles, edges = triangles[inside[triangles].any(1)], edges[inside[edges].any(1)]
    kept, renumbered = np.unique(
        np.concatenate([triangles.ravel(), edges.ravel()]), return_inverse=True
    )
    new_triangles = renumbered[: triangles.size].reshape(triangles.shape)
    new_edges = renumbered[triangles.size :].reshape(edges.shape)
    return (
        field.drop_vars(["triangles", "edges"])
        .isel(point=kept)
        .assign(
            triangles=(("triangle", "corner"), new_triangles, field["triangles"].attrs),
            edges=(("edge", "edge_point"), new_edges, field["edges"].attrs),
        )
    )


def _trace_norm(trace: NDArray) -> Normalize:
    """Logarithmic over the upper decades; linear where there is no stress to speak of."""
    largest = float(np.nanmax(trace, initial=0.0))
    if largest < NEGLIGIBLE:
        return Normalize(0.0, 1.0)
    smallest = float(np.nanmin(trace))
    return LogNorm(max(smallest, largest / 10**DECADES), largest, clip=False)


def _field_conditions(field: xr.Dataset) -> str:
    distances = [
        f"{symbol} = " + (f"{s:g} $d$" if math.isfinite(s) else "\N{INFINITY}")
        for symbol, s in (("$s_p$", float(field["sp"])), ("$s_f$", float(field["sf"])))
    ]
    words = conditions(float(field["deborah"]), float(field["confinement"]))
    return ",  ".join([words, *distances])
