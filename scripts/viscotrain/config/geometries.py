"""Which geometries a study simulates, for its grid and between the nodes of it."""

import itertools
import math
from collections.abc import Sequence
from functools import lru_cache

from viscotrain.config.problems import INFINITY
from viscotrain.config.study import Study
from viscotrain.table.triplets import Triplet, on_lines, simulations

FARTHEST_PAIR = 12.0  # d, that pairs reach at least
FARTHER = 1.5  # ratio of two distances of pairs beyond those of triplets
SIZE_STEP = 0.05  # of diameters, over the diameter; what beads vary by


def check_geometries(study: Study) -> tuple[tuple[float, float], ...]:
    """The `table.check` geometries between the nodes, where interpolation is compared with DNS.

    Each lies in the middle, in 1/s, of a cell of its own. The first cell is the one next to
    contact; the others follow a low-discrepancy sequence (R2, M. Roberts 2018), so a larger number
    keeps the earlier points. Cells that reach to infinity are among them.
    """
    cells_sp, cells_sf = _middles(study.table.sp), _middles(study.table.sf)
    wanted = min(study.table.check, len(cells_sp) * len(cells_sf))
    plastic = 1.324717957244746  # root of x^3 = x + 1, from which R2 takes its two steps
    chosen: dict[tuple[float, float], None] = {}
    for k in itertools.count():
        if len(chosen) == wanted:
            break
        sp = cells_sp[int(k / plastic % 1 * len(cells_sp))]
        sf = cells_sf[int(k / plastic**2 % 1 * len(cells_sf))]
        chosen[sp, sf] = None
    return tuple(chosen)


@lru_cache(maxsize=8)
def pair_distances(study: Study) -> tuple[float, ...]:
    """Distances at which two spheres alone are simulated, in d, ascending.

    Pairs have one distance only, so they are resolved more finely than triplets: by default also
    in the middles, in 1/s, between the distances of triplets, and beyond them to `FARTHEST_PAIR`.
    """
    own = sorted({s for s in (*study.table.sp, *study.table.sf) if math.isfinite(s)})
    if study.table.pair is not None:
        return tuple(sorted({*own, *study.table.pair}))
    every = sorted({*own, *_middles(own)})
    while every and every[-1] < FARTHEST_PAIR:
        every.append(float(f"{every[-1] * FARTHER:.4g}"))
    return tuple(every)


def diameter_ratios(study: Study) -> tuple[float, ...]:
    """Diameters, over that of the study, of the single spheres that tell how velocities follow it.

    Two on either side, the farther ones at twice the step. In a narrow channel they are closer, so
    that all of them fit into it.
    """
    step = SIZE_STEP * min(1.0, 1 / study.confinement - 1)
    return tuple(float(f"{1 + n * step:.6g}") for n in (-2, -1, 1, 2))


def wanted(study: Study) -> tuple[Triplet, ...]:
    """Triplets (sp, sf) of the table whose velocities are simulated: on lines of its grid."""
    sp, sf = (on_lines(axis, study.table.line_spacing) for axis in (study.table.sp, study.table.sf))
    triplets = [(p, f) for p, f in study.geometries if p in sp or f in sf]
    pairs = [(s, INFINITY) for s in pair_distances(study)]
    return tuple(dict.fromkeys([*triplets, *pairs]))


@lru_cache(maxsize=8)
def simulated(study: Study) -> dict[Triplet, tuple[float, ...]]:
    """Geometries (sp, sf) that are simulated, grid and check, each at its Deborah numbers.

    Flows that are the same are simulated once, see `triplets`.
    """
    deborahs = study.deborah.values
    own = simulations(dict.fromkeys(deborahs, wanted(study)))
    checks = simulations(dict.fromkeys(deborahs, check_geometries(study)))
    return own | {geometry: checks[geometry] for geometry in checks if geometry not in own}


def simulated_deborahs(study: Study, sp: float, sf: float) -> tuple[float, ...]:
    """Deborah numbers at which a geometry is simulated; all of them for one of no table."""
    return simulated(study).get((sp, sf), study.deborah.values)


def _middles(nodes: Sequence[float]) -> list[float]:
    """Middles in 1/s, to four digits, of the cells between nodes."""
    middles = []
    for low, high in itertools.pairwise(nodes):
        middle = 2 / (1 / low + 1 / high)
        rounded = float(f"{middle:.4g}")
        middles.append(rounded if low < rounded < high else middle)
    return middles
