"""The fluid and its scales: physical numbers in, dimensionless numbers out.

A fluid is a Newtonian solvent (viscosity eta_s) and any number of Giesekus modes (viscosity eta_k,
relaxation time lambda_k, mobility alpha_k). With eta_0 = eta_s + sum_k eta_k and lambda_1 the
longest relaxation time, everything downstream is scaled by

    length D,  velocity Ubar = 4 Q/(pi D^2),  time D/Ubar,  viscosity eta_0,  stress eta_0 Ubar/D,

and the Deborah number inside the code always is De = lambda_1 Ubar/D. The other one on offer,

    De_mean = lambda_mean Ubar/D,    lambda_mean = sum_k eta_k lambda_k / sum_k eta_k,

is converted once, at the border to the config. De = 0, with or without modes, is the Newtonian
fluid of viscosity eta_0. The way back to physical numbers is `units`.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

from viscotrain.errors import FluidError

CHANNEL_RADIUS = 0.5  # in D
ROUND_OFF = 1e-12  # allowed error of viscosities that should add up to one


@dataclass(frozen=True)
class Mode:
    """One Giesekus mode, in the units of its fluid: Pa s and s, or eta_0 and lambda_1."""

    viscosity: float
    relaxation_time: float
    mobility: float = 0.0


@dataclass(frozen=True)
class Fluid:
    """The fluid in physical units: solvent viscosity in Pa s, modes in Pa s, s and 1."""

    solvent_viscosity: float
    modes: tuple[Mode, ...] = ()

    @property
    def longest_first(self) -> list[Mode]:
        """The modes, sorted by their relaxation times."""
        return sorted(self.modes, key=lambda mode: (-mode.relaxation_time, -mode.viscosity))

    @property
    def zero_shear_viscosity(self) -> float:
        """Solvent plus modes, eta_0, in Pa s."""
        return self.solvent_viscosity + sum(mode.viscosity for mode in self.longest_first)

    @property
    def longest_relaxation_time(self) -> float:
        """Of all modes, lambda_1, in s; NaN without modes."""
        return max((mode.relaxation_time for mode in self.modes), default=math.nan)


@dataclass(frozen=True)
class DimensionlessFluid:
    """A solvent and its modes, the longest relaxation time first.

    Args:
        solvent: eta_s/eta_0.
        modes: Modes with viscosities in eta_0, which make up 1 - `solvent`, and relaxation times
            in lambda_1, the longest of which is 1. Empty for a Newtonian fluid.

    Raises:
        FluidError: The parameters are out of range or not scaled as above.
    """

    solvent: float
    modes: tuple[Mode, ...] = ()

    def __post_init__(self):
        total = self.solvent + sum(mode.viscosity for mode in self.modes)
        if not abs(total - 1) < ROUND_OFF:
            raise FluidError(f"viscosities add up to {total:.15g}; allowed: 1, all are in eta_0")
        longest = max((mode.relaxation_time for mode in self.modes), default=1.0)
        if longest != 1:
            raise FluidError(f"longest relaxation time is {longest}; allowed: 1, all in lambda_1")
        if not self.solvent > 0:
            raise FluidError(f"solvent viscosity is {self.solvent}; allowed: above 0")
        for mode in self.modes:
            if not (mode.viscosity > 0 and mode.relaxation_time > 0 and 0 <= mode.mobility < 1):
                raise FluidError(
                    f"found {mode}; allowed: viscosity and time above 0, mobility in [0, 1)"
                )

    @classmethod
    def from_physical(cls, solvent_viscosity: float, modes: Iterable[Mode]) -> Self:
        """Scale viscosities by eta_0 and times by lambda_1, and sort the longest mode first."""
        fluid = Fluid(solvent_viscosity, tuple(modes))
        eta_0, lambda_1 = fluid.zero_shear_viscosity, fluid.longest_relaxation_time
        return cls(
            solvent=solvent_viscosity / eta_0,
            modes=tuple(
                Mode(mode.viscosity / eta_0, mode.relaxation_time / lambda_1, mode.mobility)
                for mode in fluid.longest_first
            ),
        )

    @property
    def mean_relaxation_time(self) -> float:
        """lambda_mean/lambda_1, viscosity-weighted over the modes; NaN without modes."""
        if not self.modes:
            return math.nan
        weighted = sum(mode.viscosity * mode.relaxation_time for mode in self.modes)
        return weighted / sum(mode.viscosity for mode in self.modes)


NEWTONIAN = DimensionlessFluid(solvent=1.0)


def mean_spacing(confinement: float, volume_fraction: float) -> float:
    """Centre-to-centre distance, in d, of equally spaced spheres in a tube.

    One sphere, pi d^3/6, per length s* d of the tube, pi D^2/4, makes s* phi = (2/3) (d/D)^2.
    """
    return 2 / 3 * confinement**2 / volume_fraction
