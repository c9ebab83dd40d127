r"""How much diameters may vary: what they add to the scatter of an even train, and how much orders.

Spheres that are not equal drift apart, each with U' e_i (`sizes`). In the linear theory of `order`
that is a constant force on each sphere. In a train that entered evenly the distances, in d, have
after a time t = L/U the variance

    s_g^2 = (1/2 pi) integral over k of 2 (1 - cos k) |c|^2 |(exp(sigma t) - 1)/sigma|^2 dk,
    c = U' v/beta,

with v the coefficient of variation of the diameters and sigma(k) the growth of a disturbance. It
adds to what is left of the scatter with which they entered (`order.remaining_variation`),

    CV(L)^2 = [CV(0) r]^2 + [v g]^2,    r = CV(L)/CV(0) of equal spheres,    g = s_g/(v s).

Without interactions (sigma = 0) s_g = sqrt(2) |c| t; with them what they even out does not go on
growing.

**Largest variation.** A train orders in a channel if it is stable, or neutral, and ordered at the
outlet as the design map has it: CV(L) not above `ordered_variation`. So v may be

    v = sqrt(ordered_variation^2 - [CV(0) r]^2)/g,

and 0 where not even equal spheres order. With CV(0) = 0 it is that of spheres which enter evenly.
CV(0) of a random injection is not small, and close pairs are beyond the linear theory.
"""

import math
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from viscotrain.errors import TrainError
from viscotrain.fluid.channel import ROUND, CrossSection
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.points import incomplete
from viscotrain.table.size_response import demanded, size_response
from viscotrain.trains import order
from viscotrain.trains.closures import CLOSURES, Closure
from viscotrain.trains.injection import channel_volume_fraction, injection_law
from viscotrain.trains.order import Response

WAVE_NUMBERS = np.linspace(0.0, math.pi, 513)  # disturbances travel by many spheres


class Wanted(NamedTuple):
    """What a train has to do.

    Attributes:
        closure: Name of the closure.
        injection: Name of the law by which it enters.
        length: Of the channel, in D.
        ordered_variation: CV of the spacing of a train that counts as ordered.
        section: Of the channel.
    """

    closure: str
    injection: str
    length: float
    ordered_variation: float
    section: CrossSection = ROUND


class Law(NamedTuple):
    """Scatter at the end of a channel by the linear theory.

    Attributes:
        remaining: r, CV(L)/CV(0) of equal spheres.
        by_size: g, CV(L) over the variation of diameters of spheres that entered evenly; NaN where
            U' is not known.
    """

    remaining: NDArray
    by_size: NDArray

    def variation(self, initial: ArrayLike, diameters: ArrayLike) -> NDArray:
        """CV(L) from CV(0) and the variation of diameters, of shapes that fit."""
        diameters = np.asarray(diameters, dtype=float)
        added = np.where(diameters > 0, self.by_size * diameters, 0.0)
        return np.hypot(np.asarray(initial) * self.remaining, added)

    def largest(self, initial: ArrayLike, ordered: float) -> NDArray:
        """Largest variation of diameters with which CV(L) is not above `ordered`; 0 if none is."""
        left = ordered**2 - (np.asarray(initial) * self.remaining) ** 2
        return np.sqrt(np.maximum(left, 0.0)) / self.by_size


def law(answer: Response, confinement: float, response: float, length: ArrayLike) -> Law:
    """What the linear theory says of a train in a channel.

    Args:
        answer: Of the train.
        confinement: d/D.
        response: U' in Ubar.
        length: L in D, of any shape.
    """
    sigma = order.growth(answer, WAVE_NUMBERS, confinement)
    t = np.asarray(length, dtype=float)[..., None] / answer.velocity
    still = sigma == 0  # k = 0: all spheres together
    grown = np.where(still, t, np.expm1(sigma * t) / np.where(still, 1, sigma))
    weight = 2 * (1 - np.cos(WAVE_NUMBERS)) * np.abs(grown) ** 2
    drift = abs(response) / confinement / answer.spacing
    remaining = np.sqrt(_mean(np.exp(2 * sigma.real * t)))
    return Law(remaining, drift * np.sqrt(_mean(weight)))


def _mean(values: NDArray) -> NDArray:
    """Over all k, of a function that is even and periodic in k: the trapezoidal rule."""
    return (values[..., 1:] + values[..., :-1]).mean(axis=-1) / 2


def injected_variation(
    closure: Closure,
    injection: str,
    confinement: float,
    volume_fraction: float,
    section: CrossSection = ROUND,
) -> float:
    """CV(0) of an injection law; NaN where there is no room for as many spheres."""
    try:
        return injection_law(
            injection=injection,
            confinement=confinement,
            volume_fraction=volume_fraction,
            velocity=closure.isolated,
            slowest=closure.slowest,
            section=section,
        ).variation
    except TrainError:
        return math.nan


def with_tolerance(found: xr.Dataset, table: VelocityTable, wanted: Wanted) -> xr.Dataset:
    """What `order.orders` found, and how much diameters may vary at every De and spacing.

    NaN where the table has holes.

    Args:
        found: Over (deborah, spacing), with `confinement`.
        table: Of velocities, the same.
        wanted: Of the trains.
    """
    beta, broken = float(found["confinement"]), incomplete(table.dataset)
    rows: list[list] = []
    for De in found["deborah"].values:
        if De in broken:
            rows += [[math.nan] * len(OF_TRAINS)] * found.sizes["spacing"]
            continue
        model, U = CLOSURES[wanted.closure](table.at(De)), size_response(table, De).value
        for s in found["spacing"].values:
            own = law(order.response(model, float(s)), beta, U, wanted.length)
            phi = wanted.section.mean_spacing(beta, 1.0) / s
            initial = injected_variation(model, wanted.injection, beta, phi, wanted.section)
            may = (own.largest(start, wanted.ordered_variation) for start in (initial, 0))
            rows.append([initial, own.by_size, *may])
    shape = found.sizes["deborah"], found.sizes["spacing"], len(OF_TRAINS)
    columns = np.moveaxis(np.array(rows, dtype=float).reshape(shape), -1, 0)
    values = dict(zip(OF_TRAINS, columns, strict=True))
    stable = found["stability"].values >= 0
    values |= {name: np.where(stable, values[name], np.nan) for name in LARGEST}
    new = {name: (("deborah", "spacing"), values[name]) for name in OF_TRAINS}
    tolerant = found.assign(new).assign(
        length=wanted.length, ordered_variation=wanted.ordered_variation
    )
    for name, words in ATTRIBUTES.items():
        tolerant[name].attrs = words
    return tolerant


LARGEST = ("largest_variation", "largest_variation_even")
OF_TRAINS = ("injected_variation", "variation_by_size", *LARGEST)
ATTRIBUTES: dict[str, dict] = {
    "length": {"long_name": "length of the channel over its diameter", "units": "1"},
    "ordered_variation": {
        "long_name": "coefficient of variation of the spacing of a train that counts as ordered",
        "units": "1",
    },
    "variation_by_size": {
        "long_name": "coefficient of variation of the spacing at the outlet, of spheres that "
        "entered evenly, over that of their diameters",
        "units": "1",
    },
    "injected_variation": {
        "long_name": "coefficient of variation of the spacing as spheres enter",
        "units": "1",
        "comment": "NaN: no room for as many spheres",
    },
    "largest_variation": {
        "long_name": "largest coefficient of variation of diameters with which the train is "
        "ordered at the outlet",
        "units": "1",
        "comment": "0: not even equal spheres are; NaN: unstable, or U' not known",
    },
    "largest_variation_even": {
        "long_name": "the same if spheres enter evenly",
        "units": "1",
        "comment": "NaN: unstable, or U' not known",
    },
}


def of_condition(
    table: VelocityTable, deborah: float, volume_fraction: float, wanted: Wanted, feed: bool = False
) -> str:
    """One condition in a line: whether it orders, and how much diameters may vary.

    Args:
        table: Of velocities.
        deborah: One of its Deborah numbers.
        volume_fraction: phi in the channel, or phi_feed.
        wanted: Of the train.
        feed: Whether the volume fraction is that of what is poured in.
    """
    if deborah in incomplete(table.dataset):
        return f"De = {deborah:g}: not known, the table has holes"
    beta, model = table.confinement, CLOSURES[wanted.closure](table.at(deborah))
    phi = channel_volume_fraction(volume_fraction, model.isolated) if feed else volume_fraction
    answer = order.response(model, wanted.section.mean_spacing(beta, phi))
    name = f"De = {deborah:g}, phi = {100 * phi:.3g} %"
    if order.stability(answer, beta) < 0:
        return f"{name}: an even train is unstable"
    own = law(answer, beta, size_response(table, deborah).value, wanted.length)
    initial = injected_variation(model, wanted.injection, beta, phi, wanted.section)
    after = float(own.variation(initial, 0))
    equal = f"{name}: equal spheres, CV {initial:.2f} -> {after:.2f} by the linear law"
    if math.isnan(own.by_size):
        return f"{equal}; the table does not say what diameters change"
    may = [_per_cent(float(own.largest(start, wanted.ordered_variation))) for start in (initial, 0)]
    even = f"by {may[1]} if spheres enter evenly"
    return f"{equal}, which knows no close pairs; diameters may vary by {may[0]}, {even}"


def _per_cent(variation: float) -> str:
    return f"{100 * variation:.2g} % at most" if variation > 0 else "nothing, it does not order"


def of_one_train(
    table: VelocityTable, deborah: float, spacing: float, variation: float, wanted: Wanted
) -> str:
    """Lines about spheres that enter evenly, spacing in d, whose diameters vary by so much."""
    beta = table.confinement
    answer = order.response(CLOSURES[wanted.closure](table.at(deborah)), spacing)
    response = demanded(table, deborah)
    own = law(answer, beta, response.value, wanted.length)
    most = float(own.largest(0, wanted.ordered_variation))
    return (
        f"  U' = {response.value:.3e} +- {response.error:.0e} Ubar: diameters that vary by "
        f"{100 * variation:.3g} % make a CV of\n"
        f"  {float(own.variation(0, variation)):.2f} in {wanted.length:g} D, if spheres enter "
        f"evenly; up to {100 * most:.2g} % it stays below {wanted.ordered_variation:g}"
    )
