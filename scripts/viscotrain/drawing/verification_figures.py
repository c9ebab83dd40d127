"""Figures of the verification, and the statement of accuracy that follows from its numbers."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from viscotrain.drawing.style import (
    BLUE,
    GREY,
    MARKERS,
    PAGE,
    STYLE,
    VERMILLION,
    Drawing,
    colours_of,
    deborah_colour,
    styled,
)
from viscotrain.studies.accuracy import (
    CLOSURE_WORDS,
    NOISE,
    largest_differences,
    observed_orders,
    remaining_differences,
    with_errors,
)
from viscotrain.studies.findings import Findings
from viscotrain.words import PAIRS

COLUMNS = 3
PAIR_COLOURS = (BLUE, VERMILLION)
PERMILLE = 1e3
MODELS: dict[str, dict[str, Any]] = {  # by their closure; the study's own one last
    "every_sphere": {"color": "black", "ls": "--", "lw": 1.1},
    "nearest": {"color": VERMILLION, "ls": ":", "lw": 1.1},
}
LABELS = {
    "mesh": ("sizes at the start over the default ones (accuracy: its cube)", "order"),
    "order": ("polynomial order of the velocity", "factor per order"),
    "box": ("distance to the periodic ends [$D$]", "factor per $D$"),
    "time_step": (r"time step [$\lambda_1$]", "order"),
}


def all_of(found: Findings) -> Iterator[tuple[str, Drawing]]:
    """Every figure that there is data for, with its name."""
    for kind, rows in found.studies.items():
        yield kind, convergence(rows, kind)
    if found.start_ups:
        yield "start_up", start_up(found.start_ups)
    if found.trains:
        yield "closure", closure(found.trains, found.spacing)


def _point(comparison: xr.Dataset) -> str:
    sp, sf, De = (float(comparison[name]) for name in ("sp", "sf", "deborah"))
    behind, ahead = ("\N{INFINITY}" if np.isinf(s) else f"{s:g}" for s in (sp, sf))
    return f"De = {De:g}, $s_p$ = {behind}, $s_f$ = {ahead}"


# ------------------------------------------------------------------------------------- start-up


@styled
def start_up(comparisons: Sequence[xr.Dataset]) -> Drawing:
    """Velocities from rest, quasi-steady ones on top, and what remains between both."""
    rows = -(-(len(comparisons) + 3) // COLUMNS)
    figure = Figure(figsize=(PAGE, 2.1 * rows), layout="constrained")
    panels = iter(figure.subplots(rows, COLUMNS, squeeze=False).ravel())
    for comparison, axes in zip(comparisons, panels, strict=False):
        _draw_relative(axes, comparison)
    colours = colours_of(len(comparisons))
    together, decay, over = next(panels), next(panels), next(panels)
    for n, (comparison, colour) in enumerate(zip(comparisons, colours, strict=True)):
        style = {"color": colour, "label": _point(comparison)}
        lambda_1 = float(comparison["deborah_longest_mode"])
        time = comparison["time"] / lambda_1
        middle = comparison["velocity"].sel(sphere="middle")
        together.plot(time, middle, **style)
        checked = comparison["check_time"] / lambda_1
        quasi_steady = comparison["quasi_steady_velocity"]
        on_top = quasi_steady[:, list(comparison["sphere"].values).index("middle")]
        together.plot(checked, on_top, ls="", marker="o", ms=3, color=colour)
        difference = np.abs(remaining_differences(comparison)).max(axis=-1, initial=0.0)
        marker = {"marker": MARKERS[n % len(MARKERS)], "ms": 4}
        decay.semilogy(checked, np.maximum(difference, NOISE / 100), **marker, **style)
        over.semilogy(float(comparison["deborah"]), difference[-1], ls="", **marker, **style)
    together.set_ylabel(r"velocity of the middle sphere [$\bar U$]")
    decay.set_ylabel("|transient - quasi-steady|,\nrelative velocity [$\\bar U$]")
    over.set_ylabel("the same at the end [$\\bar U$]")
    over.set_xlabel("De")
    over.axhline(5e-5, color=GREY, lw=0.8, ls="--")
    over.set_ylim(top=max(1e-4, over.get_ylim()[1]))
    over.text(0.98, 5.3e-5, r"$5\times 10^{-5}$", color=GREY, ha="right", transform=_x_axes(over))
    over.margins(x=0.2)
    for axes in (together, decay):
        axes.set_xlabel(r"time since the start [$\lambda_1$]")
    for axes in panels:
        axes.set_axis_off()
    entries = [Line2D([], [], color=colour) for colour in PAIR_COLOURS]
    names = ["$U_2 - U_1$", "$U_3 - U_2$"]
    entries.append(Line2D([], [], ls="", marker="o", ms=3, color="black"))
    names.append("quasi-steady at the present distances")
    figure.legend(entries, names, loc="outside upper center", ncols=3)
    handles, labels = decay.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return Drawing(figure, _start_up_data(comparisons))


def _x_axes(axes: Axes):
    """Coordinates: x in parts of the axes, y in data."""
    return axes.get_yaxis_transform()


def _draw_relative(axes: Axes, comparison: xr.Dataset):
    """Relative velocities of one point against time."""
    lambda_1 = float(comparison["deborah_longest_mode"])
    relative = PERMILLE * np.diff(comparison["velocity"].values, axis=-1)
    quasi_steady = PERMILLE * np.diff(comparison["quasi_steady_velocity"].values, axis=-1)
    first = 0 if np.isfinite(comparison["sp"]) else 1
    for k in range(relative.shape[1]):
        colour = PAIR_COLOURS[first + k]
        axes.plot(comparison["time"] / lambda_1, relative[:, k], color=colour)
        checked = comparison["check_time"] / lambda_1
        axes.plot(checked, quasi_steady[:, k], ls="", marker="o", ms=3, color=colour)
    settled = comparison["time"].values > 0.5 * lambda_1
    shown = np.concatenate([relative[settled].ravel(), quasi_steady.ravel(), [0.0]])
    room = 0.25 * np.ptp(shown)
    axes.set_ylim(shown.min() - room, shown.max() + room)
    axes.axhline(0, color="black", lw=0.6)
    axes.set_title(_point(comparison))
    axes.set_ylabel(r"relative velocity [$10^{-3}\,\bar U$]")
    axes.set_xlabel(r"time since the start [$\lambda_1$]")


def _start_up_data(comparisons: Sequence[xr.Dataset]) -> pd.DataFrame:
    parts = []
    for comparison in comparisons:
        point = {name: float(comparison[name]) for name in ("sp", "sf", "deborah")}
        names = PAIRS if np.isfinite(point["sp"]) else PAIRS[1:]
        for k, pair in enumerate(names[: comparison.sizes["gap"]]):
            frame = pd.DataFrame(
                {
                    "time_D_per_Ubar": comparison["time"],
                    "relative_velocity_Ubar": np.diff(comparison["velocity"].values)[:, k],
                    "distance_d": comparison["distance"].values[:, k],
                }
            ).set_index("time_D_per_Ubar")
            quasi_steady = np.diff(comparison["quasi_steady_velocity"].values)[:, k]
            checked = pd.Series(quasi_steady, index=comparison["check_time"].values)
            frame["quasi_steady_Ubar"] = checked
            parts.append(frame.reset_index().assign(**point, pair=pair))
    return pd.concat(parts, ignore_index=True)


# -------------------------------------------------------------------------------------- closure


@styled
def closure(trains: Sequence[xr.Dataset], spacing: pd.DataFrame) -> Drawing:
    """A short train, directly and by the models, and the errors of closures over the spacing."""
    figure = Figure(figsize=(PAGE, 6.4), layout="constrained")
    upper, lower = figure.add_gridspec(2, 1, height_ratios=[2, 1])
    rows = upper.subgridspec(2, len(trains)).subplots(sharex="col", sharey="row", squeeze=False)
    for train, position, difference in zip(trains, *rows, strict=True):
        _draw_train(position, difference, train)
    rows[0, 0].set_ylabel("distance to the trailing\nsphere, $(z_i - z_1)/d$")
    rows[1, 0].set_ylabel("the same, model minus\ndirect simulation")
    figure.legend(
        [Line2D([], [], color=BLUE), *(Line2D([], [], **style) for style in MODELS.values())],
        ["all spheres simulated directly", *(f"model, {CLOSURE_WORDS[name]}" for name in MODELS)],
        loc="outside upper center",
        ncols=3,
    )
    error, share = lower.subgridspec(1, 2).subplots()
    _draw_errors(error, share, spacing)
    return Drawing(figure, _closure_data(trains, spacing))


def _draw_train(position: Axes, difference: Axes, train: xr.Dataset):
    """A short train, and by how much the models differ from it."""
    time, direct = train["time"], train["distance"].cumsum("gap")
    position.axhline(0, color=BLUE)
    position.plot(time, direct, color=BLUE)
    for name, style in MODELS.items():
        model = train["model_distance"].sel(closure=name).cumsum("gap", skipna=False)
        position.plot(time, model, **style)
        difference.plot(time, model - direct, **style)
    largest = largest_differences(train)
    difference.set_title(" and ".join(f"{largest[name]:.2g} $d$" for name in MODELS) + " at most")
    position.set_title(f"De = {float(train['deborah']):g}")
    difference.axhline(0, color=BLUE)
    difference.set_xlabel(r"time [$D/\bar U$]")


def _draw_errors(error: Axes, share: Axes, spacing: pd.DataFrame):
    """Errors of relative velocities of equally spaced spheres against their gap."""
    deborahs = sorted(spacing["deborah"].unique())
    sizes = spacing.assign(error=spacing["error"].abs(), direct=spacing["direct"].abs())
    worst = sizes.groupby(["closure", "deborah", "gap"])[["error", "direct"]].max()
    for n, (De, colour) in enumerate(zip(deborahs, deborah_colour(deborahs), strict=True)):
        marker = {"marker": MARKERS[n], "ms": 4, "color": colour}
        for name, style in MODELS.items():
            found, line = worst.loc[name, De], marker | {"ls": style["ls"], "lw": style["lw"]}
            error.semilogy(found.index, found["error"], **line)
            share.semilogy(found.index, 100 * found["error"] / found["direct"], **line)
        error.plot([], [], **marker, label=f"De = {De:g}")
    error.set_ylabel("error of relative velocities [$\\bar U$]")
    share.set_ylabel("over the largest relative\nvelocity of the train [%]")
    for axes in (error, share):
        axes.set_xlabel("gap between equally spaced spheres [$d$]")
        axes.grid(alpha=0.3, lw=0.5)
    error.legend()


def _closure_data(trains: Sequence[xr.Dataset], spacing: pd.DataFrame) -> pd.DataFrame:
    parts = [spacing.assign(comparison="equally spaced")]
    for train in trains:
        frame = train[["distance", "model_distance"]].to_dataframe().reset_index()
        frame = frame[["closure", "time", "gap", "distance", "model_distance"]]
        frame = frame.rename(columns={"gap": "number"})
        parts.append(frame.assign(comparison="train", deborah=float(train["deborah"])))
    return pd.concat(parts, ignore_index=True)


# ---------------------------------------------------------------------------------- convergence


@styled
def convergence(rows: pd.DataFrame, kind: str) -> Drawing:
    """Error of relative velocities against one setting, per De and geometry."""
    table = with_errors(rows, kind)
    orders = observed_orders(table, kind).set_index("deborah")
    fixed = table[table["value"] > 0]
    deborahs = sorted(fixed["deborah"].unique())
    columns = min(len(deborahs), COLUMNS)
    lines = -(-len(deborahs) // columns)
    figure = Figure(figsize=(PAGE, 2.3 * lines + 0.4), layout="constrained")
    panels = figure.subplots(lines, columns, sharey=True, squeeze=False).ravel()
    for De, axes in zip(deborahs, panels, strict=False):
        part = fixed[fixed["deborah"] == De]
        for n, (point, own) in enumerate(part.groupby(["sp", "sf"])):
            own = own[own["error"] > 0]
            label = "$(s_p, s_f)$ = ({:g}, {:g})".format(*point).replace("inf", "\N{INFINITY}")
            axes.plot(own["value"], own["error"], marker=MARKERS[n], ms=4, label=label)
        if kind in ("mesh", "time_step"):
            axes.set_xscale("log")
            axes.set_xticks(sorted(part["value"].unique()))
            axes.set_xticks([], minor=True)
            axes.xaxis.set_major_formatter("{x:g}")
        else:
            axes.set_xticks(sorted(part["value"].unique()))
        axes.set_yscale("log")
        axes.axhline(NOISE, color=GREY, lw=0.8, ls="--")
        found = orders.loc[De, "observed"]
        text = "too close to the noise" if np.isnan(found) else f"{LABELS[kind][1]} {found:.2g}"
        axes.set_title(f"De = {De:g}: {text}")
        default = table[table["default"] & (table["deborah"] == De)]
        if (default["value"] > 0).all():
            axes.axvline(default["value"].iloc[0], color=GREY, lw=0.8, ls=":")
        else:
            axes.axhline(default["error"].max(), color=GREY, lw=0.8, ls=":")
    for axes in panels[len(deborahs) :]:
        axes.set_axis_off()
    panels[0].set_ylabel("error of relative velocities [$\\bar U$]")
    figure.supxlabel(LABELS[kind][0], fontsize=STYLE["axes.labelsize"])
    handles, labels = panels[0].get_legend_handles_labels()
    handles += [Line2D([], [], color=GREY, lw=0.8, ls=style) for style in (":", "--")]
    figure.legend(
        handles,
        [*labels, "default", r"$10^{-6}\,\bar U$"],
        loc="outside upper center",
        ncols=5,
    )
    return Drawing(figure, table)
