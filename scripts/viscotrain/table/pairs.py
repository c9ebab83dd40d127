"""Pairs: how fast two spheres without other neighbours approach or leave each other.

Both spheres in turn are the middle one of a triplet whose third sphere is not there, as in a train
of two, and closer than the table they are lubricated together:

    U(s) = U_2(s, inf) - U_2(inf, s),    leading minus trailing: positive is repulsion.
"""

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from viscotrain.table.interpolation import TripletVelocities
from viscotrain.table.lubrication import lubricate
from viscotrain.words import CONTACT, MIDDLE, OF_A_PAIR


def pair_velocity(velocities: TripletVelocities, distance: ArrayLike) -> NDArray:
    """Velocity of the leading minus the trailing sphere of a pair alone, in Ubar.

    Args:
        velocities: Of triplets.
        distance: Centre to centre in d, from contact to infinity, shape (n,).
    """
    s = np.asarray(distance, dtype=float)
    none = np.full_like(s, np.inf)
    trailing = velocities.closure(none, s, MIDDLE)
    leading = velocities.closure(s, none, MIDDLE)
    free = np.stack([trailing, leading], axis=-1)
    smallest_gap = velocities.smallest_distance - CONTACT
    return lubricate(free, (s - CONTACT)[..., None], smallest_gap).relative[..., 0]


def tabulated_pair_velocity(layer: xr.Dataset) -> NDArray:
    """The same as it was simulated, shape (pair_distance,); NaN at holes.

    Args:
        layer: The table at one Deborah number.
    """
    U = layer["pair_velocity"].sel(particle_of_pair=list(OF_A_PAIR))
    return np.diff(U.transpose("pair_distance", "particle_of_pair").values, axis=-1)[:, 0]
