"""How far the uncertainty of a fit reaches: drawn fluids at the flow rates of the study.

Each draw (`fit_draws`) has its own De, pressure and velocity on the axis, and orders as the table
says at its De (`order_between`). That table is of the fitted fluid: what a draw changes in its
curves is not in it, which takes simulations. Draw 0 is the fitted fluid itself.
"""

import re
import warnings
from collections.abc import Iterator

import numpy as np
import xarray as xr

from viscotrain.config.device_settings import (
    FitSpreadSettings,
)
from viscotrain.config.flow_rates import at_same_flow_rates
from viscotrain.config.models import FluidConfig
from viscotrain.config.settings import (
    StudyConfigSettings,
)
from viscotrain.fluid import fit_report
from viscotrain.fluid.fit_draws import FLOW, drawn_fluids, flow_in_channel
from viscotrain.fluid.fit_parameters import values_of
from viscotrain.fluid.parameters import Fluid
from viscotrain.fluid.units import MICROLITRES_PER_MINUTE
from viscotrain.trains.order_between import order_at
from viscotrain.words import DEBORAH_NUMBERS

LONGEST_NAME = 56  # of a study, which leaves room for the number of a draw
SHARE = 0.95  # of the draws between low and high
ORDER = {
    "ordering_rate": ("1", "channel diameter over ordering length; 0 where trains do not order"),
    "remaining_variation": ("1", "CV at the outlet over CV at the inlet, small scatter"),
}
OF_THE_STUDY = {
    "mean_velocity": ("m s-1", "mean velocity of the flow, the same for all draws"),
    "flow_rate": ("uL min-1", "flow rate, the same for all draws"),
}


def fluids_of(fit: xr.Dataset, own: FitSpreadSettings) -> list[Fluid]:
    """The fitted fluid and those that are drawn."""
    return [own.known_fluid, *drawn_fluids(fit, own.known_fluid, own.draws)]


def spread(
    fluids: list[Fluid], names: list[str], order: xr.Dataset, own: FitSpreadSettings
) -> xr.Dataset:
    """What each fluid does, and between which values 95 % of the draws are.

    Args:
        fluids: Of `fluids_of`.
        names: Of the parameters that were fitted.
        order: Of `order.orders`, at the study's Deborah numbers.
        own: Settings of the stage.

    Returns:
        Dataset over (draw, deborah, spacing) with the variables of `FLOW` and `ORDER`, each with
        `_low` and `_high` without draw, and the drawn values over (draw, parameter).
    """
    rates, longest = own.shear_rates(), own.longest_modes()
    De = order["deborah"].values
    Ubar = np.array([rates.get(float(value), 0.0) * own.channel_diameter for value in De])
    flows = [
        [flow_in_channel(fluid, U, own.channel_diameter, own.channel_length) for U in Ubar]
        for fluid in fluids
    ]
    nodes = [longest[float(value)] for value in De]
    two, three = ("draw", "deborah"), ("draw", "deborah", "spacing")
    values: dict[str, tuple] = {
        name: (two, np.array([[flow[name] for flow in row] for row in flows])) for name in FLOW
    }
    found = order_at(order, nodes, values["deborah_longest_mode"][1], own.channel_length)
    values |= {name: (three, array) for name, array in found.items()}
    Ubar = np.where(Ubar > 0, Ubar, np.nan)
    area = own.section.area * own.channel_diameter**2
    values["mean_velocity"] = (("deborah",), Ubar)
    values["flow_rate"] = (("deborah",), area * Ubar * MICROLITRES_PER_MINUTE)
    result = xr.Dataset(
        values,
        coords={
            "draw": ("draw", range(len(fluids)), {"long_name": "drawn fluid; 0: the fitted one"}),
            "deborah": ("deborah", De, {"long_name": DEBORAH_NUMBERS["deborah"], "units": "1"}),
            "spacing": order["spacing"],
            "parameter": ("parameter", names, {"long_name": "parameter of the fit"}),
        },
        attrs=own.section.attributes,
    )
    for name, (units, long_name) in (FLOW | ORDER | OF_THE_STUDY).items():
        result[name].attrs = {"units": units, "long_name": long_name}
    parameters = [values_of(fluid, names) for fluid in fluids]
    words = {"long_name": "values of the fitted parameters in Pa s, s and 1"}
    result["value"] = (("draw", "parameter"), parameters, words)
    return _with_range(result)


def _with_range(result: xr.Dataset) -> xr.Dataset:
    """Each variable between which 95 % of the draws are, those without a value left out."""
    drawn = result.sel(draw=result["draw"] > 0)
    for name in (*FLOW, *ORDER):
        for end, share in (("low", (1 - SHARE) / 2), ("high", (1 + SHARE) / 2)):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)  # none has a value: NaN
                found = drawn[name].quantile(share, dim="draw", skipna=True).drop_vars("quantile")
            words = f"{end} end of 95 % of the draws: {result[name].attrs['long_name']}"
            result[f"{name}_{end}"] = found.assign_attrs(result[name].attrs, long_name=words)
    flows = result["mean_velocity"] > 0
    lost = {
        "without_flow": drawn["pressure_drop"].isnull(),
        "without_order": drawn["ordering_rate"].isnull().all("spacing"),
    }
    for name, of in lost.items():
        long_name = f"draws {name.replace('_', ' a known ')}"
        result[name] = (of & flows).sum("draw").assign_attrs(units="1", long_name=long_name)
    return result


def headline(result: xr.Dataset) -> Iterator[str]:
    """The spread in words, two lines for each Deborah number above 0."""
    yield f"95 % of {result.sizes['draw'] - 1} draws of the fit, at the flow rates of the study;"
    yield "order at De of each draw, by the table of the fitted fluid: what a draw changes in the"
    yield "table itself may be more, and takes simulations (fit_spread/draw_01.yaml, ...)"
    if "channel" in result.attrs:
        yield f"{result.attrs['channel']}, and so are U_max and pressure here"
    for De in result["deborah"].values:
        own = result.sel(deborah=De)
        if not float(own["mean_velocity"]) > 0:
            continue
        yield (
            f"De = {De:g}, {float(own['flow_rate']):.3g} uL/min: De of the longest mode "
            f"{_range(own, 'deborah_longest_mode')}, U_max "
            f"{_range(own, 'centreline_velocity', 4)} Ubar, {_range(own, 'pressure_drop')} bar"
            f"{_lost(own, 'without_flow', 'no unique flow')}"
        )
        yield f"  {_order(own)}{_lost(own, 'without_order', 'too far from the De of the table')}"


def _range(own: xr.Dataset, name: str, digits: int = 3) -> str:
    return " to ".join(_short(float(own[f"{name}_{end}"]), digits) for end in ("low", "high"))


def _short(value: float, digits: int = 3) -> str:
    """So many digits, without powers of ten."""
    return f"{float(f'{value:.{digits}g}'):g}"


def _lost(own: xr.Dataset, name: str, reason: str) -> str:
    count = int(own[name])
    return f" ({count} draws left out: {reason})" if count else ""


def _order(own: xr.Dataset) -> str:
    """Ordering length at the spacing that orders fastest."""
    rates = own["ordering_rate"].sel(draw=0).values
    if not rates.max() > 0:
        return "no spacing orders"
    best = own.isel(spacing=int(np.argmax(rates)))
    ends = [float(best[f"ordering_rate_{end}"]) for end in ("high", "low")]
    lengths = " to ".join(_short(1 / rate) if rate > 0 else "infinity" for rate in ends)
    return f"orders fastest, at s = {float(best['spacing']):.2g} d, along {lengths} D"


def configs(fluids: list[Fluid], own: FitSpreadSettings) -> Iterator[str]:
    """A config for each draw, at the flow rates of the study, which Snakemake runs."""
    central = own.known_fluid
    for number, fluid in enumerate(fluids[1:], start=1):
        written = FluidConfig.model_validate(fit_report.rounded(fluid))
        ratio = own.relaxation_time(written.physical()) / own.relaxation_time(central)
        name = f"{_plain(own.config['study'])}_draw_{number:02d}"
        yield StudyConfigSettings(
            config=at_same_flow_rates(own.config, name, written, ratio)
        ).text()


def _plain(name: str) -> str:
    """A study's name as a config may write it: that of a sweep has its d/D behind a slash."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", name)[:LONGEST_NAME]
