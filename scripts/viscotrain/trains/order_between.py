"""Order of even trains at Deborah numbers between those of a table, as another fluid has them.

What `order` found at the table's De, growth rates sigma(k) and velocities U, is interpolated:
piecewise straight in ln(1 + De), because rates rise steeply from De = 0 and level off, and few De
are known. A little beyond the ends the last line is continued, as a draw of a fluid is as often
above as below; farther out nothing is known. The fluid is that of the table: of another fluid only
De is new, not the shape of its curves.
"""

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from viscotrain.trains.order import NEUTRAL, remaining_variation

BEYOND = 0.25  # of the De at an end of the table, up to which its line is continued


def order_at(
    found: xr.Dataset, table_deborah: ArrayLike, deborah: ArrayLike, length: float
) -> dict[str, NDArray]:
    """Rates of order at other Deborah numbers.

    Args:
        found: Of `order.orders`.
        table_deborah: De of the longest mode of the table, ascending, shape (deborah,).
        deborah: De of the longest mode, any shape.
        length: Of the channel, in D.

    Returns:
        `ordering_rate`, 1/l in 1/D, 0 where the fastest disturbance does not decay, and
        `remaining_variation`, CV(L)/CV(0), each of the shape of `deborah` with the spacings behind;
        NaN where De is not known.
    """
    De, nodes = np.asarray(deborah, dtype=float), np.asarray(table_deborah, dtype=float)
    sigma = _between(nodes, found["growth_rate"].values, De)
    U = _between(nodes, found["velocity"].values, De)
    rate = -sigma[..., -1]
    decays = np.where(rate > NEUTRAL, rate / U, 0.0)
    return {
        "ordering_rate": np.where(np.isfinite(rate), decays, np.nan),
        "remaining_variation": remaining_variation(sigma, U, length),
    }


def _between(nodes: NDArray, values: NDArray, De: NDArray) -> NDArray:
    """Values over their first axis at other places; NaN where they are too far away."""
    if nodes.size < 2:  # no slope is known
        same = (De == nodes[0]).reshape(De.shape + (1,) * (values.ndim - 1))
        return np.where(same, values[0], np.nan)
    x, ends = np.log1p(De), np.log1p(nodes)
    left = np.clip(np.searchsorted(ends, x) - 1, 0, nodes.size - 2)
    share = (x - ends[left]) / (ends[left + 1] - ends[left])
    inside = np.clip(De, nodes[0], nodes[-1])
    share = np.where(np.abs(De - inside) <= BEYOND * inside, share, np.nan)
    share = share.reshape(De.shape + (1,) * (values.ndim - 1))
    return (1 - share) * values[left] + share * values[left + 1]
