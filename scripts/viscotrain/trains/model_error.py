r"""Model error of trains: the same trains by a table and a closure that are a little wrong.

Repeats say how far a statistic scatters by chance, not how wrong the velocities are from which
trains are made. So some of the repeats are simulated again, with the same random numbers, by

- the table with its measured interpolation error: neighbours at a distance of s d are driven apart
  by A f(s) more,

      U_i -> U_i + (A/2) (f(z_i - z_{i-1}) - f(z_{i+1} - z_i)),    f(s) = exp(-(s - 1)/l),

  with the decay length l of pairs. A is such that over the gaps of `table.check`, A f(s) has the
  same mean square as the errors of relative velocities that were found there at this De. True
  errors change their sign between the nodes; one sign at all distances is the worst case, and which
  one is the same: A and -A changed the CV of the demo by -0.0007 and 0.0007;

- the closure one term poorer (`closures.POORER`);

- of spheres that are not equal, the size response (`table.size_response`) plus its error.

With x the mean of a statistic over these repeats, its model error is

    sqrt( (x(table) - x)^2 + (x(closure) - x)^2 + (x(sizes) - x)^2 ).

Random numbers are the same, so what a few repeats tell scatters little. Errors of the simulations
themselves, of rounding or of the time step (1e-3 d) are not in it, nor is what the fluid model
leaves out, or that diameters count to first order. Where the table was not checked its part is
missing, and said so.
"""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import distribution
from viscotrain.trains.closures import POORER, Closure, Velocities, with_memory
from viscotrain.trains.statistics import MEASURES, MODE, MODE_WORDS, Measure, measures
from viscotrain.trains.variables import described
from viscotrain.words import CONTACT


class Shifted(Closure):
    """A closure whose neighbours are driven apart by more, or by less.

    Args:
        closure: The closure.
        amplitude: A in Ubar, with its sign.
        decay: l in d.
    """

    def __init__(self, closure: Closure, amplitude: float, decay: float):
        self._closure, self._amplitude, self._decay = closure, amplitude, decay
        self.smallest_distance, self.slowest = closure.smallest_distance, closure.slowest
        self.isolated, self.reach = closure.isolated, closure.reach

    def free_velocities(self, distance: NDArray, far: NDArray | None = None) -> NDArray:
        """See `Closure.free_velocities`."""
        half = self._amplitude / 2 * envelope(distance, self._decay)
        U = self._closure.free_velocities(distance, far)
        U[1:] += half
        U[:-1] -= half
        return U

    def far(self, distance: NDArray) -> NDArray:
        """See `Closure.far`."""
        return self._closure.far(distance)

    def by_the_first(self, distance: NDArray) -> NDArray:
        """See `Closure.by_the_first`."""
        return self._closure.by_the_first(distance)

    def by_the_last(self, distance: NDArray) -> NDArray:
        """See `Closure.by_the_last`."""
        return self._closure.by_the_last(distance)


def envelope(distance: NDArray, decay: float) -> NDArray:
    """f: how the error falls with the distance, both in d."""
    return np.exp(-(distance - CONTACT) / decay)


def interpolation_error(table: VelocityTable, deborah: float) -> float:
    """The amplitude A, in Ubar, of the errors that `table.check` found at a De; NaN without."""
    layer = table.dataset.isel(deborah=table.index(deborah))
    if "check_error" not in layer or not np.isfinite(layer["check_error"]).any():
        return math.nan
    gaps = np.stack([layer["check_sp"].values, layer["check_sf"].values], axis=-1)
    error = layer["check_error"].transpose("check", "pair").values
    known = np.isfinite(error) & np.isfinite(gaps)  # a sphere that is not there has no gap
    f = envelope(gaps[known], table.at(deborah).decay)
    return float(np.sqrt(np.sum(error[known] ** 2) / np.sum(f**2)))


def variants(
    velocities: Velocities,
    closure: str,
    closed: Closure,
    amplitude: float,
    memory_strength: float = 0.0,
) -> dict[str, Closure]:
    """The closures of the same trains by something a little wrong, by name.

    Args:
        velocities: Of triplets.
        closure: Name of one of `CLOSURES`.
        closed: What it makes of the velocities.
        amplitude: Result of `interpolation_error`.
        memory_strength: That of the closure, see `closures.WithMemory`.
    """
    found: dict[str, Closure] = {}
    if math.isfinite(amplitude):
        found["table"] = Shifted(closed, amplitude, velocities.decay)
    return found | {"closure": with_memory(POORER[closure](velocities), memory_strength)}


def model_error(
    spacing: NDArray,
    wrong: Mapping[str, NDArray],
    mean_spacing: float,
    contact: NDArray | float = CONTACT,
) -> xr.Dataset:
    """Model errors of all statistics, each with `_model_error` behind its name.

    Args:
        spacing: s* in d of the repeats that were simulated again, (repeat, station, passage).
        wrong: The same by each of `variants`.
        mean_spacing: That of an equally spaced train, which sets the range of the bins.
        contact: Distances in d at which spheres touch, of a shape that fits.
    """
    right = _averages(spacing, mean_spacing, contact)
    others = [_averages(s, mean_spacing, contact) for s in wrong.values()]
    variables = {}
    for name in right:
        words, dims = MEASURES.get(name, Measure(MODE_WORDS))
        error = np.linalg.norm([x[name] - right[name] for x in others], axis=0)
        variables[f"{name}_model_error"] = described(
            error, ["station", *dims], f"model error of the {words}"
        )
    return xr.Dataset(variables)


def _averages(
    spacing: NDArray, mean_spacing: float, contact: NDArray | float
) -> dict[str, NDArray]:
    """Means over repeats, and the mode whether or not it means something."""
    found = {name: x.mean(axis=0) for name, x in measures(spacing, mean_spacing, contact).items()}
    edges = distribution.bin_edges(mean_spacing)
    return found | {MODE: distribution.mode(found["spacing_density"], edges)}


def in_words(amplitude: float, repeats: int, unequal: bool = False) -> str:
    """What model errors are made of."""
    table = "the table by its interpolation error"
    if math.isfinite(amplitude):
        table += f", {amplitude:.1e} Ubar at contact"
    else:
        table += " is not in it, table.check has not measured it"
    of = f"{repeats} {'repeat' if repeats == 1 else 'repeats'} simulated again"
    return f"{of}: {table}; the closure one term poorer" + "; the size response" * unequal
