r"""Linear stability of an equally spaced train: does it order, and along which length of channel?

All distances s, in d, and velocity U, in Ubar. Moving one sphere changes the velocities of all by

    C_m = dU_i/dz_{i+m},    sum over m of C_m = 0    (z in d),

with the closure of the train. A disturbance exp(i j k + sigma t) of the positions z_j grows at

    sigma(k) = (1/beta) sum over m of C_m (exp(i m k) - 1)    (in Ubar/D),

so with neighbours only, A = dU_2/dsp and B = dU_2/dsf at (s, s),

    Re sigma = (A - B)(1 - cos k)/beta,    Im sigma = (A + B) sin k/beta.

The train is stable where Re sigma < 0 for all k: with neighbours only where B > A. Neighbours that
move towards and away from each other, k = pi, are the fastest: they decay by e over the ordering
length

    l = -U/Re sigma(pi)    (in D).

Random distances, white noise, have a coefficient of variation that falls along the channel as

    CV(L)^2/CV(0)^2 = (1/2 pi) integral over k of exp(2 Re sigma(k) L/U),

which with neighbours only is exp(-x) I_0(x), x = L/l, I_0 the modified Bessel function: long waves
die slowly, and no channel makes a perfect train.

At De = 0 the flow is reversible: A = B, and a train neither orders nor gets less even. Rates below
`NEUTRAL` are taken as this: they are of the table's errors, and no channel is as long.

The memory of gaps (`closures.WithMemory`) is of second order in relative velocities, which an even
train does not have, so it changes none of this.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar
from scipy.special import ive

from viscotrain.errors import TrainError
from viscotrain.fluid.channel import ROUND, CrossSection
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.points import incomplete
from viscotrain.trains.closures import CLOSURES, Closure
from viscotrain.words import CONTACT, MIDDLE

SHIFT = 1e-3  # d: far less than the distances over which velocities change
FARTHEST_FELT = 60.0  # d from the sphere that is moved
FEWEST_ON_A_SIDE = 4
CLOSEST_SPACING, FARTHEST_SPACING = 1.2, 15.0  # d, of trains that may order
NEUTRAL = 1e-6  # Ubar/D: with it l is 10^6 D
STABILITY = {1: "stable", 0: "neutral", -1: "unstable"}
WAVE_NUMBERS = np.linspace(0.0, math.pi, 65)


class Response(NamedTuple):
    """How an equally spaced train answers when one sphere is moved.

    Attributes:
        spacing: s in d.
        velocity: U of all spheres, in Ubar.
        slopes: C_m, m = -n ... n, in Ubar/d.
        from_behind: A in Ubar/d.
        from_ahead: B in Ubar/d.
    """

    spacing: float
    velocity: float
    slopes: NDArray
    from_behind: float
    from_ahead: float


def response(closure: Closure, spacing: float) -> Response:
    """Move one sphere of a long train by `SHIFT` both ways.

    Args:
        closure: Velocities of trains.
        spacing: s in d, above contact.
    """
    side = max(FEWEST_ON_A_SIDE, math.ceil(FARTHEST_FELT / spacing))
    even = np.full(6 * side, spacing)
    middle = 3 * side
    moved = np.zeros_like(even)
    moved[middle - 1 : middle + 1] = 1, -1
    there, back = (closure.free_velocities(even + sign * SHIFT * moved) for sign in (1, -1))
    change = (there - back)[middle - side : middle + side + 1] / (2 * SHIFT)
    velocity = closure.free_velocities(even)[middle]
    return Response(spacing, float(velocity), change[::-1], *_of_neighbours(closure, spacing))


def _of_neighbours(closure: Closure, s: float) -> tuple[float, float]:
    """A and B."""
    sp = np.array([s + SHIFT, s - SHIFT, s, s])
    U = closure.triplets.closure(sp, sp[[2, 3, 0, 1]], MIDDLE)
    return float(U[0] - U[1]) / (2 * SHIFT), float(U[2] - U[3]) / (2 * SHIFT)


def growth(answer: Response, wave_number: ArrayLike, confinement: float) -> NDArray:
    """sigma, complex, in Ubar/D, of disturbances with phases k between neighbours.

    Args:
        answer: Of the train.
        wave_number: k, of any shape.
        confinement: d/D.
    """
    n = answer.slopes.size // 2
    m = np.arange(-n, n + 1)
    k = np.asarray(wave_number, dtype=float)[..., None]
    return ((np.exp(1j * k * m) - 1) @ answer.slopes) / confinement


def ordering_length(answer: Response, confinement: float) -> float:
    """Length l in D along which the fastest disturbance decays by e; infinite where it grows."""
    rate = -growth(answer, math.pi, confinement).real
    return float(answer.velocity / rate) if rate > NEUTRAL else math.inf


def stability(answer: Response, confinement: float) -> int:
    """1 where every disturbance decays, -1 where one grows, 0 where neither is true."""
    k = WAVE_NUMBERS[1:]
    rate = growth(answer, k, confinement).real / ((1 - np.cos(k)) / 2)
    if rate.max() > NEUTRAL:
        return -1
    return int(rate.max() < -NEUTRAL)


def remaining_variation(growth_rate: NDArray, velocity: ArrayLike, length: ArrayLike) -> NDArray:
    """CV(L)/CV(0) of small random distances.

    Args:
        growth_rate: Re sigma in Ubar/D at `WAVE_NUMBERS`, shape (..., k).
        velocity: U in Ubar, shape (...).
        length: L in D, broadcasts with (...).
    """
    exposed = np.asarray(length, dtype=float) / np.asarray(velocity, dtype=float)
    remains = np.exp(2 * growth_rate * exposed[..., None])
    # even and periodic in k, for which the trapezoidal rule is exact to round-off
    return np.sqrt((remains[..., 1:] + remains[..., :-1]).mean(axis=-1) / 2)


def law(length: ArrayLike, ordering: float) -> NDArray:
    """CV(L)/CV(0) with neighbours only: sqrt(exp(-x) I_0(x)), x = L/l."""
    return np.sqrt(ive(0, np.asarray(length, dtype=float) / ordering))


def orders(
    table: VelocityTable,
    confinement: float,
    closure: str = "every_sphere",
    spacing: ArrayLike | None = None,
    section: CrossSection = ROUND,
    deborah: Sequence[float] | None = None,
) -> xr.Dataset:
    """Stability and ordering length at each Deborah number and spacing.

    Args:
        table: Of velocities.
        confinement: d/D.
        closure: Name of the closure, of `closures.CLOSURES`.
        spacing: Distances of neighbours in d; None for some from contact to `FARTHEST_SPACING`.
        section: Of the channel, for the volume fraction.
        deborah: Some of the table's Deborah numbers; None for all.

    Returns:
        NaN, which is not known, at Deborah numbers at which the table has holes.

    Raises:
        TableError: The table has holes at all of them.
    """
    spacing = spacings(table) if spacing is None else np.asarray(spacing, dtype=float)
    deborah = list(table.deborah if deborah is None else deborah)
    broken = incomplete(table.dataset)
    known = [De for De in deborah if De not in broken]
    rows = []
    for De in known or deborah:
        model = CLOSURES[closure](table.at(De))
        rows.append([_row(model, float(s), confinement) for s in spacing])
    names = list(rows[0][0])
    found = xr.Dataset(
        {
            name: (
                ("deborah", "spacing", "wave_number")[: 2 + np.ndim(rows[0][0][name])],
                np.array([[row[name] for row in line] for line in rows]),
            )
            for name in names
        },
        coords={
            "deborah": known,
            "spacing": spacing,
            "wave_number": WAVE_NUMBERS,
            "volume_fraction": ("spacing", section.mean_spacing(confinement, 1.0) / spacing),
        },
        attrs=section.attributes,
    ).assign(confinement=confinement)
    for name, attributes in ATTRIBUTES.items():
        found[name].attrs = attributes
    return found.reindex(deborah=deborah)


def spacings(table: VelocityTable, farthest: float = FARTHEST_SPACING, count: int = 96) -> NDArray:
    """So many distances of neighbours in d, evenly on a logarithmic axis, from about contact."""
    return np.geomspace(max(CLOSEST_SPACING, table.smallest_distance), farthest, count)


def _row(closure: Closure, spacing: float, confinement: float) -> dict:
    answer = response(closure, spacing)
    sigma = growth(answer, WAVE_NUMBERS, confinement)
    return {
        "velocity": answer.velocity,
        "slope_behind": answer.from_behind,
        "slope_ahead": answer.from_ahead,
        "growth_rate": sigma.real,
        "frequency": sigma.imag,
        "stability": stability(answer, confinement),
        "ordering_length": ordering_length(answer, confinement),
    }


def most_stable(
    table: VelocityTable, deborah: float, confinement: float, closure: str = "every_sphere"
) -> tuple[float, float]:
    """The spacing in d that orders along the shortest length, and this length in D.

    NaN and infinity where no spacing up to `FARTHEST_SPACING` is stable.
    """
    model = CLOSURES[closure](table.at(deborah))

    def inverse(log_spacing: float) -> float:
        return -1 / ordering_length(response(model, math.exp(log_spacing)), confinement)

    low = math.log(max(CLOSEST_SPACING, table.smallest_distance))
    trial = np.linspace(low, math.log(FARTHEST_SPACING), 60)
    best = int(np.argmin([inverse(x) for x in trial]))
    if inverse(trial[best]) == 0:
        return math.nan, math.inf
    near = trial[max(best - 1, 0)], trial[min(best + 1, trial.size - 1)]
    found = minimize_scalar(inverse, bounds=near, method="bounded")
    return math.exp(found.x), -1 / found.fun


def summary(found: xr.Dataset, length: float) -> str:
    """What was found in words, a line per Deborah number, for a channel of this length in D."""
    lines = [found.attrs["channel"]] if "channel" in found.attrs else []
    for De in found["deborah"].values:
        own = found.sel(deborah=De)
        shortest = own["ordering_length"].values
        if np.isnan(shortest).all():
            lines.append(f"De = {De:g}: not known, the table has holes")
            continue
        if not np.isfinite(shortest).any():
            lines.append(f"De = {De:g}: no spacing orders")
            continue
        best = own.isel(spacing=int(np.argmin(shortest)))
        lines.append(
            f"De = {De:g}: orders fastest at s = {float(best['spacing']):.2g} d, "
            f"phi = {100 * float(best['volume_fraction']):.2g} %, "
            f"along {float(best['ordering_length']):.3g} D ({length:g} D there are)"
        )
    return "\n".join(lines)


def of_one_train(table: VelocityTable, deborah: float, spacing: float) -> str:
    """A few lines about one spacing in d.

    Raises:
        TrainError: Spheres of this spacing overlap.
    """
    if not spacing > CONTACT:
        raise TrainError(f"spacing is {spacing:g} d; allowed: above {CONTACT:g} (contact)")
    beta = table.confinement
    answer = response(CLOSURES["every_sphere"](table.at(deborah)), spacing)
    length = ordering_length(answer, beta)
    phi = ROUND.mean_spacing(beta, 1.0) / spacing
    best, shortest = most_stable(table, deborah, beta)
    words = f"along l = {length:.4g} D" if math.isfinite(length) else "at no length"
    lines = [
        f"De = {deborah:g}, d/D = {beta:g}, s = {spacing:g} d (phi = {100 * phi:.3g} % in a tube)",
        f"  A = {answer.from_behind:.3e}, B = {answer.from_ahead:.3e} Ubar/d",
        f"  the train is {STABILITY[stability(answer, beta)]}; neighbours even out by e {words}",
        f"  fastest: s = {best:.3g} d, along {shortest:.4g} D",
    ]
    if math.isfinite(length):
        rate = growth(answer, WAVE_NUMBERS, beta).real
        left = remaining_variation(rate, answer.velocity, length * np.array([1.0, 3.0, 10.0]))
        shares = ", ".join(f"{share:.2f}" for share in left)
        lines.append(f"  CV(L)/CV(0) after 1, 3, 10 l: {shares}")
    return "\n".join(lines)


ATTRIBUTES: dict[str, dict] = {
    "spacing": {
        "long_name": "distance of neighbours, centre to centre over diameter",
        "units": "1",
    },
    "wave_number": {"long_name": "phase of a disturbance between neighbours", "units": "radian"},
    "volume_fraction": {"long_name": "volume fraction of spheres in the channel", "units": "1"},
    "confinement": {"long_name": "sphere diameter over channel diameter", "units": "1"},
    "velocity": {"long_name": "velocity of the train over mean velocity of the flow", "units": "1"},
    "slope_behind": {
        "long_name": "A: change of a sphere's velocity with the distance to the sphere behind, "
        "over mean velocity, per diameter",
        "units": "1",
    },
    "slope_ahead": {
        "long_name": "B: the same with the distance to the sphere ahead",
        "units": "1",
    },
    "growth_rate": {
        "long_name": "real part of sigma, times channel diameter over mean velocity",
        "units": "1",
    },
    "frequency": {
        "long_name": "imaginary part of sigma, times channel diameter over mean velocity",
        "units": "1",
    },
    "stability": {
        "long_name": "1 where every disturbance decays, -1 where one grows, 0 where none does more "
        "than the table's errors",
        "units": "1",
    },
    "ordering_length": {
        "long_name": "length along which the fastest disturbance decays by e, over channel "
        "diameter; infinite where it grows",
        "units": "1",
    },
}
