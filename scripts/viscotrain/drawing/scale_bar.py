"""Scale bars: a round physical length of about a tenth of what is seen."""

import math

from viscotrain.fluid.units import MICROMETRES

NICE = (1, 2, 5)  # leading digits of a scale bar's length


def scale_bar(field_of_view: float, channel_diameter: float) -> tuple[float, str]:
    """Length of a scale bar in D, a round one of about a tenth of the window, and its name.

    Args:
        field_of_view: In D.
        channel_diameter: In mm.
    """
    largest = field_of_view / 8 * channel_diameter * MICROMETRES
    power = 10.0 ** math.floor(math.log10(largest))
    length = max(digit * power for digit in NICE if digit * power <= largest)
    name = f"{length / 1e3:g} mm" if length >= 1e3 else f"{length:g} \N{MICRO SIGN}m"
    return length / 1e3 / channel_diameter, name
