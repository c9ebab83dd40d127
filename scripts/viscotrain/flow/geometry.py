"""Spheres in their periodic box. Lengths are in D.

This module needs no NGSolve: figures draw what `meshes` meshes.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from viscotrain.errors import GeometryError
from viscotrain.words import MIDDLE, PARTICLES


@dataclass(frozen=True)
class Geometry:
    """Spheres of one size on the axis of a periodic piece of tube.

    Args:
        confinement: Sphere over channel diameter, beta = d/D.
        spheres: Names of the spheres, along the flow.
        positions: z of their centres, in D, ascending.
        length: Periodic length of the box, in D.
        reference: Name of the sphere in whose frame the flow is solved; None without spheres.
    """

    confinement: float
    spheres: tuple[str, ...]
    positions: tuple[float, ...]
    length: float
    reference: str | None

    def __post_init__(self):
        if not all(high > low for low, high in self.free_axis):
            raise GeometryError(
                f"spheres of diameter {self.confinement} D at z/D = {self.positions} overlap, "
                f"or leave the box of length {self.length} D"
            )

    @classmethod
    def triplet(cls, confinement: float, sp: float, sf: float, margin: float) -> "Geometry":
        """Trailing, middle and leading sphere; an infinite distance leaves out a sphere.

        Args:
            confinement: beta = d/D.
            sp: (z2 - z1)/d, or infinite.
            sf: (z3 - z2)/d, or infinite.
            margin: Distance of the outer centres to the periodic ends, in D.
        """
        offsets = dict(zip(PARTICLES, (-sp * confinement, 0.0, sf * confinement), strict=True))
        present = {name: z for name, z in offsets.items() if math.isfinite(z)}
        return cls._in_box(confinement, present, margin, reference=PARTICLES[MIDDLE])

    @classmethod
    def train(cls, confinement: float, distances: Sequence[float], margin: float) -> "Geometry":
        """Any number of spheres, named sphere1 (trailing) to sphereN.

        Args:
            confinement: beta = d/D.
            distances: Of neighbours, centre to centre in d, along the flow; one less than spheres.
            margin: Distance of the outer centres to the periodic ends, in D.
        """
        offsets = confinement * np.cumsum([0.0, *distances])
        present = {f"sphere{n}": float(z) for n, z in enumerate(offsets, start=1)}
        return cls._in_box(confinement, present, margin, f"sphere{(len(present) + 1) // 2}")

    @classmethod
    def _in_box(cls, confinement, spheres: Mapping[str, float], margin, reference) -> "Geometry":
        """Spheres by name, along the flow, moved to have the margin on either side."""
        offsets = list(spheres.values())
        positions = tuple(margin + z - offsets[0] for z in offsets)
        return cls(confinement, tuple(spheres), positions, positions[-1] + margin, reference)

    def moved(self, positions: Sequence[float]) -> "Geometry":
        """The same spheres with other distances, and the same margins to the periodic ends."""
        spheres = dict(zip(self.spheres, map(float, positions), strict=True))
        return self._in_box(self.confinement, spheres, self.margin, self.reference)

    @property
    def margin(self) -> float:
        """Distance of the outer centres to the periodic ends, in D."""
        return self.positions[0]

    @property
    def radius(self) -> float:
        """Sphere radius in D."""
        return self.confinement / 2

    @property
    def moving_spheres(self) -> tuple[str, ...]:
        """Names of the spheres that move in the frame of the reference sphere."""
        return tuple(name for name in self.spheres if name != self.reference)

    @property
    def free_axis(self) -> list[tuple[float, float]]:
        """Pieces (z_low, z_high) of the axis outside of the spheres, from end to end."""
        a = self.radius
        starts = [0.0, *(z + a for z in self.positions)]
        ends = [*(z - a for z in self.positions), self.length]
        return list(zip(starts, ends, strict=True))

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Pieces (z_low, z_high) of the axis between neighbouring spheres."""
        return self.free_axis[1:-1]
