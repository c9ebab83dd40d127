"""Direct numerical simulation: quasi-steady velocities of force-free spheres in one geometry.

Quasi-steady. The mesh moves with the spheres, with velocity w between them, and the time derivative
at a fixed point of the mesh is dropped: the stress has settled at the present distances.

De = 0. The flow is Newtonian and linear; solved in high order, it is exact to 1e-7 at little cost.

Continuation. Deborah numbers are solved in ascending order. The guess of a step extrapolates up to
`HISTORY` solutions as polynomials of log(1 + De/De_0); a step that fails is halved.

Scouts. An order is preceded by the order below on the same path, down to the second, at a small
part of the cost. The solution of the lower order, plus what the higher one changed at the Deborah
number before, is the guess of the higher one. Where a scout fails, or its guess does, the steps are
taken in the order itself.

High De. Where stress layers and strands are thin a scout is of no use: what the order changes is as
large as what De does. On a mesh that is made for high De the scout leads to the last moderate De;
there the order changes, and what that changes is added to the solutions before it.
"""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import ngsolve

from viscotrain import newton
from viscotrain.flow import Flow, copy
from viscotrain.fluid import NEWTONIAN

NEWTONIAN_ORDER = 6  # of the velocity, at least
LOWEST_ORDER = 2  # of the velocity
GUESS_TOLERANCE = 1e-2  # of solutions between the De asked for and in lower orders
HISTORY = 3  # solutions that a guess is extrapolated from
DEBORAH_OF_ELASTICITY = 0.5  # De_0: the coordinate of the continuation is linear in De below it
SMALLEST_STEP = 1e-2  # in that coordinate; a continuation that needs smaller ones has failed
EASY, HARD = 1, 2  # factorisations of a step: so few lengthen the next one, more shorten it


@dataclass(frozen=True)
class SolverOptions:
    """Accuracy and convergence; meaning and defaults stand in `config.DnsConfig`."""

    tolerance: float
    max_iterations: int
    deborah_step: float


@dataclass(frozen=True)
class Solution:
    """Result at one Deborah number.

    Attributes:
        flow: Holds the solution in its `state` until the next one is asked for.
        deborah: lambda_1 Ubar/D.
        velocities: U in Ubar by name of the sphere; empty if not solved.
        pressure_gradient: -dp/dz, mean over the box, in eta_0 Ubar/D^2; NaN if not solved.
        convergence: Of the last iteration.
        iterations: Of all steps since the Deborah number before.
        seconds: CPU time of these.
    """

    flow: Flow
    deborah: float
    velocities: dict[str, float]
    pressure_gradient: float
    convergence: newton.Convergence
    iterations: int
    seconds: float

    @property
    def solved(self) -> bool:
        """Whether the solution converged."""
        return self.convergence.converged


def solve(
    flow: Flow,
    deborahs: Sequence[float],
    options: SolverOptions,
    by_way_of: Sequence[float] = (),
) -> Iterator[Solution]:
    """Solve the flow at ascending Deborah numbers.

    Ends after the first Deborah number that does not converge, which is yielded with the reason.

    Args:
        flow: Geometry, mesh and fluid.
        deborahs: lambda_1 Ubar/D, ascending.
        options: When an iteration has converged, and how far a step goes.
        by_way_of: Smaller De that a scout leads through before the first one, for high De.
    """
    path = _Continuation(flow, options, scout=_scout(flow, options))
    started = time.process_time()
    before = path.pass_through(by_way_of) if any(De > 0 for De in by_way_of) else 0
    for De in deborahs:
        if De > 0:
            convergence, iterations = path.advance(De)
            solver = flow
        else:
            solver = flow.variant(NEWTONIAN, max(flow.velocity_order, NEWTONIAN_ORDER))
            convergence = _iterate(solver, De, options.tolerance, options.max_iterations)
            iterations = convergence.iterations
        solved = convergence.converged
        yield Solution(
            flow=solver,
            deborah=De,
            velocities=solver.sphere_velocities() if solved else {},
            pressure_gradient=solver.pressure_gradient() if solved else math.nan,
            convergence=convergence,
            iterations=before + iterations,
            seconds=time.process_time() - started,
        )
        if not solved:
            return
        started, before = time.process_time(), 0


def _scout(flow: Flow, options: SolverOptions) -> "_Continuation | None":
    if flow.velocity_order <= LOWEST_ORDER:
        return None
    lower = flow.variant(flow.fluid, flow.velocity_order - 1)
    options = replace(options, tolerance=GUESS_TOLERANCE)
    return _Continuation(lower, options, scout=_scout(lower, options))


def _iterate(flow: Flow, De: float, tolerance: float, max_iterations: int) -> newton.Convergence:
    """Newton iteration at one Deborah number; De = 0 has viscosity eta_0 and psi = 0."""
    flow.deborah.Set(De)
    form, free = (flow.viscoelastic, flow.free) if De > 0 else (flow.newtonian, flow.free_newtonian)
    iteration = newton.ModifiedNewton(form, free)
    return iteration.solve(flow.state, tolerance=tolerance, max_iterations=max_iterations)


class _Continuation:
    """Solutions along De, and the length of the next step."""

    def __init__(self, flow: Flow, options: SolverOptions, scout: "_Continuation | None" = None):
        self.flow, self.options = flow, options
        self._scout = scout
        self._difference: ngsolve.BaseVector | None = None
        self._known: list[tuple[float, ngsolve.BaseVector]] = []
        self._step = self._longest_step = math.log(options.deborah_step)

    def pass_through(self, deborahs: Sequence[float]) -> int:
        """Let the scout go through these, then do without it; returns the number of iterations.

        What it did not reach is left to the steps that follow.
        """
        total = 0
        for De in deborahs:
            if De > 0 and self._scout is not None:  # De = 0 is a flow of its own
                convergence, iterations = self._scout.advance(De)
                total += iterations
                if not convergence.converged:
                    break
        self._replace_scout()
        if not self._known:
            return total
        coordinate, guess = self._known[-1]
        self.flow.state.vec.data = guess
        limit = self.options.max_iterations
        convergence = _iterate(self.flow, _deborah(coordinate), GUESS_TOLERANCE, limit)
        if convergence.converged:
            change = copy(self.flow.state.vec)
            change -= guess
            for _, vector in self._known:
                vector += change
        return total + convergence.iterations

    def advance(self, De: float) -> tuple[newton.Convergence, int]:
        """Go on to De: after the scout, or else in steps; also the number of iterations."""
        if self._scout is None:
            return self._walk(De)
        convergence, iterations = self._follow(self._scout, De)
        if not convergence.converged:
            self._replace_scout()
            convergence, more = self._walk(De)
            iterations += more
        return convergence, iterations

    def _walk(self, De: float) -> tuple[newton.Convergence, int]:
        """Go on to De in one step or several."""
        target, tolerance = _coordinate(De), self.options.tolerance
        convergence = newton.Convergence() if self._known else self._to(0.0, tolerance)
        iterations = convergence.iterations
        while convergence.converged and self._known[-1][0] < target:
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

    def _follow(self, scout: "_Continuation", De: float) -> tuple[newton.Convergence, int]:
        """Start from the scout's solution plus what the order changed at the De before."""
        convergence, iterations = scout.advance(De)
        if not convergence.converged:
            return convergence, iterations
        found = scout.flow.embed(scout.flow.state.vec, self.flow)
        if self._difference is not None:
            self.flow.state.vec.data += self._difference
        options = self.options
        convergence = _iterate(self.flow, De, options.tolerance, options.max_iterations)
        iterations += convergence.iterations
        if convergence.converged:
            self._remember(_coordinate(De))
            self._difference = copy(self.flow.state.vec)
            self._difference -= found
        return convergence, iterations

    def _replace_scout(self):
        """Go on without it; what it knows is a start where this order knows nothing."""
        scout, self._scout = self._scout, None
        if not self._known and scout is not None:
            self._known = [(at, scout.flow.embed(known, self.flow)) for at, known in scout._known]

    def _to(self, coordinate: float, tolerance: float) -> newton.Convergence:
        """One step; remembered if it converges."""
        self._extrapolate(coordinate)
        De = _deborah(coordinate)
        convergence = _iterate(self.flow, De, tolerance, self.options.max_iterations)
        if convergence.converged:
            self._remember(coordinate)
            if convergence.factorisations <= EASY:
                self._step = min(self._step * 1.5, self._longest_step)
            elif convergence.factorisations > HARD:
                self._step /= 1.5
        return convergence

    def _remember(self, coordinate: float):
        self._known = [*self._known, (coordinate, copy(self.flow.state.vec))][-HISTORY:]

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
