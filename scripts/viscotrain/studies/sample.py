"""The sample of fluids and geometries by which it is measured how far the simulation reaches.

A Latin hypercube of `MAIN_POINTS` over everything that a config may ask for (ranges below), and one
of `CORNER_POINTS` over fluids close to those of Boger, where stress grows without a bound or little
solvent smooths it: mobilities up to 0.05, or a solvent share up to 0.05. Every coordinate has one
point in each of its equal strata; those of modes or distances that a point does not have are not
used. Point n is the same whichever points are solved.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from viscotrain.fluid.parameters import DimensionlessFluid, Mode

SEED = 20240
MAIN_POINTS, CORNER_POINTS = 60, 12
MAIN, CORNER = "main", "corner"
MOST_MODES, SPHERES = 4, 3
MOBILITY = (0.05, 0.49)
SOLVENT = (0.05, 0.9)  # eta_s/eta_0
CONFINEMENT = (0.1, 0.5)  # d/D
GAP = (0.05, 5.0)  # between surfaces, in d
DEBORAH = (0.3, 40.0)  # of the longest mode, but for the points at 0
NEWTONIAN_SHARE = 0.05  # of the main points, at De = 0
TIME_RATIO = (0.01, 1.0)  # of the further modes to the longest
WEAK_MOBILITY = (0.0, 0.05)  # in one half of the corner
OLDROYD_SHARE = 0.2  # of that half, with mobilities that are exactly 0
LITTLE_SOLVENT = (0.01, 0.05)  # in the other half
CORNER_DEBORAH = (0.3, 5.0)
COORDINATES = (
    *("modes", "spheres", "gap_behind", "gap_ahead", "confinement", "solvent", "deborah"),
    *(f"mobility{k}" for k in range(1, MOST_MODES + 1)),
    *(f"share{k}" for k in range(1, MOST_MODES + 1)),
    *(f"time{k}" for k in range(2, MOST_MODES + 1)),
)


@dataclass(frozen=True)
class Point:
    """One point of the sample; distances in d, infinite without a neighbour."""

    index: int
    part: str
    fluid: DimensionlessFluid
    confinement: float
    sp: float
    sf: float
    deborah: float


def design(seed: int = SEED) -> list[Point]:
    """The main sample, then the corner."""
    main, corner = coordinates(seed)
    points = [_main_point(n, dict(zip(COORDINATES, u, strict=True))) for n, u in enumerate(main)]
    for n, u in enumerate(corner):
        points.append(_corner_point(n, dict(zip(COORDINATES, u, strict=True))))
    return points


def coordinates(seed: int) -> tuple[NDArray, NDArray]:
    """Latin hypercubes (points, `COORDINATES`) in [0, 1) of the main sample and of the corner."""
    children = np.random.SeedSequence(seed).spawn(2)
    main, corner = (
        qmc.LatinHypercube(len(COORDINATES), seed=np.random.default_rng(child)).random(count)
        for child, count in zip(children, (MAIN_POINTS, CORNER_POINTS), strict=True)
    )
    return main, corner


def _main_point(index: int, u: dict[str, float]) -> Point:
    above = (u["deborah"] - NEWTONIAN_SHARE) / (1 - NEWTONIAN_SHARE)
    fluid = _fluid(u, MOBILITY, _logarithmic(u["solvent"], SOLVENT))
    return _point(index, MAIN, u, fluid, _logarithmic(above, DEBORAH) if above >= 0 else 0.0)


def _corner_point(number: int, u: dict[str, float]) -> Point:
    """One half has weak mobilities, the other one little solvent."""
    if number % 2 == 0:
        oldroyd = number < OLDROYD_SHARE * CORNER_POINTS
        mobility = (0.0, 0.0) if oldroyd else WEAK_MOBILITY
        fluid = _fluid(u, mobility, _logarithmic(u["solvent"], SOLVENT))
    else:
        fluid = _fluid(u, MOBILITY, _logarithmic(u["solvent"], LITTLE_SOLVENT))
    De = _logarithmic(u["deborah"], CORNER_DEBORAH)
    return _point(MAIN_POINTS + number, CORNER, u, fluid, De)


def _fluid(u: dict[str, float], mobility: tuple[float, float], solvent: float):
    """Shares of the modes that are uniform among all that add up to one; the longest is first."""
    count = 1 + int(MOST_MODES * u["modes"])
    weights = np.array([-math.log1p(-u[f"share{k}"]) for k in range(1, count + 1)])
    ratios = [1.0, *(_logarithmic(u[f"time{k}"], TIME_RATIO) for k in range(2, count + 1))]
    modes = [
        Mode(float((1 - solvent) * share), ratio, _linear(u[f"mobility{k}"], mobility))
        for k, (share, ratio) in enumerate(zip(weights / weights.sum(), ratios, strict=True), 1)
    ]
    return DimensionlessFluid.from_physical(solvent, modes)


def _point(index: int, part: str, u: dict[str, float], fluid, De: float) -> Point:
    count = 1 + int(SPHERES * u["spheres"])
    behind, ahead = (1 + _logarithmic(u[name], GAP) for name in ("gap_behind", "gap_ahead"))
    return Point(
        index=index,
        part=part,
        fluid=fluid,
        confinement=_linear(u["confinement"], CONFINEMENT),
        sp=behind if count > 2 else math.inf,
        sf=ahead if count > 1 else math.inf,
        deborah=De,
    )


def _linear(u: float, limits: tuple[float, float]) -> float:
    low, high = limits
    return float(low + (high - low) * u)


def _logarithmic(u: float, limits: tuple[float, float]) -> float:
    low, high = limits
    return float(low * (high / low) ** u)
