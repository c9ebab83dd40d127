"""Modified Newton iteration: one factorisation serves as long as the iteration contracts.

A residual and a back substitution cost a tenth of a linearisation with its factorisation. So after
each update the next one is computed with the same matrix. If it is smaller by less than

    |next| < (1 - step/4) |last|,

the last update was too long: half of it is taken back, and again, until that holds (the natural
monotonicity test; P. Deuflhard, Newton Methods for Nonlinear Problems, Springer 2011, sec. 3.3).
The updates with one matrix are combined: Anderson's method (H. F. Walker & P. Ni, SIAM J. Numer.
Anal. 49, 2011, 1715) takes the combination of the last `DEPTH` + 1 states whose own combination of
updates is smallest. They need not shrink one by one: the matrix is kept while they are within
`GROWTH` of the smallest, and their mean rate over `WINDOW` promises to end sooner than a new matrix
would be worth (`PATIENCE`); and from one solve to the next of the same `ModifiedNewton`. Otherwise
there is a new one, at the state whose update was smallest.

Factors are of single precision. Where the second update is not much smaller than the first, the
residual of the linearised equations that the first one left is taken from a difference of
residuals; if its correction is not small, precision is doubled.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import ngsolve
import numpy as np
from numpy.typing import NDArray

from viscotrain.flow.batches import BatchedForm, VectorFactors
from viscotrain.flow.factorisation import FactorisationError, NgsolveFactors, factorise
from viscotrain.flow.fronts import Precision

# Updates with an old matrix that cost as much as a new one, over the order squared: 3 were measured
# in order 2, 27 in order 7.
PATIENCE = 0.5
DEPTH = 12  # earlier updates that the next one is combined with
GROWTH = 4.0  # of an update over the smallest with the same matrix
WINDOW = 8  # updates that a rate of contraction is taken from
ROUGHEST = 0.03  # error of an update, over it, with factors in single precision
DIFFERENCE = 1e-6  # rms change of the unknowns that this error is seen from
SHORTEST_STEP = 1 / 32  # share of an update
SEEN_ENOUGH = 0.01  # update of a look, over its first, with which it ends
STALL = 4  # factorisations in which the update must have halved
DIVERGENCE = 1e3  # rms update at which the iteration is given up: unknowns are of order one


@dataclass
class Convergence:
    """How an iteration went: `reason` is empty if it converged.

    `updates` and `residuals` hold the rms over the unknowns of each iteration, be its update
    applied or not.
    """

    updates: list[float] = field(default_factory=list)
    residuals: list[float] = field(default_factory=list)
    factorisations: int = 0
    reason: str = ""

    @property
    def converged(self) -> bool:
        """Whether the last update was below the tolerances."""
        return not self.reason

    @property
    def iterations(self) -> int:
        """Number of residuals and back substitutions."""
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
        precision: Of the factors of a `BatchedForm`, to begin with.
    """

    def __init__(
        self,
        form: ngsolve.BilinearForm | BatchedForm,
        free: ngsolve.BitArray,
        precision: Precision = np.float32,
    ):
        self._form, self._free, self._precision = form, free, precision
        self._patience = PATIENCE * _order(form.space) ** 2
        self._onto_free = ngsolve.Projector(free, True)
        self._factors: VectorFactors | NgsolveFactors | None = None
        self._mixing = _Mixing()
        self._sizes: list[float] = []  # rms of the updates with this matrix
        self._looked = False  # whether the matrix is that of the state, and no update is applied

    def solve(
        self,
        state: ngsolve.GridFunction,
        *,
        tolerance: float,
        max_iterations: int,
        prepare: Callable[[], None] = lambda: None,
        watch: Callable[[ngsolve.BaseVector], Sequence[float]] = lambda _: (),
        watch_tolerance: float = math.inf,
        onwards: bool = False,
    ) -> Convergence:
        """Solve in place, first with the matrix of the last solve if there was one.

        Args:
            state: First guess, then solution.
            tolerance: Rms update at which the iteration has converged.
            max_iterations: Residuals before it is given up.
            prepare: Called before each residual, to change what the form takes from the state.
            watch: Numbers of the last update, linear in it, that must be small, too.
            watch_tolerance: How small they must be.
            onwards: Whether form and state are as the last solve or look left them, to go on.
        """
        result, firsts = Convergence(), []  # rms of the first update with each matrix
        residual, update, last = (state.vec.CreateVector() for _ in range(3))
        if not onwards:
            self._restart()
        step = 1.0 if self._sizes else 0.0  # share applied of `last`; 0: none with this matrix
        fresh, self._looked = self._looked, False  # whether the matrix was made for `last`
        for _ in range(max_iterations):
            prepare()
            if self._factors is None:
                step, fresh = 0.0, True
            try:
                size = self._compute(state, residual, update, result)
            except FactorisationError as error:
                result.reason = f"factorisation failed: {error}"
                return result
            if size < tolerance and all(abs(x) < watch_tolerance for x in watch(update)):
                self._end(state, update, size)
                return result
            if step == 0:
                firsts.append(size)
                if reason := _hopeless(firsts):
                    return self._give_up(result, reason)
            elif fresh and step == 1 and self._is_rough(state, last, size):
                self._drop_matrix(state, size, np.float64)
                continue
            elif fresh and not size < (1 - step / 4) * self._sizes[-1]:  # `last` was too long
                if step <= SHORTEST_STEP:
                    return self._give_up(result, "stuck")
                step /= 2
                state.vec.data += step * last
                continue
            elif _is_slow([*self._sizes, size], tolerance, self._patience):
                self._drop_matrix(state, size)
                continue
            self._mixing.apply(state.vec, update, last)
            self._sizes.append(size)
            fresh, step = fresh and step == 0, 1.0
        return self._give_up(result, f"no convergence to {tolerance:.1e}")

    def look(
        self, state: ngsolve.GridFunction, count: int
    ) -> tuple[ngsolve.BaseVector, ngsolve.BaseVector]:
        """Residual at a state, and what some updates with the matrix made there change.

        A solve may go on from here: from the state found if its update is smaller, or else from the
        one given.

        Args:
            state: Where to look.
            count: Of updates, which are combined, at most: fewer if they have become small beside
                the first, or grow without a bound.

        Returns:
            Residual at the given state, and change of the state; zero if the first update diverges.

        Raises:
            FactorisationError: The matrix is singular.
        """
        start, first, residual, update, last, change = (state.vec.CreateVector() for _ in range(6))
        start.data, change[:] = state.vec, 0.0
        self._factors = None
        self._restart()
        for _ in range(count):
            size = self._compute(state, residual, update, Convergence())
            if not self._sizes:
                first.data = residual
            elif len(self._sizes) == 1 and self._is_rough(state, last, size):
                self._precision, state.vec.data = np.float64, start
                return self.look(state, count)
            if not size < DIVERGENCE:
                break
            self._mixing.apply(state.vec, update, last)
            self._sizes.append(size)
            change.data = state.vec - start
            if size < SEEN_ENOUGH * self._sizes[0]:
                break
        if not self._sizes[-1:] < self._sizes[:1]:
            state.vec.data = start
            self._restart()
            self._looked = True
        return first, change

    def adjoint(self, right: ngsolve.BaseVector) -> ngsolve.BaseVector:
        """Solution with the transposed matrix, which there must be."""
        assert self._factors is not None
        solution = right.CreateVector()
        self._factors.solve_transposed(right, solution)
        return solution

    def _end(self, state: ngsolve.GridFunction, update: ngsolve.BaseVector, size: float):
        """Apply the last update, which others may be combined with later."""
        self._mixing.remember(state.vec, update)
        self._sizes.append(size)
        state.vec.data -= update

    def _drop_matrix(
        self, state: ngsolve.GridFunction, size: float, precision: Precision | None = None
    ):
        """Make another one next, at the state whose update was smallest; `size`: of the last."""
        self._factors, self._precision = None, precision or self._precision
        if not size <= min(self._sizes):
            self._mixing.go_back(state.vec)
        self._restart()

    def _restart(self):
        """Forget updates: they are of another matrix or of another form."""
        self._mixing, self._sizes = _Mixing(), []

    def _compute(
        self,
        state: ngsolve.GridFunction,
        residual: ngsolve.BaseVector,
        update: ngsolve.BaseVector,
        result: Convergence,
    ) -> float:
        """Residual and update at the state, with a new matrix if there is none; rms of the update.

        Raises:
            FactorisationError: The new matrix is singular.
        """
        self._form.Apply(state.vec, residual)
        self._onto_free.Project(residual)
        if self._factors is None:
            self._form.AssembleLinearization(state.vec)
            self._factors = factorise(self._form, self._free, self._precision)
            result.factorisations += 1
        self._factors.solve(residual, update)
        failed = math.isfinite(residual.Norm()) and not math.isfinite(update.Norm())
        if failed and self._is_single:
            self._factors, self._precision = None, np.float64
            return self._compute(state, residual, update, result)
        root_of_size = math.sqrt(self._free.NumSet())
        size = update.Norm() / root_of_size
        result.residuals.append(residual.Norm() / root_of_size)
        result.updates.append(size)
        return size

    @property
    def _is_single(self) -> bool:
        """Whether factors are of single precision."""
        return isinstance(self._form, BatchedForm) and self._precision is np.float32

    def _is_rough(
        self, state: ngsolve.GridFunction, update: ngsolve.BaseVector, after: float
    ) -> bool:
        """Whether new factors were too imprecise for their first update, by its own residual.

        Args:
            state: The update is applied.
            update: The first one.
            after: Rms of the next one; where that is small no more needs to be known.
        """
        assert self._factors is not None
        if not self._is_single:
            return False
        size = update.Norm() / math.sqrt(self._free.NumSet())
        if after < ROUGHEST * size:
            return False
        residual, left, error = (update.CreateVector() for _ in range(3))
        error.data = state.vec + update
        self._form.Apply(error, residual)
        length = DIFFERENCE / max(size, DIFFERENCE)
        error.data -= length * update
        self._form.Apply(error, left)  # residual - length matrix update
        left -= (1 - length) * residual
        left *= 1 / length
        self._onto_free.Project(left)
        self._factors.solve(left, error)
        return not error.Norm() < ROUGHEST * update.Norm()

    def _give_up(self, result: Convergence, reason: str) -> Convergence:
        """The result with the reason; the matrix is of no further use."""
        self._factors = None
        self._restart()
        last = result.updates[-1]
        result.reason = f"{reason}: update {last:.1e} in iteration {result.iterations}"
        return result


class _Mixing:
    """Anderson's method for the updates with one matrix."""

    def __init__(self):
        self._states: list[NDArray] = []
        self._updates: list[NDArray] = []

    def apply(
        self, state: ngsolve.BaseVector, update: ngsolve.BaseVector, applied: ngsolve.BaseVector
    ):
        """Combine the update at a state with those before, and apply it."""
        self.remember(state, update)
        applied.data = update
        if len(self._states) > 1:
            states, updates = (np.diff(each, axis=0).T for each in (self._states, self._updates))
            shares, *_ = np.linalg.lstsq(updates, self._updates[-1])
            applied.FV().NumPy()[:] += (states - updates) @ shares
        state.data -= applied

    def remember(self, state: ngsolve.BaseVector, update: ngsolve.BaseVector):
        """An update at a state, to be combined with others later."""
        self._states = [*self._states[-DEPTH:], state.FV().NumPy().copy()]
        self._updates = [*self._updates[-DEPTH:], update.FV().NumPy().copy()]

    def go_back(self, state: ngsolve.BaseVector):
        """To the state whose update was smallest."""
        best = int(np.argmin([np.linalg.norm(update) for update in self._updates]))
        state.FV().NumPy()[:] = self._states[best]


def _hopeless(firsts: list[float]) -> str:
    """Why to give up, from the size of the first update with each matrix; empty to go on."""
    if not firsts[-1] < DIVERGENCE:
        return "diverged"
    if len(firsts) > STALL and firsts[-1] > min(firsts[:-STALL]) / 2:
        return "stalled"
    return ""


def _order(space: ngsolve.FESpace) -> int:
    """The highest polynomial order of the components of a space."""
    return max(component.globalorder for component in space.components)


def _is_slow(sizes: list[float], tolerance: float, patience: float) -> bool:
    """Whether updates with one matrix, of this rms, grow or promise to need more than patience."""
    last, since = sizes[-1], min(WINDOW, len(sizes) - 1)
    if not last < GROWTH * min(sizes):
        return True
    rate = math.log(sizes[-1 - since] / last) / since
    return rate * patience < math.log(last / tolerance)
