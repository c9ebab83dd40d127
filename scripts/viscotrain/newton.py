"""Modified Newton iteration: one factorisation serves as long as the iteration contracts.

A residual and a back substitution cost a tenth of a linearisation with its factorisation, so the
matrix is kept while the present rate of contraction promises to end within `PATIENCE` updates, and
from one solve to the next of the same `ModifiedNewton`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import ngsolve
import numpy as np
from netgen.libngpy._meshing import NgException

PATIENCE = 6  # updates with an old matrix that are cheaper than a new one
STALL = 5  # iterations in which the update must have halved
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


class ModifiedNewton:
    """Solves form(state) = 0 for the free unknowns, again and again.

    Args:
        form: Residual, with a linearisation.
        free: Unknowns to solve for.
    """

    def __init__(self, form: ngsolve.BilinearForm, free: ngsolve.BitArray):
        self._form, self._free = form, free
        self._onto_free = ngsolve.Projector(free, True)
        self._inverse: ngsolve.BaseMatrix | None = None

    def solve(
        self,
        state: ngsolve.GridFunction,
        *,
        tolerance: float,
        max_iterations: int,
        prepare: Callable[[], None] = lambda: None,
    ) -> Convergence:
        """Solve in place, first with the matrix of the last solve if there was one.

        Args:
            state: First guess, then solution.
            tolerance: Rms update at which the iteration has converged.
            max_iterations: Updates before it is given up.
            prepare: Called before each residual, to change what the form takes from the state.
        """
        result = Convergence()
        residual, update = state.vec.CreateVector(), state.vec.CreateVector()
        root_of_size = math.sqrt(self._free.NumSet())
        for _ in range(max_iterations):
            prepare()
            self._form.Apply(state.vec, residual)
            self._onto_free.Project(residual)
            if self._inverse is None:
                self._form.AssembleLinearization(state.vec)
                try:
                    self._inverse = self._form.mat.Inverse(self._free, inverse="umfpack")
                except NgException as error:
                    result.reason = f"factorisation failed: {error}"
                    return result
                result.factorisations += 1
            update.data = self._inverse * residual
            state.vec.data -= update
            result.residuals.append(residual.Norm() / root_of_size)
            result.updates.append(update.Norm() / root_of_size)
            last = result.updates[-1]
            if not np.isfinite(last) or last > DIVERGENCE:
                self._inverse = None
                result.reason = f"diverged: update {last:.1e} in iteration {result.iterations}"
                return result
            if last < tolerance:
                return result
            if result.iterations > STALL and last > min(result.updates[:-STALL]) / 2:
                self._inverse = None
                result.reason = f"stalled: update {last:.1e} in iteration {result.iterations}"
                return result
            if result.iterations > 1 and _updates_to_go(result.updates, tolerance) > PATIENCE:
                self._inverse = None
        result.reason = f"update {last:.1e} above {tolerance:.1e} after {max_iterations} iterations"
        return result


def _updates_to_go(updates: list[float], tolerance: float) -> float:
    """Number of further updates at the present rate of contraction."""
    rate = updates[-1] / updates[-2]
    return math.log(tolerance / updates[-1]) / math.log(rate) if rate < 1 else math.inf
