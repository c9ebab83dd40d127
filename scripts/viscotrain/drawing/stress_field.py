r"""The figure of the field: what the spheres of one triplet do to the stress of the polymer.

Drawn is the trace of the polymer stress less that of the flow without spheres, which is largest at
the wall and moves nothing, with the streamlines in the frame of the middle sphere: contours of

    psi(r, z) = int_0^r (u_z - U_2) r' dr'.

There the wall moves backwards, and so does the fluid but for a core, a little faster than spheres,
which turns back at them: the line between both ends at the outer spheres. All is symmetric about
the axis; drawn is the side with the wall. At De = 0 the trace is zero, as of any Newtonian stress.
"""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import SymLogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Circle
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from viscotrain.drawing.conventions import SIGNED
from viscotrain.drawing.style import PAGE, SMALL, Drawing, styled
from viscotrain.fluid.parameters import CHANNEL_RADIUS
from viscotrain.words import NEGLIGIBLE

FIELD_MARGIN = 0.8  # of the drawn field beyond the outer spheres' centres, in D
CLIPPED = 0.01  # share of the field that may be beyond the colours: thin layers at the spheres
LINEAR = 0.2  # of the colours, over their end, beyond which they are logarithmic
STREAMLINES = 14
HEADS = 0.08, 0.92  # where streamlines have heads of arrows, over the length of the drawn field
MINUS = "\N{MINUS SIGN}"
BESIDE = 0.8  # width of a panel over that of the figure
BELOW_AXIS = 0.8  # drawn there, in d: all of the spheres
ROUND_IT = 0.3, 0.8  # height of title and axes in inches: of each panel, of all
NUMBERS = {"trailing": "1", "middle": "2", "leading": "3"}  # as in the equations


@styled
def stress_field(field: xr.Dataset) -> Drawing:
    """Change of the polymer stress around one triplet, a panel for each Deborah number."""
    data = _shown(field)
    z = data["z"].values
    empty = ~data["stress_change"].fillna(0.0).any(["r", "z"]).values
    low = -BELOW_AXIS * float(data["confinement"])
    high = np.where(empty, CHANNEL_RADIUS / 2, CHANNEL_RADIUS)
    heights = (high - low) * BESIDE * PAGE / (z[-1] - z[0])  # to scale
    height = heights.sum() + ROUND_IT[0] * len(heights) + ROUND_IT[1]
    figure = Figure(figsize=(PAGE, height), layout="compressed")
    shape = {"sharex": True, "squeeze": False, "height_ratios": heights}
    panels = figure.subplots(len(heights), 1, **shape)[:, 0]
    norm = _norm(data["stress_change"].values)
    for axes, own, top in zip(panels, _layers(data), high, strict=True):
        shown = _draw_change(axes, own, norm)
        _draw_streamlines(axes, own)
        _draw_spheres(axes, own)
        axes.set(aspect="equal", xlim=(z[0], z[-1]), ylim=(low, top), ylabel="$r$ [$D$]")
        axes.yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
        axes.set_title(f"De = {float(own['deborah']):g}", loc="left")
        if top == CHANNEL_RADIUS:
            axes.spines["top"].set_linewidth(2)  # the wall
        else:
            place = {"ha": "right", "fontsize": SMALL, "transform": axes.transAxes}
            axes.text(0.99, 0.06, "empty: the trace of a Newtonian stress is zero", **place)
    panels[0].set_title(_conditions(data))
    panels[0].set_title(r"flow $\longrightarrow$", loc="right")
    position = "position along the channel from the middle sphere, $z$ [$D$]"
    panels[-1].set_xlabel(f"{position}\n{_words(data)}")
    _draw_bar(figure, shown, panels)
    return Drawing(figure, data)


def _layers(data: xr.Dataset) -> list[xr.Dataset]:
    """The field at each Deborah number."""
    return [data.isel(deborah=n) for n in range(data.sizes["deborah"])]


def _words(data: xr.Dataset) -> str:
    """What is seen besides the colours."""
    names = ", ".join(f"{NUMBERS[str(name)]} {name}" for name in data["sphere"].values)
    return (
        f"spheres: {names};  thick line: wall\nthin lines: streamlines as seen from sphere 2, "
        "from where the fluid near the wall moves to the left;\n"
        "the line that ends at the outer spheres divides it from a core that turns back"
    )


def _draw_bar(figure: Figure, shown: AxesImage, panels: NDArray):
    """The colour bar, in round numbers."""
    bar = figure.colorbar(shown, ax=list(panels), pad=0.01, aspect=50, extend="both")
    end, linear = shown.norm.vmax, LINEAR * shown.norm.vmax
    ticks = [-end, -linear, 0, linear, end]
    bar.set_ticks(ticks, labels=[f"{tick:g}".replace("-", MINUS) for tick in ticks])
    bar.minorticks_off()
    bar.set_label(
        r"change of the polymer stress, $\Delta\,\mathrm{tr}\,\tau$ [$\eta_0 \bar{U}/D$]"
        "\n(more than without spheres: red; colours are not linear)"
    )


def _shown(field: xr.Dataset) -> xr.Dataset:
    """The drawn part of the field: change of the stress, streamfunction and spheres."""
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
    position = field["sphere_position"]
    data["sphere_position"] = (position - centre).assign_attrs(position.attrs)
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
    """Centred at zero; logarithmic, since strands are thin and strong, and wakes wide and weak.

    Where most of the field is below the end, which is a round number: a layer at a sphere may have
    a stress that is many times as large.
    """
    known = np.abs(change[np.isfinite(change) & (change != 0)])
    end = float(np.quantile(known, 1 - CLIPPED)) if known.size else 0.0
    end = max(float(f"{end:.0e}"), NEGLIGIBLE)
    return SymLogNorm(LINEAR * end, vmin=-end, vmax=end)


def _draw_change(axes: Axes, own: xr.Dataset, norm: SymLogNorm) -> AxesImage:
    """The change of the stress, on both sides of the axis."""
    z, r, change = own["z"].values, own["r"].values, own["stress_change"].values
    both = np.nan_to_num(np.concatenate([change[:0:-1], change]))
    beside = (z[1] - z[0]) / 2, (r[1] - r[0]) / 2  # a value is in the middle of its pixel
    ends = z[0] - beside[0], z[-1] + beside[0], -r[-1] - beside[1], r[-1] + beside[1]
    style = {"norm": norm, "cmap": SIGNED, "origin": "lower", "interpolation": "bilinear"}
    return axes.imshow(both, extent=ends, **style)


def _draw_streamlines(axes: Axes, own: xr.Dataset):
    """As many towards the wall as psi has values, evenly in its root."""
    z, r = own["z"].values, own["r"].values
    spheres, radius = own["sphere_position"].values, float(own["confinement"]) / 2
    between = (z > spheres.min()) & (z < spheres.max()) & (r[:, None] < radius)
    whole = own["streamfunction"].values
    psi = np.ma.masked_where(between, whole)  # eddies between spheres are too small to be seen
    share = np.linspace(-1, 1, 2 * STREAMLINES + 1)
    levels = np.unique(np.sign(share) * share**2 * np.abs(whole).max())
    style = {"colors": "black", "linewidths": 0.4, "linestyles": "solid", "alpha": 0.7}
    axes.contour(z, r, psi, levels=levels, **style)
    _draw_heads(axes, own, levels)


def _draw_heads(axes: Axes, own: xr.Dataset, levels: NDArray):
    """Heads of arrows at both ends of streamlines, where they are along the channel."""
    z, r = own["z"].values, own["r"].values
    for share in HEADS:
        n = round(share * (z.size - 1))
        psi = own["streamfunction"].values[:, n]
        for k in range(1, r.size):
            change = psi[k] - psi[k - 1]
            head = ">" if change > 0 else "<"  # r (u - U_2) is the slope of psi
            for level in levels[(levels - psi[k - 1]) * (levels - psi[k]) < 0]:
                at = r[k - 1] + (level - psi[k - 1]) / change * (r[k] - r[k - 1])
                axes.plot(z[n], at, head, color="black", ms=2.5, mew=0, alpha=0.8)


def _draw_spheres(axes: Axes, own: xr.Dataset):
    radius = float(own["confinement"]) / 2
    for position, name in zip(own["sphere_position"].values, own["sphere"].values, strict=True):
        sphere = Circle((position, 0), radius, facecolor="white", edgecolor="black", lw=0.8)
        axes.add_patch(sphere).set_zorder(3)
        middle = {"ha": "center", "va": "center", "fontsize": SMALL, "zorder": 4}
        axes.text(position, 0, NUMBERS[str(name)], **middle)


def _conditions(data: xr.Dataset) -> str:
    distances = [
        f"{symbol} = " + (f"{s:g} $d$" if math.isfinite(s) else "\N{INFINITY}")
        for symbol, s in (("$s_p$", float(data["sp"])), ("$s_f$", float(data["sf"])))
    ]
    return ",  ".join([f"$d/D$ = {float(data['confinement']):g}", *distances])
