r"""Spheres that are not equal: their diameters, and what these change in a train.

With e_i = (d_i - d)/d, to first order in all of them,

    U_i = closure + U' e_i,    contact of neighbours at 1 + (e_i + e_j)/2,

U' being the size response (`table.size_response`) and distances those of centres in d. How two
spheres act on each other is that of equal ones. The term in U' is of a single sphere in a steady
flow, so it has no part in the memory of gaps (`closures.WithMemory`), whose coefficient is that of
what neighbours do to each other.

Diameters are normally distributed, cut at `CUT` standard deviations; their coefficient of variation
is that of what is drawn. They have random numbers of their own, so that trains of equal spheres and
of others enter at the same times.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viscotrain.words import CONTACT

CUT = 3.0  # standard deviations
# Standard deviation of a normal deviate cut there: sqrt(1 - 2 c phi(c)/(2 Phi(c) - 1)).
KEPT = math.sqrt(
    1 - 2 * CUT * math.exp(-(CUT**2) / 2) / math.sqrt(2 * math.pi) / math.erf(CUT / math.sqrt(2))
)


@dataclass(frozen=True)
class Sizes:
    """How diameters vary, and what that changes.

    Attributes:
        variation: Coefficient of variation of the diameters.
        response: U' in Ubar.
    """

    variation: float = 0.0
    response: float = 0.0

    def draw(self, rng: np.random.Generator) -> float:
        """The e of a sphere."""
        if self.variation == 0:
            return 0.0
        deviate = rng.standard_normal()
        while abs(deviate) > CUT:
            deviate = rng.standard_normal()
        return self.variation / KEPT * deviate


EQUAL = Sizes()


def contact(deviation: NDArray) -> NDArray:
    """Distances in d at which neighbours touch, shape (..., N - 1), from e, shape (..., N)."""
    return CONTACT + (deviation[..., 1:] + deviation[..., :-1]) / 2
