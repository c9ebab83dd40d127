r"""Memory number: by how many diameters a gap changes within a relaxation time.

    M = lambda_1 |ds/dt| = De |dU|/beta,

with De = lambda_1 Ubar/D of the longest relaxation time, dU the relative velocity of two neighbours
in Ubar, and beta = d/D. The stress around spheres remembers lambda_1; the table, whose distances
are held, is the limit of small M. `words.QUASI_STEADY_LIMIT` says how far it is trusted.
"""

import numpy as np
import xarray as xr

from viscotrain.table.attributes import described
from viscotrain.words import quasi_steady_remark


def memory_number(deborah_longest_mode, relative_velocity, confinement):
    """M of relative velocities in Ubar; scalars, or arrays of shapes that fit."""
    return deborah_longest_mode * abs(relative_velocity) / confinement


def with_memory_numbers(table: xr.Dataset, confinement: float) -> xr.Dataset:
    """The table with M of its points, the larger one of both gaps, and of pairs alone.

    Args:
        table: As `assembly.combine` makes it.
        confinement: d/D.

    Returns:
        With `memory_number` (deborah, sp, sf), where a sphere that is not there has no gap, and
        `pair_memory_number` (deborah, pair_distance); NaN where there is no solution.
    """
    De = table["deborah_longest_mode"].values
    U = table["velocity"].transpose("deborah", "sp", "sf", "particle").values
    relative = np.diff(U, axis=-1)
    relative[:, np.isinf(table["sp"].values), :, 0] = 0.0
    relative[:, :, np.isinf(table["sf"].values), 1] = 0.0
    M = memory_number(De[:, None, None, None], relative, confinement).max(axis=-1)
    pair = table["pair_velocity"].transpose("deborah", "pair_distance", "particle_of_pair").values
    of_pair = memory_number(De[:, None], np.diff(pair, axis=-1)[..., 0], confinement)
    return described(
        table.assign(
            memory_number=(("deborah", "sp", "sf"), M),
            pair_memory_number=(("deborah", "pair_distance"), of_pair),
        )
    )


def largest(dataset: xr.Dataset, name: str = "memory_number") -> float:
    """Largest M of a table, of a layer or of a train; NaN if none is known."""
    return float(dataset[name].max())


def remark(dataset: xr.Dataset, name: str = "memory_number") -> str:
    """Says that the largest M is beyond the quasi-steady range; else empty."""
    return quasi_steady_remark(largest(dataset, name))
