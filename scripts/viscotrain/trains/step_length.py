"""How long the next step of time may be, from the error of the last one.

The error grows with the square of the length, at least, so that of the next step is what is allowed
if its length is 1/sqrt(error) times the last one, and safely so if it is somewhat shorter
(E. Hairer, S. P. Norsett & G. Wanner, Solving Ordinary Differential Equations I, Springer 1993,
section II.4).
"""

import math

SAFETY, SHRINK, GROW = 0.8, 0.2, 2.0  # limits of the next step's length over the last one's


def change(error: float) -> float:
    """Length of the next step over the last one's, from the error of that over what is allowed."""
    return min(max(SAFETY / math.sqrt(error), SHRINK), GROW) if error > 0 else GROW
