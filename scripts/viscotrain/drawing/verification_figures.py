"""Figures of the verification, and the statement of accuracy that follows from its numbers."""

import itertools
from collections.abc import Iterator, Sequence
from string import ascii_lowercase
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter

from viscotrain.drawing.style import (
    GREY,
    MARKER_SIZE,
    MARKERS,
    PAGE,
    PALE_GREY,
    SMALL,
    STYLE,
    Drawing,
    deborah_look,
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
MODELS: dict[str, dict[str, Any]] = {  # by their closure; the study's own one last
    "every_sphere": {"ls": "-", "lw": 1.1},
    "nearest": {"ls": (0, (1, 1)), "lw": 1.1},
}
GAPS = {PAIRS[1]: "-", PAIRS[0]: (0, (4, 2))}  # of three spheres: the one ahead, the one behind
GAP_WORDS = ("gap ahead of the middle sphere", "gap behind it")
RUNS = ("-", "--", "-.", ":", (0, (5, 1)), (0, (1, 3)), (0, (6, 1, 1, 1, 1, 1)))
TIME = r"time since the start [$\lambda_1$]"
PERMILLE = 1e3
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
    behind, ahead = ("\N{INFINITY}" if np.isinf(s) else f"{s:g} $d$" for s in (sp, sf))
    return f"De = {De:g}: $s_p$ = {behind}, $s_f$ = {ahead}"


# ------------------------------------------------------------------------------------- start-up


@styled
def start_up(comparisons: Sequence[xr.Dataset]) -> Drawing:
    """Velocities from rest, with those of held distances on top, and what remains between both."""
    rows, used = divmod(len(comparisons), COLUMNS)
    figure = Figure(figsize=(PAGE, 1.0 + 1.9 * (rows + 1)), layout="constrained")
    grid = figure.add_gridspec(rows + 1, COLUMNS)
    for n, (comparison, letter) in enumerate(zip(comparisons, ascii_lowercase, strict=False)):
        axes = figure.add_subplot(grid[divmod(n, COLUMNS)])
        _draw_relative(axes, comparison)
        axes.set_title(_point(comparison), loc="left")
        words = {"ha": "right", "weight": "bold", "transform": axes.transAxes}
        axes.text(0.97, 0.04, letter, **words)
        if n % COLUMNS == 0:
            axes.set_ylabel("relative velocity\n[$10^{-3}\\,\\bar U$]")
    _draw_remaining(figure.add_subplot(grid[rows, used:]), comparisons)
    entries = [Line2D([], [], color="black", ls=style) for style in GAPS.values()]
    entries.append(Line2D([], [], ls="", marker="o", ms=MARKER_SIZE, color="black"))
    names = [*GAP_WORDS, "velocities of the same distances, held"]
    figure.legend(entries, names, loc="outside upper center", ncols=3)
    return Drawing(figure, _start_up_data(comparisons))


def _draw_relative(axes: Axes, comparison: xr.Dataset):
    """Relative velocities of one point against time: positive where the gap opens."""
    lambda_1 = float(comparison["deborah_longest_mode"])
    look = deborah_look(float(comparison["deborah"])) | {"marker": "", "clip_on": False}
    relative = PERMILLE * np.diff(comparison["velocity"].values, axis=-1)
    held = PERMILLE * np.diff(comparison["quasi_steady_velocity"].values, axis=-1)
    for k, pair in enumerate(_pairs(comparison)):
        axes.plot(comparison["time"] / lambda_1, relative[:, k], **look | {"ls": GAPS[pair]})
        checked = comparison["check_time"] / lambda_1
        axes.plot(checked, held[:, k], **look | {"ls": "", "marker": "o"})
    axes.axhline(0, color="black", lw=0.6)
    axes.set_xlabel(TIME)
    axes.margins(x=0)


def _pairs(comparison: xr.Dataset) -> tuple[str, ...]:
    """Names of its gaps."""
    return PAIRS if np.isfinite(comparison["sp"]) else PAIRS[1:]


def _draw_remaining(axes: Axes, comparisons: Sequence[xr.Dataset]):
    """The larger one of both differences of a run against time; runs have letters."""
    for comparison, letter, dashes in zip(
        comparisons, ascii_lowercase, itertools.cycle(RUNS), strict=False
    ):
        look = deborah_look(float(comparison["deborah"])) | {"ls": dashes}
        time = comparison["check_time"].values / float(comparison["deborah_longest_mode"])
        difference = np.abs(remaining_differences(comparison)).max(axis=-1, initial=0.0)
        axes.semilogy(time, np.maximum(difference, NOISE / 100), label=letter, **look)
    axes.set_title("how far from the velocities of held distances", loc="left")
    axes.set(xlabel=TIME, ylabel=r"largest difference [$\bar U$]", xlim=(0, None))
    axes.legend(loc="center left", bbox_to_anchor=(1, 0.5), handlelength=3)


def _start_up_data(comparisons: Sequence[xr.Dataset]) -> pd.DataFrame:
    parts = []
    for comparison in comparisons:
        point = {name: float(comparison[name]) for name in ("sp", "sf", "deborah")}
        for k, pair in enumerate(_pairs(comparison)):
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
    """Errors of both models: of a short train on its way, and over the spacing of an even one."""
    figure = Figure(figsize=(PAGE, 5.0), layout="constrained")
    upper, lower = figure.add_gridspec(2, 1, height_ratios=[1, 1.2])
    panels = upper.subgridspec(1, len(trains)).subplots(sharey=True, squeeze=False)[0]
    for train, axes in zip(trains, panels, strict=True):
        _draw_train(axes, train)
    panels[0].set_ylabel("distance to the last sphere,\nmodel minus simulation [$d$]")
    error, share = lower.subgridspec(1, 2).subplots()
    _draw_errors(error, share, spacing)
    styles = [Line2D([], [], color="black", **style) for style in MODELS.values()]
    names = [f"model: a sphere feels {CLOSURE_WORDS[name]}" for name in MODELS]
    figure.legend(styles, names, loc="outside upper center", ncols=2)
    return Drawing(figure, _closure_data(trains, spacing))


def _draw_train(axes: Axes, train: xr.Dataset):
    """By how much each sphere of a short train is elsewhere by the models; they may begin late."""
    De, time, direct = float(train["deborah"]), train["time"], train["distance"].cumsum("gap")
    look, largest = deborah_look(De) | {"marker": ""}, largest_differences(train)
    axes.axhline(0, color="black", lw=0.6)
    for name, style in MODELS.items():
        model = train["model_distance"].sel(closure=name).cumsum("gap", skipna=False)
        axes.plot(time, model - direct, **look | style)
    known = train["model_distance"].notnull().all(["closure", "gap"]).values
    begin, start = (float(t) for t in (time[0], time[known.argmax() if known.any() else -1]))
    if start > begin:
        axes.axvspan(begin, start, color=PALE_GREY, alpha=0.5, lw=0)
        look = {"rotation": 90, "ha": "center", "va": "center", "fontsize": SMALL}
        place = axes.get_xaxis_transform()
        axes.text((begin + start) / 2, 0.5, "start-up", transform=place, **look)
    axes.set_title(f"De = {De:g}", loc="left")
    words = [f"{CLOSURE_WORDS[name]}: at most {largest[name]:.2g} $d$" for name in MODELS]
    axes.text(0.03, 0.03, "\n".join(words), fontsize=SMALL, transform=axes.transAxes)
    axes.set_xlabel(r"time [$D/\bar U$]")
    axes.margins(x=0, y=0.15)


def _draw_errors(error: Axes, share: Axes, spacing: pd.DataFrame):
    """Errors of relative velocities of equally spaced spheres against their gap."""
    sizes = spacing.assign(error=spacing["error"].abs(), direct=spacing["direct"].abs())
    worst = sizes.groupby(["closure", "deborah", "gap"])[["error", "direct"]].max()
    for De in sorted(spacing["deborah"].unique()):
        for name, style in MODELS.items():
            found, look = worst.loc[name, De], deborah_look(De) | style
            error.semilogy(found.index, found["error"], **look)
            share.semilogy(found.index, 100 * found["error"] / found["direct"], **look)
        error.plot([], [], **deborah_look(De) | {"ls": ""}, label=f"De = {De:g}")
    error.set_ylabel("largest error of a\nrelative velocity [$\\bar U$]")
    share.set_ylabel("the same, in % of the largest\nrelative velocity in that train")
    share.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
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
