"""Velocity tables with known functions behind them, shaped like those of the simulation."""

import numpy as np
import xarray as xr

from viscotrain.table.interpolation import TripletVelocities
from viscotrain.trains.repeats import with_memory_numbers
from viscotrain.trains.variables import described
from viscotrain.words import DEBORAH_NUMBERS, PARTICLES

SINGLE = 1.65  # Ubar
BETA = 0.2  # d/D
PAPER_NODES = [1.05, 1.1, 1.2, 1.35, 1.6, 2, 2.5, 3.2, 4.2, 5.8, 8.2, 12, np.inf]
DEMO_NODES = [1.1, 1.5, 2.5, 4.5, np.inf]


def relative(s):
    """A pair's relative velocity: attraction near contact, repulsion beyond s = 1.45."""
    return 2.6e-3 * np.exp(-(s - 1) / 2.2) - 3.2e-3 * np.exp(-(s - 1) / 1.0)


def slowing(s):
    """What a neighbour takes from the velocity of both spheres of a pair."""
    return -3e-3 * np.exp(-(s - 1) / 1.3)


def superposed(sp, sf, scale=1.0):
    """U of the three spheres, shape (..., 3): every sphere feels the others, as in pairs."""
    sp, sf = np.broadcast_arrays(np.asarray(sp, dtype=float), np.asarray(sf, dtype=float))
    far = sp + sf
    trailing = slowing(sp) - relative(sp) / 2 - 0.3 * relative(far)
    middle = slowing(sp) + slowing(sf) + (relative(sp) - relative(sf)) / 2
    leading = slowing(sf) + relative(sf) / 2 + 0.2 * relative(far)
    return SINGLE + scale * np.stack([trailing, middle, leading], axis=-1)


def constant(sp, sf):
    """U of three spheres that do not feel each other."""
    return np.broadcast_to(SINGLE, (*np.broadcast_shapes(np.shape(sp), np.shape(sf)), 3))


def triplet(sp=DEMO_NODES, sf=DEMO_NODES, law=superposed):
    """The interpolant of a law through nodes."""
    sp, sf = np.asarray(sp, dtype=float), np.asarray(sf, dtype=float)
    return TripletVelocities(sp, sf, law(sp[:, None], sf[None, :]))


def at_deborah(train, deborah):
    """A train as its stage writes it, at a Deborah number of the longest mode."""
    numbers = {name: described(deborah, [], text) for name, text in DEBORAH_NUMBERS.items()}
    error = described(1e-3, [], "error of relative velocities")
    return with_memory_numbers(train.assign(numbers | {"velocity_error": error}))


def dns_result(sp, sf, deborah=(0.0, 1.0), unsolved=()):
    """One geometry's dataset as the dns stage writes it; U grows with De."""
    deborah = np.asarray(deborah, dtype=float)
    velocity = np.stack([superposed(sp, sf, scale=1 + De) for De in deborah])
    status = np.array([1 if De in unsolved else 0 for De in deborah], dtype=np.int8)
    velocity[status != 0] = np.nan
    missing = np.isinf([sp, 0.0, sf])  # a neighbour at infinity is not there
    velocity[:, missing] = np.nan
    return xr.Dataset(
        {
            "velocity": (("deborah", "particle"), velocity),
            "pressure_gradient": ("deborah", np.where(status, np.nan, 32.0 / (1 + deborah))),
            "centreline_velocity": ("deborah", 2.0 - 0.1 * deborah),
            "status": ("deborah", status),
            "reason": ("deborah", np.where(status, "no convergence in 15 iterations", "")),
            "sp": ((), sp),
            "sf": ((), sf),
            "confinement": ((), BETA),
        },
        coords={
            "deborah": deborah,
            "particle": list(PARTICLES),
            "deborah_longest_mode": ("deborah", deborah),
            "deborah_mean_relaxation_time": ("deborah", 0.56 * deborah),
        },
    )
