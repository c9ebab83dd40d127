"""Which geometries a study simulates, for its grid and between the nodes of it."""

import itertools
import math
from collections.abc import Sequence
from functools import lru_cache

from viscotrain.config.problems import INFINITY
from viscotrain.config.study import Study
from viscotrain.table.triplets import Triplet, simulations


def check_geometries(study: Study) -> tuple[tuple[float, float], ...]:
    """The `table.check` geometries between the nodes, where interpolation is compared with DNS.

    Each lies in the middle, in 1/s, of a cell of its own. The first cell is the one next to
    contact; the others follow a low-discrepancy sequence (R2, M. Roberts 2018), so a larger number
    keeps the earlier points. Cells that reach to infinity count only where an axis has no other.
    """
    cells_sp, cells_sf = _cell_middles(study.table.sp), _cell_middles(study.table.sf)
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
def simulated(study: Study) -> dict[Triplet, tuple[float, ...]]:
    """Geometries (sp, sf) that are simulated, grid and check, each at its Deborah numbers.

    Flows that are the same are simulated once, see `triplets`.
    """
    deborahs = study.deborah.values
    checks = simulations(check_geometries(study), deborahs)
    return simulations(study.geometries, deborahs) | checks


def simulated_deborahs(study: Study, sp: float, sf: float) -> tuple[float, ...]:
    """Deborah numbers at which a geometry is simulated; all of them for one of no table."""
    return simulated(study).get((sp, sf), study.deborah.values)


def _cell_middles(nodes: Sequence[float]) -> list[float]:
    """Middles in 1/s, to four digits, of the cells between finite nodes."""
    finite = [s for s in nodes if math.isfinite(s)]
    nodes = finite if len(finite) > 1 else [*finite, INFINITY]
    middles = []
    for low, high in itertools.pairwise(nodes):
        middle = 2 / (1 / low + 1 / high)
        rounded = float(f"{middle:.4g}")
        middles.append(rounded if low < rounded < high else middle)
    return middles
