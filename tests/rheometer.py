"""A rheometer for tests: measurements of known fluids, exact or with noise, as files."""

import math

import numpy as np

from viscotrain.fluid import measurements
from viscotrain.fluid.fit_parameters import logarithmic, values_of
from viscotrain.fluid.fit_problem import model
from viscotrain.fluid.parameters import Fluid, Mode

HYALURONIC_ACID = Fluid(0.051, (Mode(0.257, 0.0752, 0.283), Mode(0.254, 0.00848, 0.49)))
ONE_MODE = Fluid(0.02, (Mode(0.9, 0.03, 0.2),))
OLDROYD_B = Fluid(0.1, (Mode(0.4, 0.05, 0.0),))
NOISE = 0.03


def rates(per_decade, low=0.1, high=1e4):
    return np.geomspace(low, high, round(per_decade * math.log10(high / low)) + 1)


def csv_text(fluid, quantities, x, noise=0.0, rng=None):
    """A file of measurements at the same rates x of a fluid whose logarithms have some noise."""
    abscissa = measurements.COLUMNS[quantities[0]].abscissa
    columns = [x]
    for quantity in quantities:
        error = noise * rng.normal(size=x.size) if noise else 0.0
        columns.append(model(quantity, x, fluid) * np.exp(error))
    lines = [",".join([abscissa, *quantities])]
    lines += [",".join(f"{value:.10g}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join(lines) + "\n"


def measured(
    folder, fluid=HYALURONIC_ACID, per_decade=10, noise=0.0, seed=0, normal_noise=None, **spans
):
    """Files of a fluid, as paths; spans: (low, high) of frequency, rate and normal, None: no file.

    Normal stress differences are not measured unless their span is given.
    """
    rng = np.random.default_rng(seed)
    spans = {"frequency": (0.1, 1e3), "rate": (0.1, 1e4), "normal": None} | spans
    texts = {
        "oscillation.csv": (("storage_modulus", "loss_modulus"), spans["frequency"]),
        "shear.csv": (("viscosity",), spans["rate"]),
        "normal.csv": (("first_normal_stress_difference",), spans["normal"]),
    }
    if not fluid.modes:
        texts["oscillation.csv"] = (("loss_modulus",), spans["frequency"])
    paths = []
    for name, (quantities, span) in texts.items():
        if span is not None:
            own = normal_noise if normal_noise and name == "normal.csv" else noise
            text = csv_text(fluid, quantities, rates(per_decade, *span), own, rng)
            paths.append(folder / name)
            paths[-1].write_text(text, encoding="utf-8")
    return paths


def parameters(fluid):
    return np.array(
        [
            fluid.solvent_viscosity,
            *(
                value
                for mode in fluid.modes
                for value in (mode.viscosity, mode.relaxation_time, mode.mobility)
            ),
        ]
    )


def deviations(fitted, fluid):
    """Found minus true over the uncertainty, of each fitted parameter."""
    true = np.array(values_of(fluid, fitted.names))
    logs = logarithmic(fitted.names)
    difference = fitted.values - true
    difference[logs] = np.log(fitted.values[logs] / true[logs])
    return difference / fitted.uncertainties
