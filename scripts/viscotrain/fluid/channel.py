r"""The section of a channel, and what follows from its area: flow rate, spacing, rates of spheres.

A channel is a tube of diameter D or a duct whose section is a rectangle; a square is one of aspect
ratio 1. **D of a duct is its smaller side, the diameter of the inscribed tube**, and lengths are in
D, De = lambda_1 Ubar/D, beta = d/D as in a tube. With the area A of the section

    Q = A Ubar,    A = pi/4 D^2 (tube),    A = a D^2 (rectangle of aspect ratio a >= 1).

One sphere, pi d^3/6, per length s* d of the channel makes the volume fraction

    phi = (pi/6) d^3/(s* d A),    s* phi = (2/3) beta^2 (pi/4 D^2/A),

which is (2/3) beta^2 in a tube, (pi/6) beta^2 in a square and (pi/6) beta^2/a in a rectangle: the
spacing of the inscribed tube, times the share of the section that this tube has.

**What is simulated is the inscribed tube.** Spheres on the axis of a duct act on each other as in
that tube at the same Ubar: their relative velocities are those of the table. How fast all of them
move is the duct's: velocities are shifted by the difference of U_max (`table.drift`).
"""

import math
from dataclasses import dataclass

from viscotrain.fluid.parameters import mean_spacing

TUBE, RECTANGLE = "tube", "rectangle"
SIMULATED = "interactions are those of the inscribed tube"  # said wherever numbers of a duct stand


@dataclass(frozen=True)
class CrossSection:
    """The section of a channel, in D.

    Args:
        shape: `TUBE` or `RECTANGLE`.
        aspect_ratio: Larger over smaller side of a rectangle.
    """

    shape: str = TUBE
    aspect_ratio: float = 1.0

    @property
    def is_duct(self) -> bool:
        """Whether it is not the tube that is simulated."""
        return self.shape != TUBE

    @property
    def area(self) -> float:
        """In D^2."""
        return self.aspect_ratio if self.is_duct else math.pi / 4

    @property
    def inscribed_share(self) -> float:
        """Area of the inscribed tube over that of the section."""
        return math.pi / 4 / self.aspect_ratio if self.is_duct else 1.0

    def mean_spacing(self, confinement: float, volume_fraction: float) -> float:
        """Centre-to-centre distance, in d, of equally spaced spheres."""
        return mean_spacing(confinement, volume_fraction) * self.inscribed_share

    @property
    def name(self) -> str:
        """In words."""
        if not self.is_duct:
            return "tube"
        if self.aspect_ratio == 1:
            return "square duct"
        return f"rectangular duct, {self.aspect_ratio:.3g} to 1"

    @property
    def remark(self) -> str:
        """What must be said of every number of a duct; empty for a tube."""
        return f"{self.name}: {SIMULATED}" if self.is_duct else ""

    @property
    def attributes(self) -> dict[str, str]:
        """What a dataset says of its channel: the remark of a duct as `channel`, else nothing."""
        return {"channel": self.remark} if self.is_duct else {}


ROUND = CrossSection()  # what is simulated
