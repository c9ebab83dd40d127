"""The fit in words, as a section of a config, and as a dataset."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
import yaml

from viscotrain.fluid import rheology
from viscotrain.fluid.fit_parameters import Known, Layout, values_of
from viscotrain.fluid.fit_problem import NORMAL_STRESS, FluidFit
from viscotrain.fluid.fluid_fit import Result
from viscotrain.fluid.parameters import Fluid

DIGITS = 4  # of the fluid that is written: fewer than the minimisation has, more than data deserve


def rounded(fluid: Fluid) -> dict:
    """The fluid as the config spells it, to a few digits, so that it does not follow round-off."""

    def short(value: float) -> float:
        return float(f"{value:.{DIGITS}g}")

    return {
        "solvent_viscosity": short(fluid.solvent_viscosity),
        "modes": [
            {
                "viscosity": short(mode.viscosity),
                "relaxation_time": short(mode.relaxation_time),
                "mobility": short(mode.mobility),
            }
            for mode in fluid.modes
        ],
    }


def as_yaml(fitted: FluidFit) -> str:
    """The section `fluid` of a config, with what it rests on as comments."""
    files = ", ".join(sorted({Path(name).name for name in fitted.data["file"]}))
    errors = ", ".join(
        f"{name} {error:.2g}" if name.endswith("mobility") else f"{name} {100 * error:.1f} %"
        for name, error in zip(fitted.names, fitted.uncertainties, strict=True)
    )
    comment = (
        f"Fitted to {len(fitted.data)} numbers in {files}, rms deviation {_scatter(fitted)}. "
        f"Standard errors: {errors or 'nothing was fitted'}.{_not_fitted(fitted)}"
    )
    falling = _falling_stress(fitted.fluid)
    if falling is not None:
        comment += (
            f" The shear stress falls with the shear rate at {falling:.3g} 1/s: no unique steady "
            "flow there."
        )
    lines = textwrap.wrap(comment, 95)
    settings = {"sort_keys": False, "default_flow_style": None, "width": 99}
    block = yaml.safe_dump({"fluid": rounded(fitted.fluid)}, **settings)
    return "".join(f"# {line}\n" for line in lines) + block


def _scatter(fitted: FluidFit) -> str:
    """How far data and fluid are apart, normal stresses by themselves where they scatter more."""
    noise = fitted.data.groupby("quantity")["noise"].first()
    if noise.nunique() < 2:
        return f"{100 * fitted.misfit:.1f} %"
    of_normal = f"{100 * noise.pop(NORMAL_STRESS):.1f} %"
    return f"{100 * noise.iloc[0]:.1f} % (normal stress differences {of_normal})"


def _not_fitted(fitted: FluidFit) -> str:
    """Names and values of what was known."""
    count = len(fitted.fluid.modes)
    known = [name for name in Layout(count, Known()).names if name not in fitted.names]
    if not known:
        return ""
    values = values_of(fitted.fluid, known)
    words = [f"{name} {value:.{DIGITS}g}" for name, value in zip(known, values, strict=True)]
    return f" Known, not fitted: {', '.join(words)}."


def _falling_stress(fluid: Fluid) -> float | None:
    """The smallest shear rate in 1/s at which the shear stress falls; None if it never does."""
    times = [mode.relaxation_time for mode in fluid.modes]
    if not times:
        return None
    rates = np.geomspace(0.1 / max(times), 1e4 / min(times), 2000)
    falling = np.diff(rheology.viscosity(rates, fluid) * rates) < 0
    return float(rates[np.argmax(falling)]) if falling.any() else None


def dataset(result: Result, attributes: dict[str, str]) -> xr.Dataset:
    """Parameters with uncertainties and correlation, data with residuals, and what was compared.

    Args:
        result: Of `fluid_fit.fit`.
        attributes: Global attributes.
    """
    fitted = result.chosen
    names, counts = list(fitted.names), [len(c.fluid.modes) for c in result.candidates]
    tried = {"long_name": "number of modes that were tried", "units": "1"}
    return xr.Dataset(
        _parameters(fitted) | _numbers(fitted.data) | _compared(result.candidates),
        coords={
            "parameter": ("parameter", names, {"long_name": "parameter"}),
            "other_parameter": ("other_parameter", names, {"long_name": "parameter"}),
            "modes": ("modes", counts, tried),
        },
        attrs=attributes,
    )


def _parameters(fitted: FluidFit) -> dict[str, tuple]:
    """Values of the parameters and how sure they are."""
    relative = [not name.endswith("mobility") for name in fitted.names]
    variables = {
        "value": (fitted.values, "value: viscosities in Pa s, times in s, mobilities in 1"),
        "uncertainty": (
            fitted.uncertainties,
            "standard error: relative for viscosities and times, absolute for mobilities",
        ),
        "lowest": (fitted.limits[0], "smallest value that the fit may find, units as the value"),
        "highest": (fitted.limits[1], "largest value that the fit may find, units as the value"),
        "relative": (np.array(relative, dtype=np.int8), "1: uncertainty is relative"),
    }
    correlation = {"long_name": "correlation of the errors of two parameters", "units": "1"}
    return _described("parameter", variables) | {
        "correlation": (("parameter", "other_parameter"), fitted.correlation, correlation)
    }


def _numbers(data: pd.DataFrame) -> dict[str, tuple]:
    """What was measured, what the fluid gives, and where it stands."""
    variables = {
        "abscissa": (data["abscissa"], "angular frequency in rad/s or shear rate in 1/s"),
        "measured": (
            data["measured"],
            "measured modulus or normal stress difference in Pa, or viscosity in Pa s",
        ),
        "model": (data["model"], "the same of the fitted fluid"),
        "residual": (data["residual"], "logarithm of model over measured"),
        "noise": (data["noise"], "rms of the residuals that the fit takes for the number's error"),
        "line": (data["line"], "line of the file"),
    }
    texts = {"file": "file of the number", "quantity": "what was measured"}
    return _described("number", variables) | {
        name: ("number", np.array(data[name].tolist(), dtype=object), {"long_name": long_name})
        for name, long_name in texts.items()
    }


def _compared(candidates: Sequence[FluidFit]) -> dict[str, tuple]:
    """How well each number of modes does."""
    determined = np.array([not c.undetermined for c in candidates], dtype=np.int8)
    return _described(
        "modes",
        {
            "criterion": ([c.criterion for c in candidates], "Bayesian information criterion"),
            "misfit": ([c.misfit for c in candidates], "root mean square residual"),
            "determined": (determined, "1: all parameters are determined"),
        },
    )


def _described(dimension: str, variables: Mapping[str, tuple]) -> dict[str, tuple]:
    """Variables with their meaning, and the unit 1 where the meaning names no other."""
    found = {}
    for name, (values, long_name) in variables.items():
        of = {"long_name": long_name}
        if name not in ("value", "lowest", "highest", "abscissa", "measured", "model"):
            of["units"] = "1"
        found[name] = (dimension, np.asarray(values), of)
    return found


def summary(result: Result) -> str:
    """What was tried and chosen, as text."""
    lines = ["modes    BIC   rms deviation"]
    for c in result.candidates:
        mark = "  <- chosen" if c is result.chosen else "  undetermined" * bool(c.undetermined)
        count = len(c.fluid.modes)
        lines.append(f"{count:5d} {c.criterion:8.1f} {100 * c.misfit:8.1f} %{mark}")
    return "\n".join([*lines, "", as_yaml(result.chosen)])
