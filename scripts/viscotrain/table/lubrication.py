r"""Lubrication: spheres closer than the table reaches, whose gaps never close entirely.

The table ends at a smallest distance s_min > 1. Closer spheres have the velocities V0 that they had
at s_min, changed by the resistance of the gaps between them, which grows as 1/(s - 1). So their
relative velocity goes to zero with the gap, and they never overlap.
"""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

ROUND_OFF = 1e-9  # distances this much below contact are contact
# In d. Three spheres at De = 0, with gaps of 0.01 and 0.02 d, have 0.075, 0.068, 0.054 and 0.036 at
# d/D = 0.2, 0.3, 0.4 and 0.5; a pair at De = 1 and d/D = 0.2 has 0.073 from 0.005 to 0.05 d.
RESISTING_GAP = 0.07
NEGLIGIBLE_FORCE = 1e-18  # over that of a close gap


class ChainMotion(NamedTuple):
    """Velocities in chains of spheres.

    Attributes:
        velocity: V of the spheres, shape (..., N).
        relative: V_{j+1} - V_j, shape (..., N - 1), exact to rounding even where the gap is far
            smaller than the rounding of V.
    """

    velocity: NDArray
    relative: NDArray


def lubricate(velocity: NDArray, gap: NDArray, smallest_gap: float) -> ChainMotion:
    r"""Velocities in chains of spheres, some of which are closer than the table reaches.

    Each gap resists with a force on its two spheres,

        k_j (V_{j+1} - V_j),    k_j = g/(s_j - 1),

    g (`RESISTING_GAP`) being the gap at which it is as large as the resistance of the fluid around
    the spheres. V0 are velocities that hold this force at the distances max(s_j, s_min), so

        V_i = V0_i + (F_i - F_{i-1})/2,    F_j = k_j [V_{j+1} - V_j - m_j (V0_{j+1} - V0_j)],
        m_j = min(1, (s_j - 1)/(s_min - 1)).

    The relative velocity of a pair is V0_rel m (s_min - 1 + g)/(s - 1 + g), and its mean is kept;
    spheres in contact move together. The forces follow from a system that has no infinity,

        F_j (1 + 1/k_j) - (F_{j-1} + F_{j+1})/2 = (1 - m_j)(V0_{j+1} - V0_j).

    A gap that is not close passes on at most 1/(1 + 2/k_j) of a force, so that it is solved where
    that is above `NEGLIGIBLE_FORCE` of it: twelve gaps of 1 d to either side of a close one.

    Args:
        velocity: V0 in any unit, shape (..., N), along the flow; `TripletVelocities.closure`.
        gap: s - 1 of neighbours in d, shape (..., N - 1). Below contact counts as contact.
        smallest_gap: s_min - 1, above 0, where lubrication begins.
    """
    count = velocity.shape[-1]
    chains = velocity.reshape(-1, count)
    moved = _resisted(chains, gap.reshape(len(chains), -1), smallest_gap)
    return ChainMotion(moved[0].reshape(velocity.shape), moved[1].reshape(gap.shape))


@numba.njit(cache=True, error_model="numpy")
def _resisted(free, gap, smallest_gap):
    """Velocities and relative velocities of chains, shape (chains, N); see `lubricate`."""
    velocity, relative = np.empty_like(free), np.empty_like(gap)
    work = np.empty(gap.shape[1]), np.empty(gap.shape[1])
    for chain in range(free.shape[0]):
        V, width, moved = velocity[chain], gap[chain], relative[chain]
        for i in range(V.size):
            V[i] = free[chain, i]
        for j in range(width.size):
            moved[j] = V[j + 1] - V[j]
        felt = _felt(width, smallest_gap)
        begin = 0
        for end in range(width.size + 1):
            if end < width.size and felt[end]:
                continue
            if begin < end:
                part = slice(begin, end)
                _resist(width[part], V[begin : end + 1], moved[part], smallest_gap, work)
            begin = end + 1
    return velocity, relative


@numba.njit(cache=True, error_model="numpy")
def _felt(width, smallest_gap):
    """Which gaps feel a close one, whose force those between pass on; see `lubricate`."""
    felt = np.zeros(width.size, np.bool_)
    for close in range(width.size):
        if width[close] >= smallest_gap:
            continue
        felt[close] = True
        for step in (1, -1):
            j, force = close + step, 1.0
            while 0 <= j < width.size and width[j] >= smallest_gap:
                force /= 1 + 2 * width[j] / RESISTING_GAP
                if force < NEGLIGIBLE_FORCE:
                    break
                felt[j] = True
                j += step
    return felt


@numba.njit(cache=True, error_model="numpy")
def _resist(width, V, moved, smallest_gap, work):
    """Change velocities, shape (n + 1,), and relative ones, (n,), by the forces in n gaps."""
    force, pivot = work
    for j in range(width.size):
        w = max(width[j], 0.0)
        pivot[j] = 1 + w / RESISTING_GAP
        force[j] = (1 - min(w / smallest_gap, 1.0)) * moved[j]
    for j in range(1, width.size):  # forward elimination
        factor = 0.5 / pivot[j - 1]
        pivot[j] -= factor * 0.5
        force[j] += factor * force[j - 1]
    ahead = 0.0
    for j in range(width.size - 1, -1, -1):  # back substitution
        force[j] = ahead = (force[j] + 0.5 * ahead) / pivot[j]
        V[j] += force[j] / 2
    for j in range(width.size):
        V[j + 1] -= force[j] / 2
    for j in range(width.size):
        w = max(width[j], 0.0)
        if w < smallest_gap:  # exact where V[j + 1] and V[j] differ by less than rounding
            moved[j] = force[j] * w / RESISTING_GAP + w / smallest_gap * moved[j]
        else:
            moved[j] = V[j + 1] - V[j]
