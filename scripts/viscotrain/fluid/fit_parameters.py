"""Parameters of a fit: which numbers of a fluid are fitted, under which names, as which vector.

A vector holds ln eta_s, then ln eta_k, ln lambda_k and alpha_k of each mode, without those that are
known. Numbers that are known of single modes are given by position, the slowest mode first.
"""

import itertools
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from viscotrain.errors import DataError
from viscotrain.fluid.parameters import Fluid, Mode

OF_A_MODE = ("viscosity", "relaxation_time", "mobility")


@dataclass(frozen=True)
class Known:
    """What is known of a fluid before the fit: in Pa s, s and 1, None = to be found.

    Args:
        solvent_viscosity: In Pa s.
        relaxation_times: In s, of the first modes, the slowest one first.
        mobilities: Of the first modes, in the same order.
    """

    solvent_viscosity: float | None = None
    relaxation_times: tuple[float | None, ...] = ()
    mobilities: tuple[float | None, ...] = ()

    def __post_init__(self):
        times = [time for time in self.relaxation_times if time is not None]
        falling = all(slow > fast for slow, fast in itertools.pairwise(times))
        if not falling or not all(time > 0 for time in times):
            raise DataError(f"known relaxation times {times}; allowed: above 0, slowest first")
        for alpha in self.mobilities:
            if alpha is not None and not 0 <= alpha < 1:
                raise DataError(f"known mobility {alpha:g}; allowed: number in [0, 1)")

    @property
    def fewest_modes(self) -> int:
        """Modes that there are at least."""
        return max(len(self.relaxation_times), len(self.mobilities))


class Layout:
    """The vector of a fluid with some modes.

    Attributes:
        names: Of what is fitted, as in the config: solvent_viscosity, modes[0].viscosity, ...
        logarithmic: Whether the vector holds a logarithm, shape (p,).
    """

    def __init__(self, count: int, known: Known):
        self.count = count
        self._fixed = _values(count, known)
        self._free = np.flatnonzero(np.isnan(self._fixed))
        of_modes = (f"modes[{k}].{name}" for k in range(count) for name in OF_A_MODE)
        all_names = ("solvent_viscosity", *of_modes)
        self.names = tuple(all_names[k] for k in self._free)
        self.logarithmic = logarithmic(self.names)

    @property
    def size(self) -> int:
        """How many parameters are fitted, p."""
        return self._free.size

    def fluid(self, vector: NDArray) -> Fluid:
        """The fluid of a vector, its modes in the same order."""
        full = self._fixed.copy()
        full[self._free] = np.where(self.logarithmic, np.exp(vector), vector)
        return Fluid(
            float(full[0]), tuple(Mode(*map(float, row)) for row in full[1:].reshape(-1, 3))
        )

    def vector(self, full: NDArray) -> NDArray:
        """The part that is fitted of eta_s and of all modes' numbers, shape (1 + 3 modes,)."""
        own = full[self._free]
        return np.where(self.logarithmic, np.log(np.where(self.logarithmic, own, 1.0)), own)

    def times(self, chosen: Sequence[float]) -> list[float]:
        """Relaxation times of all modes, those that are not known in order of what is given."""
        left = iter(chosen)
        return [next(left) if math.isnan(time) else float(time) for time in self._fixed[2::3]]

    def mobilities(self, otherwise: float) -> list[float]:
        """Mobilities of all modes, and a value where they are not known."""
        return [otherwise if math.isnan(alpha) else float(alpha) for alpha in self._fixed[3::3]]

    def unknown_times(self) -> int:
        """How many relaxation times are fitted."""
        return int(np.isnan(self._fixed[2::3]).sum())

    def slowest_first(self, vector: NDArray) -> NDArray:
        """Indices that put modes, of which no number is known, in the order of their times."""
        own = [k for k in range(self.count) if np.isnan(self._fixed[1 + 3 * k : 4 + 3 * k]).all()]
        times = [mode.relaxation_time for mode in self.fluid(vector).modes]
        order = np.arange(self._fixed.size)
        for k, source in zip(own, sorted(own, key=lambda k: -times[k]), strict=True):
            order[1 + 3 * k : 4 + 3 * k] = np.arange(1 + 3 * source, 4 + 3 * source)
        place = {int(at): n for n, at in enumerate(self._free)}
        return np.array([place[int(at)] for at in order[self._free]], dtype=int)


def _values(count: int, known: Known) -> NDArray:
    """eta_s and all modes' numbers, NaN where they are fitted, shape (1 + 3 count,)."""
    full = np.full(1 + 3 * count, math.nan)
    full[0] = _or_nan(known.solvent_viscosity)
    for first, values in ((2, known.relaxation_times), (3, known.mobilities)):
        for k, value in enumerate(values):
            full[first + 3 * k] = _or_nan(value)
    return full


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def logarithmic(names: Sequence[str]) -> NDArray:
    """Whether a fit has the logarithm of each parameter: not of mobilities, which may be 0."""
    return np.array([not name.endswith("mobility") for name in names], dtype=bool)


def with_values(fluid: Fluid, names: Sequence[str], values: Iterable[float]) -> Fluid:
    """The fluid with other values of the parameters of these names."""
    modes = list(fluid.modes)
    for name, value in zip(names, values, strict=True):
        k, key = _place(name)
        if k is None:
            fluid = replace(fluid, solvent_viscosity=float(value))
        else:
            modes[k] = replace(modes[k], **{key: float(value)})
    return replace(fluid, modes=tuple(modes))


def values_of(fluid: Fluid, names: Sequence[str]) -> list[float]:
    """Values of the parameters of these names."""
    places = map(_place, names)
    return [getattr(fluid if k is None else fluid.modes[k], key) for k, key in places]


def _place(name: str) -> tuple[int | None, str]:
    """Mode and key of modes[0].viscosity; no mode of the solvent."""
    found = re.fullmatch(r"modes\[(\d+)\]\.(\w+)", name)
    return (int(found[1]), found[2]) if found else (None, name)
