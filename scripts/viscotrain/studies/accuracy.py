"""How accurate a study is: differences, observed orders, and all of them in words.

The error of a setting is its difference from the finest one of the study. The observed order is the
slope of log(error) over log(size) for mesh and time step; for order and box, whose errors fall
exponentially, the factor per order or per D. Where errors are at the noise of the mesh, about 1e-6
Ubar, no order can be observed.

This module needs no NGSolve: figures draw what it finds.
"""

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
import xarray as xr

KINDS = ("mesh", "order", "box", "time_step")
RELATIVE = ["middle_minus_trailing", "leading_minus_middle"]  # columns, in Ubar
NOISE = 1e-6  # Ubar, of relative velocities between meshes
WHAT = {
    "mesh": ("meshes", "sizes at the start times {finest:g}, accuracy times its cube"),
    "order": ("polynomial order", "one order more on the same mesh"),
    "box": ("periodic length", "margin of {finest:g} D"),
    "time_step": ("controlled time steps", "the limit of small steps, extrapolated"),
}
CLOSURE_WORDS = {"every_sphere": "every sphere", "nearest": "two neighbours"}
ORDER_LABELS = {
    "mesh": "order",
    "order": "factor per order",
    "box": "factor per D",
    "time_step": "order",
}

# ---------------------------------------------------------------------------------- differences


def remaining_differences(comparison: xr.Dataset) -> np.ndarray:
    """Relative velocities, transient minus quasi-steady, in Ubar, shape (check, gap)."""
    at = comparison.sel(time=comparison["check_time"])["velocity"].values
    return np.diff(at - comparison["quasi_steady_velocity"].values, axis=-1)


def refinement_difference(trajectory: xr.Dataset) -> float:
    """Largest change by refinement of a distance to the trailing sphere at the end, in d."""
    change = trajectory["refined_distance"] - trajectory["distance"].isel(time=-1)
    return float(np.abs(change.cumsum("gap")).max())


def largest_differences(comparison: xr.Dataset) -> dict[str, float]:
    """Largest distance from sphere to trailing sphere, model minus direct, in d, by closure."""
    along = (comparison["model_distance"] - comparison["distance"]).cumsum("gap", skipna=False)
    largest = abs(along).max(["time", "gap"])
    return dict(zip(largest["closure"].values.tolist(), largest.values.tolist(), strict=True))


# ---------------------------------------------------------------------------------- convergence


def with_errors(rows: pd.DataFrame, kind: str) -> pd.DataFrame:
    """Add `error`: the largest difference of a relative velocity from the finest setting.

    For the time step the limit is extrapolated from the two smallest fixed ones (order two).
    """
    point = ["sp", "sf", "deborah"]
    finest = {"mesh": min, "order": max, "box": max, "time_step": min}[kind]
    parts = []
    for _, part in rows.groupby(point, sort=False):
        fixed = part[part["value"] > 0].sort_values("value", ascending=finest is min)
        limit = fixed[RELATIVE].iloc[0]
        if kind == "time_step" and len(fixed) > 1:
            limit = limit + (limit - fixed[RELATIVE].iloc[1]) / 3
        parts.append(part.assign(error=(part[RELATIVE] - limit).abs().max(axis=1)))
    return pd.concat(parts, ignore_index=True)


def observed_orders(table: pd.DataFrame, kind: str) -> pd.DataFrame:
    """One row per De: observed order over all geometries, and largest error of the default.

    The order is the slope of log(error) over log(value), or over value for order and box, by least
    squares through the settings whose errors are above the noise; NaN with less than two of them.
    """
    rows = []
    for De, part in table.groupby("deborah"):
        worst = part.groupby("value")["error"].max()
        worst = worst[(worst.index > 0) & (worst > (NOISE if De > 0 else 1e-9))]
        x = np.log(worst.index) if kind in ("mesh", "time_step") else np.asarray(worst.index)
        slope = np.polyfit(x, np.log(worst), 1)[0] if len(worst) > 1 else math.nan
        default = part[part["default"]]
        sizes = default[RELATIVE].abs().max(axis=1)
        rows.append(
            {
                "deborah": De,
                "observed": slope if kind in ("mesh", "time_step") else math.exp(-slope),
                "default_error": default["error"].max(),
                "default_error_share": (default["error"] / sizes).max(),
            }
        )
    return pd.DataFrame(rows)


# ------------------------------------------------------------------------------------- in words


def accuracy(
    table: xr.Dataset,
    start_ups: Sequence[xr.Dataset],
    trains: Sequence[xr.Dataset],
    spacing: pd.DataFrame,
    studies: dict[str, pd.DataFrame],
) -> str:
    """Every number that the verification found, as a Markdown table.

    Args:
        table: The velocity table.
        start_ups: From `start_up.compare_start_up`.
        trains: From `train_models.with_models`.
        spacing: From `train_models.with_errors_of_models`; empty without closure.
        studies: Rows of `convergence.convergence_rows` of all geometries by kind.
    """
    lines = ["| what | compared with | De | error |", "|---|---|---|---|"]
    lines += [f"| {' | '.join(row)} |" for row in _convergence_lines(studies)]
    if "check_error" in table:
        for De, error in zip(table["deborah"].values, table["check_error"].values, strict=True):
            what = f"simulation at {table.sizes['check']} geometries between the nodes"
            largest = np.nanmax(np.abs(error))
            lines.append(f"| interpolation of the table | {what} | {De:g} | {largest:.1e} Ubar |")
    for comparison in start_ups:
        sp, sf, De = (float(comparison[name]) for name in ("sp", "sf", "deborah"))
        left = np.abs(remaining_differences(comparison)[-1]).max(initial=0.0)
        what = f"quasi-steady at sp = {sp:g}, sf = {sf:g}"
        end = float(comparison["time"][-1] / comparison["deborah_longest_mode"])
        then = f"transient, {end:g} relaxation times after rest"
        lines.append(f"| {what} | {then} | {De:g} | {left:.1e} Ubar |")
    for train in trains:
        then = f"direct simulation until {float(train['time'][-1]):g} D/Ubar"
        De = float(train["deborah"])
        for closure, difference in largest_differences(train).items():
            what = f"train model, {train.sizes['sphere']} spheres, {CLOSURE_WORDS[closure]}"
            lines.append(f"| {what} | {then} | {De:g} | {difference:.2g} d |")
        if "refined_distance" in train:
            finer = "the same with smaller elements and time steps"
            change = refinement_difference(train)
            lines.append(f"| {then}, at its end | {finer} | {De:g} | {change:.1e} d |")
    if len(spacing):
        by = ["closure", "deborah", "gap"]
        worst = spacing.assign(error=spacing["error"].abs()).groupby(by)["error"]
        for (closure, De, gap), error in worst.max().items():
            what = f"train model, gaps of {gap:g} d, {CLOSURE_WORDS[closure]}"
            lines.append(f"| {what} | equally spaced spheres | {De:g} | {error:.1e} Ubar |")
    return "\n".join(lines) + "\n"


def _convergence_lines(studies: dict[str, pd.DataFrame]):
    for kind, rows in studies.items():
        values = rows["value"][rows["value"] > 0]
        finest = values.min() if kind == "mesh" else values.max()
        for row in observed_orders(with_errors(rows, kind), kind).itertuples():
            what, against = WHAT[kind]
            share = f" ({100 * row.default_error_share:.2g} %)" if row.deborah > 0 else ""
            error = f"{row.default_error:.1e} Ubar{share}"
            against = against.format(finest=finest)
            if not np.isnan(row.observed):
                against += f"; observed {ORDER_LABELS[kind]} {row.observed:.2g}"
            yield f"relative velocities: {what}", against, f"{row.deborah:g}", error
