"""Continuation: solutions along the Deborah number in one order, on one mesh.

Steps. The guess of a step extrapolates up to `HISTORY` solutions as polynomials of
log(1 + De/De_0); a step that fails is halved.

Scouts. An order may have a scout: the order below, on the same mesh, which goes the same way first
at a small part of the cost. The solution of the scout, plus what the order changed at the De
before, is the guess. Where the scout fails, or its guess does, the steps are taken in the order
itself. The first updates of an order from the solution of its scout are what the error of the scout
is estimated from (`refinement`); the iteration goes on from there.
"""

import math
from copy import copy as copy_object
from dataclasses import dataclass

import ngsolve

from viscotrain.flow import newton, refinement
from viscotrain.flow.discretisation import Flow, copy
from viscotrain.flow.factorisation import FactorisationError

GUESS_TOLERANCE = 1e-2  # of solutions between the De asked for
VELOCITY_TOLERANCE = 1e-7  # Ubar, in the last update of velocities between spheres; not of scouts
HISTORY = 3  # solutions that a guess is extrapolated from
DEBORAH_OF_ELASTICITY = 0.5  # De_0: the coordinate of the continuation is linear in De below it
SMALLEST_STEP = 0.05  # in that coordinate; a continuation that needs smaller ones has failed
EASY, HARD = 1, 2  # factorisations of a step: so few lengthen the next one, more shorten it


@dataclass(frozen=True)
class Steps:
    """How far a step goes, and how long its iteration; see `config.DnsConfig`."""

    max_iterations: int
    deborah_ratio: float


class Continuation:
    """Solutions along De in one order and on one mesh, and the length of the next step.

    Args:
        flow: Geometry, mesh, fluid and order.
        tolerance: Rms update of the solutions.
        steps: How they are reached.
        scout: The order below on the same mesh; None to do without.
    """

    def __init__(
        self, flow: Flow, tolerance: float, steps: Steps, scout: "Continuation | None" = None
    ):
        self.flow, self.scout = flow, scout
        self._tolerance, self._max_iterations = tolerance, steps.max_iterations
        self._newton: newton.ModifiedNewton | None = None  # of the last iteration
        self._begun: newton.ModifiedNewton | None = None  # from the solution of the scout
        self._difference: ngsolve.BaseVector | None = None
        self._known: list[tuple[float, ngsolve.BaseVector]] = []
        self._interpolated = False  # whether what is known is from another mesh only
        self._step = self._longest_step = math.log(steps.deborah_ratio)

    def twin(self) -> "Continuation":
        """Another one, where this one is; they go on independently of each other."""
        twin = copy_object(self)
        twin.scout, twin._newton, twin._begun = self.scout and self.scout.twin(), None, None
        return twin

    @property
    def deborah(self) -> float:
        """Where it is; 0 at the start."""
        return _deborah(self._known[-1][0]) if self._known else 0.0

    def start_from(self, others: "list[Continuation]"):
        """Guesses from solutions on another mesh or in another order, interpolated."""
        found: dict[float, ngsolve.BaseVector] = {}
        for other in others:
            found |= {at: other.flow.embed(known, self.flow) for at, known in other._known}
            other.restore()
        self._known = sorted(found.items(), key=lambda item: item[0])[-HISTORY:]
        self._interpolated = bool(self._known)

    def restore(self):
        """Put the last solution into the state of the flow, and its De."""
        if self._known:
            self.flow.state.vec.data = self._known[-1][1]
            self.flow.deborah.Set(self.deborah)

    def advance(self, De: float) -> tuple[newton.Convergence, int]:
        """Go on to De: after the scout, or else in steps; also the number of iterations."""
        if self.is_at(De):
            self.restore()
            return newton.Convergence(), 0
        if self.scout is None:
            return self._walk(De)
        convergence, iterations = self._follow(self.scout, De)
        if not convergence.converged and not self._known:
            iterations += self._start_earlier(self.scout)
        if not convergence.converged and (self._known or not self.scout._known):
            convergence, more = self._walk(De)
            iterations += more
            if convergence.converged:
                iterations += self.scout.take(self, De)
        return convergence, iterations

    def _start_earlier(self, scout: "Continuation") -> int:
        """Solve at the De before, which the scout knows; returns the iterations."""
        if len(scout._known) < 2:
            return 0
        coordinate, guess = scout._known[-2]
        self.flow.state.vec.data = scout.flow.embed(guess, self.flow)
        convergence = self._iterate(_deborah(coordinate), self._tolerance)
        if convergence.converged:
            self._remember(coordinate)
        return convergence.iterations

    def error_below(self, De: float) -> refinement.Estimate | None:
        """Errors of the solution of the scout, which is at De; None without a solution to compare.

        None too if the matrix is singular.
        """
        scout = self.scout
        if scout is None or not self.flow.geometry.spheres or not scout.is_at(De):
            return None
        scout.flow.embed(scout._known[-1][1], self.flow)
        scout.restore()
        self.flow.deborah.Set(De)
        self._begun = newton.ModifiedNewton(self.flow.viscoelastic, self.flow.free)
        try:
            return refinement.estimate(scout.flow, self.flow, self._begun)
        except FactorisationError:
            self._begun = None
            return None

    def forget_matrix(self):
        """Let go of what `error_below` has begun: its factors take much memory."""
        self._begun = None

    def settle(self, De: float) -> newton.Convergence:
        """Solve at De from the state as it is, until the velocities are as accurate, too."""
        return self._iterate(De, self._tolerance, VELOCITY_TOLERANCE)

    def finish(self, tolerance: float) -> newton.Convergence:
        """Go on with the iteration where it is, until the velocities are as accurate, too."""
        self.restore()
        iteration = self._newton or newton.ModifiedNewton(self.flow.viscoelastic, self.flow.free)
        convergence = iteration.solve(
            self.flow.state,
            tolerance=tolerance,
            max_iterations=self._max_iterations,
            watch=self.flow.speeds,
            watch_tolerance=VELOCITY_TOLERANCE,
            onwards=True,
        )
        self._newton = None  # its factors take much memory
        if convergence.converged:
            self._remember(self._known[-1][0])
        return convergence

    def take(self, higher: "Continuation", De: float) -> int:
        """Solve at De from what a higher order has found there; returns the iterations."""
        guess = higher.flow.embed(copy(higher.flow.state.vec), self.flow)
        higher.restore()
        self.flow.state.vec.data = guess
        convergence = self._iterate(De, self._tolerance)
        if convergence.converged:
            self._remember(_coordinate(De))
        return convergence.iterations

    def is_at(self, De: float) -> bool:
        """Whether the solution at De is the last one."""
        return (
            bool(self._known)
            and not self._interpolated
            and math.isclose(self._known[-1][0], _coordinate(De))
        )

    def _iterate(
        self, De: float, tolerance: float, of_velocities: float = math.inf
    ) -> newton.Convergence:
        """Newton iteration at one De > 0, or at De = 0 with psi = 0."""
        self.flow.deborah.Set(De)
        if De > 0:
            form, free = self.flow.viscoelastic, self.flow.free
        else:
            form, free = self.flow.newtonian, self.flow.free_newtonian
        self._newton = self._begun or newton.ModifiedNewton(form, free)
        self._begun = None
        return self._newton.solve(
            self.flow.state,
            tolerance=tolerance,
            max_iterations=self._max_iterations,
            watch=self.flow.speeds,
            watch_tolerance=of_velocities,
            onwards=True,
        )

    def _walk(self, De: float) -> tuple[newton.Convergence, int]:
        """Go on to De in one step or several."""
        target, tolerance = _coordinate(De), self._tolerance
        convergence = newton.Convergence() if self._known else self._to(0.0, tolerance)
        iterations = convergence.iterations
        while self._interpolated:
            convergence = self._to(self._known[-1][0], tolerance)
            iterations += convergence.iterations
            if self._interpolated and len(self._known) == 1:
                break
            if self._interpolated:
                self._known.pop()  # too hard for a guess from another mesh: from a smaller De
        while convergence.converged and self._known[-1][0] < target * (1 - 1e-9):
            here = self._known[-1][0]
            steps = max(1, math.ceil((target - here) / self._step - 0.1))
            step = (target - here) / steps
            if steps == 1:
                trial = self._to(target, tolerance)
            else:
                trial = self._to(here + step, max(tolerance, GUESS_TOLERANCE))
            iterations += trial.iterations
            if not trial.converged:
                self._step = step / 2
            if trial.converged or self._step < SMALLEST_STEP:
                convergence = trial
        return convergence, iterations

    def _follow(self, scout: "Continuation", De: float) -> tuple[newton.Convergence, int]:
        """Start from the scout's solution plus what the order changed at the De before."""
        convergence, iterations = scout.advance(De)
        scout._newton = None  # its factors take much memory
        if not convergence.converged:
            return convergence, iterations
        found = None
        if self._begun is None:
            found = scout.flow.embed(scout._known[-1][1], self.flow)
            if self._difference is not None:
                self.flow.state.vec.data += self._difference
        convergence = self._iterate(De, self._tolerance)
        iterations += convergence.iterations
        if convergence.converged:
            self._remember(_coordinate(De))
        if convergence.converged and found is not None:
            self._difference = copy(self.flow.state.vec)
            self._difference -= found
        return convergence, iterations

    def _to(self, coordinate: float, tolerance: float) -> newton.Convergence:
        """One step; remembered if it converges."""
        self._extrapolate(coordinate)
        convergence = self._iterate(_deborah(coordinate), tolerance)
        if convergence.converged:
            self._remember(coordinate)
            if convergence.factorisations <= EASY:
                self._step = min(self._step * 1.5, self._longest_step)
            elif convergence.factorisations > HARD:
                self._step /= 1.5
        return convergence

    def _remember(self, coordinate: float):
        others = [(at, known) for at, known in self._known if not math.isclose(at, coordinate)]
        self._known = [*others, (coordinate, copy(self.flow.state.vec))][-HISTORY:]
        self._interpolated = False

    def _extrapolate(self, coordinate: float):
        """Lagrange polynomial through the known solutions; the state as it is without any."""
        if not self._known:
            return
        guess = self.flow.state.vec
        guess[:] = 0.0
        for here, solution in self._known:
            others = [there for there, _ in self._known if there != here]
            weight = math.prod((coordinate - there) / (here - there) for there in others)
            guess.data += weight * solution


def _coordinate(De: float) -> float:
    return math.log1p(De / DEBORAH_OF_ELASTICITY)


def _deborah(coordinate: float) -> float:
    return DEBORAH_OF_ELASTICITY * math.expm1(coordinate)
