"""Which conditions a design tries: mean spacings, and the one that gives a wanted rate of beads.

By conservation spheres of velocity U_p that pass at a rate are s* = U_p/(rate d) apart. This module
imports neither numpy nor pandas: what a design costs is counted before it is planned.
"""

import math
from collections.abc import Sequence

from viscotrain.fluid.channel import CrossSection

# d: closer, the model is not good; farther, spheres do not feel each other
CLOSEST, FARTHEST = 1.5, 60.0


def wanted_spacing(rate: float, isolated: float, confinement: float) -> float:
    """s* in d of spheres that pass at a rate in Ubar/D, with U_p in Ubar."""
    return isolated / (rate * confinement)


def volume_fractions(
    spacing: Sequence[float],
    *,
    rate: float | None,
    isolated: float,
    confinement: float,
    section: CrossSection,
) -> list[float]:
    """Phi in the channel of the conditions at one De, the one of the wanted rate last.

    Args:
        spacing: Mean spacings in d.
        rate: Of beads, in Ubar/D; None: none is wanted.
        isolated: U_p in Ubar.
        confinement: d/D.
        section: Of the channel.

    Returns:
        NaN for a rate that would have spheres closer than `CLOSEST` or farther than `FARTHEST`.
    """
    one = section.mean_spacing(confinement, 1.0)
    found = [one / s for s in spacing]
    if rate is not None:
        s = wanted_spacing(rate, isolated, confinement)
        found.append(one / s if CLOSEST <= s <= FARTHEST else math.nan)
    return found
