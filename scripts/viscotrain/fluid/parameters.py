"""The fluid and the scales of its flow: physical numbers in, dimensionless numbers out.

A fluid is a Newtonian solvent (viscosity eta_s) and any number of Giesekus modes (viscosity eta_k,
relaxation time lambda_k, mobility alpha_k). With eta_0 = eta_s + sum_k eta_k and lambda_1 the
longest relaxation time, everything downstream is scaled by

    length D,  velocity Ubar = 4 Q/(pi D^2),  time D/Ubar,  viscosity eta_0,  stress eta_0 Ubar/D,

and the Deborah number inside the code always is De = lambda_1 Ubar/D. The other one on offer,

    De_mean = lambda_mean Ubar/D,    lambda_mean = sum_k eta_k lambda_k / sum_k eta_k,

is converted once, at the border to the config. De = 0, with or without modes, is the Newtonian
fluid of viscosity eta_0: creeping Newtonian flow has no velocity scale of its own, so the physical
factors that contain a velocity are NaN there.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, fields
from typing import NamedTuple, Self

from viscotrain.errors import FluidError

CHANNEL_RADIUS = 0.5  # in D
ROUND_OFF = 1e-12  # allowed error of viscosities that should add up to one
MICROLITRES_PER_MINUTE = 60e9  # of one m^3/s
MILLIMETRES = 1e3  # of one m


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


class Quantity(NamedTuple):
    """A number with its name, unit and meaning, ready to become a dataset variable."""

    name: str
    value: float
    units: str
    long_name: str


def _quantity(units: str, long_name: str):
    return field(metadata={"units": units, "long_name": long_name})


@dataclass(frozen=True)
class Scales:
    """Physical factors of one Deborah number: multiply a dimensionless result by them."""

    deborah_longest_mode: float = _quantity("1", "Deborah number of the longest relaxation time")
    deborah_mean_relaxation_time: float = _quantity(
        "1", "Deborah number of the viscosity-weighted mean relaxation time"
    )
    channel_diameter: float = _quantity("mm", "channel diameter, unit of lengths along the channel")
    particle_diameter: float = _quantity("mm", "particle diameter, unit of distances")
    mean_velocity: float = _quantity("m s-1", "mean velocity of the flow, unit of velocities")
    time: float = _quantity("s", "channel diameter over mean velocity, unit of times")
    flow_rate: float = _quantity("uL min-1", "flow rate")
    stress: float = _quantity(
        "Pa", "zero-shear viscosity times mean velocity over channel diameter, unit of stresses"
    )

    @classmethod
    def at(
        cls,
        deborah_longest_mode: float,
        fluid: DimensionlessFluid,
        *,
        zero_shear_viscosity: float,
        longest_relaxation_time: float,
        channel_diameter: float,
        particle_diameter: float,
    ) -> Self:
        """Scales at De = lambda_1 Ubar/D; viscosity in Pa s, time in s, diameters in m."""
        De, D = deborah_longest_mode, channel_diameter
        mean_velocity = De * D / longest_relaxation_time if De > 0 else math.nan
        return cls(
            deborah_longest_mode=De,
            deborah_mean_relaxation_time=De * fluid.mean_relaxation_time if De > 0 else 0.0,
            channel_diameter=D * MILLIMETRES,
            particle_diameter=particle_diameter * MILLIMETRES,
            mean_velocity=mean_velocity,
            time=D / mean_velocity,
            flow_rate=math.pi / 4 * D**2 * mean_velocity * MICROLITRES_PER_MINUTE,
            stress=zero_shear_viscosity * mean_velocity / D,
        )

    def quantities(self) -> Iterator[Quantity]:
        """Every factor with its name, unit and meaning."""
        for item in fields(self):
            yield Quantity(item.name, getattr(self, item.name), **item.metadata)
