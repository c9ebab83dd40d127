r"""Lubrication: spheres closer than the table reaches, whose gaps never close entirely.

The table ends at a smallest distance s_min > 1. Closer spheres move as at s_min, but their relative
velocity goes to zero linearly with the gap, so they never overlap.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgtsv

ROUND_OFF = 1e-9  # distances this much below contact are contact


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

    Each gap adds a force between its two spheres that brings their velocities together,

        V_i = V0_i + (f_i - f_{i-1})/2,    f_j = kappa_j (V_{j+1} - V_j),
        kappa_j = (s_min - 1)/(s_j - 1) - 1  for s_j < s_min, else 0.

    So the relative velocity of a pair is V0_rel (s - 1)/(s_min - 1), its mean is kept, and
    spheres in contact move together. With m_j = (s_j - 1)/(s_min - 1), 0 at contact and 1 at s_min,
    kappa_j = (1 - m_j)/m_j, and the forces follow from a system that has no infinity,

        f_j - (1 - m_j)(f_{j-1} + f_{j+1})/2 = (1 - m_j)(V0_{j+1} - V0_j).

    V is a weighted mean of V0: no sphere gets slower than the slowest, faster than the fastest.

    Args:
        velocity: V0 in any unit, shape (..., N), along the flow; `TripletVelocities.closure`.
        gap: s - 1 of neighbours in d, shape (..., N - 1). Below contact counts as contact.
        smallest_gap: s_min - 1, above 0, where lubrication begins.
    """
    relative = velocity[..., 1:] - velocity[..., :-1]
    # one column more than gaps: the last one, without force, separates chains when flattened
    m = np.ones(velocity.shape)
    m[..., :-1] = np.maximum(gap / smallest_gap, 0.0)
    near = (m.ravel() < 1).nonzero()[0]
    if not near.size:
        return ChainMotion(velocity, relative)
    force, driving = np.zeros(velocity.shape), np.zeros(velocity.shape)
    driving[..., :-1] = relative
    m_near = m.ravel()[near]  # views, which are faster than `flat`
    a = 1 - m_near
    f = _forces(near, a, driving.ravel()[near])
    force.reshape(-1)[near] = f
    result = velocity + force / 2
    result[..., 1:] -= force[..., :-1] / 2
    driving[..., :-1] = result[..., 1:] - result[..., :-1]
    driving.reshape(-1)[near] = f * m_near / a
    return ChainMotion(result, driving[..., :-1])


def _forces(gap: NDArray, a: NDArray, relative: NDArray) -> NDArray:
    """Solve f_j - a_j (f_{j-1} + f_{j+1})/2 = a_j relative_j for the gaps with these numbers."""
    if gap.size == 1:
        return a * relative
    neighbours = gap[1:] - gap[:-1] == 1
    below, above = -a[1:] / 2 * neighbours, -a[:-1] / 2 * neighbours
    *_, force, failed = dgtsv(below, np.ones_like(a), above, a * relative)
    assert not failed  # diagonally dominant
    return force
