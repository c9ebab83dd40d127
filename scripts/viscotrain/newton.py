"""Modified Newton iteration: one factorisation serves as long as the iteration contracts.

A residual and a back substitution cost a tenth of a linearisation with its factorisation, so the
matrix is kept while the present rate of contraction promises to end within `PATIENCE` updates.
"""

import math
from dataclasses import dataclass, field

import ngsolve
import numpy as np
from netgen.libngpy._meshing import NgException

PATIENCE = 6  # updates with an old matrix that are cheaper than a new one
DIVERGENCE = 1e3  # rms update at which the iteration is given up: unknowns are of order one


@dataclass
class Convergence:
    """How an iteration went: `reason` is empty if it converged.

    `updates` and `residuals` hold the rms over the unknowns of each iteration.
    """

    updates: list[float] = field(default_factory=list)
    residuals: list[float] = field(default_factory=list)
    factorisations: int = 0
    reason: str = ""

    @property
    def converged(self) -> bool:
        """Whether the last update was below the tolerance."""
        return not self.reason

    @property
    def iterations(self) -> int:
        """Number of updates."""
        return len(self.updates)

    @property
    def residual(self) -> float:
        """Residual before the last update; NaN if there was none."""
        return self.residuals[-1] if self.residuals else math.nan


def solve(
    form: ngsolve.BilinearForm,
    state: ngsolve.GridFunction,
    free: ngsolve.BitArray,
    *,
    tolerance: float,
    max_iterations: int,
) -> Convergence:
    """Solve form(state) = 0 for the free unknowns, in place.

    Args:
        form: Residual, with a linearisation.
        state: First guess, then solution.
        free: Unknowns to solve for.
        tolerance: Rms update at which the iteration has converged.
        max_iterations: Updates before it is given up.
    """
    result = Convergence()
    residual, update = state.vec.CreateVector(), state.vec.CreateVector()
    onto_free = ngsolve.Projector(free, True)
    root_of_size = math.sqrt(free.NumSet())
    inverse = None
    for _ in range(max_iterations):
        form.Apply(state.vec, residual)
        onto_free.Project(residual)
        if inverse is None:
            form.AssembleLinearization(state.vec)
            try:
                inverse = form.mat.Inverse(free, inverse="umfpack")
            except NgException as error:
                result.reason = f"factorisation failed: {error}"
                return result
            result.factorisations += 1
        update.data = inverse * residual
        state.vec.data -= update
        result.residuals.append(residual.Norm() / root_of_size)
        result.updates.append(update.Norm() / root_of_size)
        last = result.updates[-1]
        if not np.isfinite(last) or last > DIVERGENCE:
            result.reason = f"diverged: update {last:.1e} in iteration {result.iterations}"
            return result
        if last < tolerance:
            return result
        if result.iterations > 1 and _updates_to_go(result.updates, tolerance) > PATIENCE:
            inverse = None
    result.reason = f"update {last:.1e} above {tolerance:.1e} after {max_iterations} iterations"
    return result


def _updates_to_go(updates: list[float], tolerance: float) -> float:
    """Number of further updates at the present rate of contraction."""
    rate = updates[-1] / updates[-2]
    return math.log(tolerance / updates[-1]) / math.log(rate) if rate < 1 else math.inf
