"""Triplets that are the same flow, so that one simulation is enough for both.

**A pair** has two names. (s, inf) has a trailing and a middle sphere, (inf, s) a middle and a
leading one: the same two spheres. The flow differs by the frame in which it is solved only.

**At De = 0** the flow is linear and does not know its direction, so a triplet and its mirror image
are the same flow: U1(sp, sf) = U3(sf, sp), U2(sp, sf) = U2(sf, sp).

Distances sp and sf are those of the middle sphere to the trailing and to the leading one, in d.
"""

import math
from collections.abc import Collection, Mapping, Sequence

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
    wanted: Mapping[float, Collection[Triplet]],
) -> dict[Triplet, tuple[float, ...]]:
    """The triplets that are simulated, each at its Deborah numbers.

    Args:
        wanted: By Deborah number, ascending, all (sp, sf) whose velocities are wanted there.

    Returns:
        In the order in which they are wanted; every point is there once, by itself or by its twin.
    """
    found: dict[Triplet, list[float]] = {}
    for De, triplets in wanted.items():
        own = dict.fromkeys(triplets)
        for triplet in own:
            if simulated_as(*triplet, De, own) == triplet:
                found.setdefault(triplet, []).append(De)
    return {triplet: tuple(deborahs) for triplet, deborahs in found.items()}


def on_lines(distances: Sequence[float], spacing: int) -> list[float]:
    """Every so many of the finite distances from the first one on, and infinity; all for 1.

    Not the last finite one: it takes the longest periods, and a third sphere adds the least there.
    """
    if spacing == 1:
        return list(distances)
    return [*distances[: max(len(distances) - 2, 1) : spacing], distances[-1]]
