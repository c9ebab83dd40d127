"""Triplets that are the same flow, so that one simulation is enough for both.

**A pair** has two names. (s, inf) has a trailing and a middle sphere, (inf, s) a middle and a
leading one: the same two spheres. The flow differs by the frame in which it is solved only.

**At De = 0** the flow is linear and does not know its direction, so a triplet and its mirror image
are the same flow: U1(sp, sf) = U3(sf, sp), U2(sp, sf) = U2(sf, sp).

Distances sp and sf are those of the middle sphere to the trailing and to the leading one, in d.
"""

import math
from collections.abc import Collection, Iterable

Triplet = tuple[float, float]


def twin(sp: float, sf: float, deborah: float) -> Triplet | None:
    """The other triplet (sp, sf) that is the same flow at this Deborah number, if there is one."""
    pair = math.isinf(sp) != math.isinf(sf)
    return (sf, sp) if sp != sf and (pair or deborah == 0) else None


def simulated_as(sp: float, sf: float, deborah: float, grid: Collection[Triplet]) -> Triplet:
    """The triplet of a grid by whose simulation a point is known: itself, or its twin.

    Of two twins the one whose sp is smaller is simulated: (s, inf), and at De = 0 sp < sf.
    """
    other = twin(sp, sf, deborah)
    if other is not None and other in grid and other < (sp, sf):
        return other
    return sp, sf


def simulations(
    grid: Collection[Triplet], deborahs: Iterable[float]
) -> dict[Triplet, tuple[float, ...]]:
    """The triplets of a grid that are simulated, each at its Deborah numbers.

    Args:
        grid: All (sp, sf) whose velocities are wanted.
        deborahs: All Deborah numbers, ascending.

    Returns:
        In the order of the grid; every point of it is there once, by itself or by its twin.
    """
    found = {
        triplet: tuple(De for De in deborahs if simulated_as(*triplet, De, grid) == triplet)
        for triplet in grid
    }
    return {triplet: own for triplet, own in found.items() if own}
