"""Direct numerical simulation: quasi-steady velocities of force-free spheres in one geometry.

Quasi-steady. The mesh moves with the spheres, with velocity w between them, and the time derivative
at a fixed point of the mesh is dropped: the stress has settled at the present distances.

De = 0. The flow is Newtonian and linear; solved in high order, it is exact to 1e-7 at little cost.

Ladder. The way to any De leads over the rungs 1, 3, 10, 30, ... below it. They are passed in the
order below the one asked for, and the mesh is refined at each where that predicts too large an
error of the order asked for (`refinement`). From its rung a De is reached by a branch with a mesh
of its own, refined in the same way, and at last in the order asked for by its own error. So what is
found at one De does not depend on which others are asked for.

Continuation. The guess of a step extrapolates up to `HISTORY` solutions as polynomials of
log(1 + De/De_0); a step that fails is halved.

Scouts. An order is preceded by the order below on the same path, down to the second, at a small
part of the cost. The solution of the lower order, plus what the higher one changed at the De
before, is the guess of the higher one. Where a scout fails, or its guess does, the steps are taken
in the order itself. The scouts are what the errors are estimated from.

Stuck. An iteration that cannot go on misses resolution first: the mesh is refined at the last De
that was solved, and the step taken again. Where that does not help, the De is solved on the mesh of
the start, where upwinding is stronger, and is accurate only if its estimate says so. Such points
are marked; they may depend on which De were asked for before.
"""

import itertools
import math
import time
from collections.abc import Callable, Iterator, Sequence
from copy import copy as copy_object
from dataclasses import dataclass, replace

import ngsolve

from viscotrain.flow import newton, refinement
from viscotrain.flow.discretisation import Flow, copy
from viscotrain.flow.factorisation import FactorisationError
from viscotrain.flow.meshes import Sizes
from viscotrain.fluid.parameters import NEWTONIAN

NEWTONIAN_ORDER = 6  # of the velocity, at least
LOWEST_ORDER = 2  # of the velocity
GUESS_TOLERANCE = 1e-2  # of solutions between the De asked for and in lower orders
LOOSE_TOLERANCE = 1e-4  # of the solutions that tell whether the mesh is fine enough
SCOUT_TOLERANCE = 1e-5  # of the solutions that errors are estimated from
VELOCITY_TOLERANCE = 1e-7  # Ubar, in the last update of velocities between spheres; not of scouts
HISTORY = 3  # solutions that a guess is extrapolated from
DEBORAH_OF_ELASTICITY = 0.5  # De_0: the coordinate of the continuation is linear in De below it
SMALLEST_STEP = 0.05  # in that coordinate; a continuation that needs smaller ones has failed
EASY, HARD = 1, 2  # factorisations of a step: so few lengthen the next one, more shorten it
RUNGS = (1.0, 3.0)  # of the ladder in one decade
PREDICTION = 2.5  # over the error of an order: how the order below predicts it, about
LEAST_REDUCTION, MOST_REDUCTION = 2.0, 16.0  # of the error in one refinement
REFINEMENTS = 4  # of one De
INSISTENCE = 1.4  # factor on the reduction asked for with each refinement that was not enough
LARGE = 0.8  # over the elements that a mesh may have: it is not refined any more
SHORT_STEP = 1.5  # ratio of De where nothing else helped
RESCUES = 2  # refinements of one De that is stuck
RESCUE_REDUCTION = 4.0  # of the error, in each of them

Remesh = Callable[[Sizes], ngsolve.Mesh]


@dataclass(frozen=True)
class SolverOptions:
    """Accuracy and convergence; meaning and defaults stand in `config.DnsConfig`."""

    tolerance: float
    max_iterations: int
    deborah_step: float
    accuracy: float = math.inf
    relative_accuracy: float = 0.0
    max_elements: int = 0


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
        error: Estimated errors; None if there is no estimate.
        accurate: Whether the estimate is within the accuracy asked for.
        fallback: Whether it is of the start mesh, since the iteration was stuck on refined ones.
    """

    flow: Flow
    deborah: float
    velocities: dict[str, float]
    pressure_gradient: float
    convergence: newton.Convergence
    iterations: int
    seconds: float
    error: refinement.Estimate | None
    accurate: bool
    fallback: bool = False

    @property
    def solved(self) -> bool:
        """Whether the solution converged."""
        return self.convergence.converged

    @property
    def estimated_error(self) -> float:
        """Of the velocities that count, in Ubar; NaN without an estimate."""
        return math.nan if self.error is None else self.error.decisive


def solve(
    flow: Flow, deborahs: Sequence[float], options: SolverOptions, remesh: Remesh | None = None
) -> Iterator[Solution]:
    """Solve the flow at ascending Deborah numbers.

    Ends after the first Deborah number that does not converge, which is yielded with the reason.

    Args:
        flow: Geometry, fluid and the mesh to start with.
        deborahs: lambda_1 Ubar/D, ascending.
        options: When an iteration has converged, how far a step goes, how accurate the result is.
        remesh: Makes a mesh of the geometry with other sizes; None keeps the mesh.
    """
    ladder = _Ladder(flow, options, remesh)
    start_mesh: _Continuation | None = None
    for De in deborahs:
        started = time.process_time()
        solver, outcome = ladder.at(De) if De > 0 else _newtonian(flow, options)
        if De > 0 and remesh is not None and not outcome.convergence.converged:
            start_mesh = start_mesh or _Continuation(flow.on(flow.mesh), options)
            solver, outcome = _better((solver, outcome), _plainly(start_mesh, De, options))
        solved = outcome.convergence.converged
        yield Solution(
            flow=solver,
            deborah=De,
            velocities=solver.sphere_velocities() if solved else {},
            pressure_gradient=solver.pressure_gradient() if solved else math.nan,
            seconds=time.process_time() - started,
            **vars(outcome),
        )
        if not solved:
            return


@dataclass
class _Outcome:
    """What became of one De; as in `Solution`."""

    convergence: newton.Convergence
    iterations: int
    error: refinement.Estimate | None = None
    accurate: bool = False
    fallback: bool = False

    def judge(self, error: refinement.Estimate | None, allowed: float):
        """Take the estimate, and say whether it is within what is allowed, in Ubar."""
        self.error = error
        self.accurate = error is not None and error.decisive <= allowed


def _plainly(path: "_Continuation", De: float, options: SolverOptions) -> tuple[Flow, _Outcome]:
    """Go on to De in short steps in the order asked for, on the mesh as it is."""
    iterations = 0
    while True:
        step = min(De, SHORT_STEP * max(path.deborah, 1.0))
        convergence, more = path.advance(step)
        iterations += more
        if step == De or not convergence.converged:
            break
    outcome = _Outcome(convergence, iterations, fallback=True)
    if convergence.converged:
        outcome.judge(path.estimate(), _allowed(path.flow, options))
    return path.flow, outcome


def _better(first: tuple[Flow, _Outcome], second: tuple[Flow, _Outcome]) -> tuple[Flow, _Outcome]:
    """The second result if it converged, or else the first; with the iterations of both."""
    iterations = first[1].iterations + second[1].iterations
    flow, outcome = second if second[1].convergence.converged else first
    return flow, replace(outcome, iterations=iterations)


def _newtonian(flow: Flow, options: SolverOptions) -> tuple[Flow, _Outcome]:
    """De = 0, with an order well below, which costs little, to bound the error."""
    order = max(flow.velocity_order, NEWTONIAN_ORDER)
    below, solver = (flow.variant(NEWTONIAN, k) for k in (order - 2, order))
    for each in (below, solver):
        iteration = newton.ModifiedNewton(each.newtonian, each.free_newtonian)
        convergence = iteration.solve(
            each.state, tolerance=options.tolerance, max_iterations=options.max_iterations
        )
    error = refinement.compared(solver, below)
    accurate = convergence.converged and error.decisive <= _allowed(solver, options)
    return solver, _Outcome(convergence, convergence.iterations, error, accurate)


def _allowed(flow: Flow, options: SolverOptions) -> float:
    """Error that is allowed in the velocities that count."""
    largest = max(map(abs, flow.relative_velocities()), default=0.0)
    return max(options.accuracy, options.relative_accuracy * largest)


def _stuck_at(rung: float, outcome: _Outcome, iterations: int) -> _Outcome:
    """The outcome for a De beyond a rung that was not reached."""
    reason = f"on the way, at De = {rung:g}: {outcome.convergence.reason}"
    return _Outcome(replace(outcome.convergence, reason=reason), iterations)


class _Ladder:
    """The rungs passed so far, and the branches that leave from them."""

    def __init__(self, flow: Flow, options: SolverOptions, remesh: Remesh | None):
        self._top, self._options, self._remesh = flow, options, remesh
        self._rungs = (10**n * rung for n in itertools.count() for rung in RUNGS)
        self._next = next(self._rungs)
        below = flow.variant(flow.fluid, max(flow.velocity_order - 1, LOWEST_ORDER))
        self._path = _Continuation(below, replace(options, tolerance=SCOUT_TOLERANCE))
        self._branch: _Continuation | None = None  # the last one

    def at(self, De: float) -> tuple[Flow, _Outcome]:
        """Solve in the order asked for."""
        iterations = 0
        while self._next <= De:
            path, outcome = self._reach(self._path, self._next, ahead=1)
            iterations += outcome.iterations
            if not outcome.convergence.converged:
                return path.flow, _stuck_at(self._next, outcome, iterations)
            self._path, self._next = path, next(self._rungs)
        path, outcome = self._reach(self._path.twin(), De, ahead=1)
        iterations += outcome.iterations
        if not outcome.convergence.converged:
            return path.flow, replace(outcome, iterations=iterations)
        self._branch, outcome = self._reach(self._branch_off(path), De)
        outcome.iterations += iterations
        if outcome.convergence.converged:
            outcome.convergence = self._branch.finish(self._options.tolerance)
            outcome.iterations += outcome.convergence.iterations
        return self._branch.flow, outcome

    def _branch_off(self, path: "_Continuation") -> "_Continuation":
        """From the path, in the order asked for."""
        last = self._branch
        if last is not None and last.flow.mesh is path.flow.mesh:
            branch = last.twin()
            branch.scout = path
            return branch
        options = replace(self._options, tolerance=max(self._options.tolerance, LOOSE_TOLERANCE))
        if self._top.mesh is path.flow.mesh:
            return _Continuation(self._top, options, path)
        return _Continuation(self._top.on(path.flow.mesh), options, path)

    def _reach(
        self, path: "_Continuation", De: float, ahead: int = 0
    ) -> tuple["_Continuation", _Outcome]:
        """Go on to De and refine the mesh as long as the order `ahead` is not accurate there."""
        convergence, iterations = self._advance(path, De)
        outcome = _Outcome(convergence, iterations)
        refinements = 0
        while convergence.converged:
            allowed = _allowed(path.flow, self._options) * (PREDICTION if ahead else 1)
            outcome.judge(path.error or path.estimate(ahead), allowed)
            if outcome.accurate or not self._can_refine(path, refinements):
                break
            finer = path.twin()
            excess = outcome.error.decisive / allowed
            finer.refine(self._finer(path, excess * INSISTENCE**refinements))
            convergence, more = finer.advance(De)
            outcome.iterations += more
            refinements += 1
            if convergence.converged:
                path, outcome.convergence = finer, convergence
        return path, outcome

    def _advance(self, path: "_Continuation", De: float) -> tuple[newton.Convergence, int]:
        """Go on to De, on finer meshes if the path is stuck without."""
        convergence, iterations = path.advance(De)
        for _ in range(RESCUES):
            if convergence.converged or not self._can_refine(path):
                break
            path.refine(self._finer(path, RESCUE_REDUCTION))
            convergence, more = path.advance(De)
            iterations += more
        return convergence, iterations

    def _can_refine(self, path: "_Continuation", refinements: int = 0) -> bool:
        return (
            self._remesh is not None
            and refinements < REFINEMENTS
            and path.flow.mesh.ne < LARGE * self._options.max_elements
            and path.last_error() is not None
        )

    def _finer(self, path: "_Continuation", excess: float) -> ngsolve.Mesh:
        """A mesh on which the error that was estimated last is smaller."""
        reduction = min(max(1.5 * excess, LEAST_REDUCTION), MOST_REDUCTION)
        most = self._options.max_elements
        sizes = refinement.refined(path.flow.mesh, path.last_error(), reduction, most)
        return self._remesh(sizes)


class _Continuation:
    """Solutions along De in one order and on one mesh, and the length of the next step."""

    def __init__(self, flow: Flow, options: SolverOptions, scout: "_Continuation | None" = None):
        self.flow, self.options = flow, options
        if scout is None and flow.velocity_order > LOWEST_ORDER:
            lower = flow.variant(flow.fluid, flow.velocity_order - 1)
            loose = SCOUT_TOLERANCE if flow.velocity_order - 1 > LOWEST_ORDER else GUESS_TOLERANCE
            scout = _Continuation(lower, replace(options, tolerance=loose))
        self.scout = scout
        self.error: refinement.Estimate | None = None  # at the De where it is
        self._error_before: refinement.Estimate | None = None  # at the De before
        self._newton: newton.ModifiedNewton | None = None  # of the last iteration
        self._difference: ngsolve.BaseVector | None = None
        self._known: list[tuple[float, ngsolve.BaseVector]] = []
        self._interpolated = False  # whether the last one is known from another mesh only
        self._step = self._longest_step = math.log(options.deborah_step)

    def twin(self) -> "_Continuation":
        """Another one, where this one is; they go on independently of each other."""
        twin = copy_object(self)
        twin.scout, twin._newton = self.scout and self.scout.twin(), None
        return twin

    @property
    def deborah(self) -> float:
        """Where it is; 0 at the start."""
        return _deborah(self._known[-1][0]) if self._known else 0.0

    def last_error(self) -> refinement.Estimate | None:
        """The last estimate on this mesh, of this order or else of the scout, now if need be."""
        own = self.error or self._error_before
        if own is None and self.scout is not None:
            own = self.scout.last_error() or self.scout.estimate(ahead=1)
        return own

    def advance(self, De: float) -> tuple[newton.Convergence, int]:
        """Go on to De: after the scout, or else in steps; also the number of iterations."""
        if self._is_at(De):
            self.flow.state.vec.data = self._known[-1][1]
            return newton.Convergence(), 0
        self._error_before, self.error = self.error or self._error_before, None
        if self.scout is None:
            return self._walk(De)
        convergence, iterations = self._follow(De)
        if not convergence.converged and not self._known:
            iterations += self._start_earlier()
        if not convergence.converged and (self._known or not self.scout._known):
            convergence, more = self._walk(De)
            iterations += more
            if convergence.converged:
                iterations += self.scout.take(self, De)
        return convergence, iterations

    def _start_earlier(self) -> int:
        """Solve at the De before, which the scout knows; returns the iterations."""
        if len(self.scout._known) < 2:
            return 0
        coordinate, guess = self.scout._known[-2]
        self.flow.state.vec.data = self.scout.flow.embed(guess, self.flow)
        convergence = self._iterate(_deborah(coordinate), self.options.tolerance)
        if convergence.converged:
            self._remember(coordinate)
        return convergence.iterations

    def estimate(self, ahead: int = 0) -> refinement.Estimate | None:
        """Errors of the solution at De, or in an order `ahead`; None without one of the scout.

        None too if the matrix of the adjoint problem is singular.
        """
        scout = self.scout
        if not self._known or scout is None or not self.flow.geometry.spheres:
            return None
        coordinate, solution = self._known[-1]
        lower = scout.flow.velocity_order < self.flow.velocity_order
        if not lower or not scout._is_at(_deborah(coordinate)):
            return None
        below = scout.flow.embed(scout._known[-1][1], self.flow)
        self.flow.state.vec.data = solution
        self.flow.deborah.Set(_deborah(coordinate))
        if self._newton is None:
            self._newton = newton.ModifiedNewton(self.flow.viscoelastic, self.flow.free)
        try:
            adjoint = self._newton.adjoint(self.flow.state)
        except FactorisationError:
            return None
        self.error = refinement.estimate(self.flow, below, adjoint, ahead)
        return self.error

    def finish(self, tolerance: float) -> newton.Convergence:
        """Go on with the iteration where it is, until the velocities are as accurate, too."""
        self.flow.state.vec.data = self._known[-1][1]
        self.flow.deborah.Set(self.deborah)
        iteration = self._newton or newton.ModifiedNewton(self.flow.viscoelastic, self.flow.free)
        convergence = iteration.solve(
            self.flow.state,
            tolerance=tolerance,
            max_iterations=self.options.max_iterations,
            watch=self.flow.speeds,
            watch_tolerance=VELOCITY_TOLERANCE,
        )
        self._newton = None  # its factors take much memory
        if convergence.converged:
            self._remember(self._known[-1][0])
        return convergence

    def refine(self, mesh: ngsolve.Mesh):
        """Go on with another mesh; solutions are interpolated and will be solved again."""
        flow = self.flow.on(mesh)
        self._known = [(at, self.flow.embed(known, flow)) for at, known in self._known]
        self.flow, self._interpolated = flow, bool(self._known)
        self._difference = self._newton = self.error = self._error_before = None
        if self.scout is not None:
            self.scout.refine(mesh)

    def take(self, higher: "_Continuation", De: float) -> int:
        """Solve at De from what a higher order has found there; returns the iterations."""
        guess = higher.flow.embed(copy(higher.flow.state.vec), self.flow)
        higher.flow.state.vec.data = higher._known[-1][1]
        self.flow.state.vec.data = guess
        convergence = self._iterate(De, self.options.tolerance)
        if convergence.converged:
            self._remember(_coordinate(De))
        return convergence.iterations

    def _is_at(self, De: float) -> bool:
        return (
            bool(self._known)
            and not self._interpolated
            and math.isclose(self._known[-1][0], _coordinate(De))
        )

    def _iterate(self, De: float, tolerance: float) -> newton.Convergence:
        """Newton iteration at one De > 0, or at De = 0 with psi = 0."""
        self.flow.deborah.Set(De)
        if De > 0:
            form, free = self.flow.viscoelastic, self.flow.free
        else:
            form, free = self.flow.newtonian, self.flow.free_newtonian
        self._newton = newton.ModifiedNewton(form, free)
        return self._newton.solve(
            self.flow.state, tolerance=tolerance, max_iterations=self.options.max_iterations
        )

    def _walk(self, De: float) -> tuple[newton.Convergence, int]:
        """Go on to De in one step or several."""
        target, tolerance = _coordinate(De), self.options.tolerance
        convergence = newton.Convergence() if self._known else self._to(0.0, tolerance)
        iterations = convergence.iterations
        if convergence.converged and self._interpolated:
            convergence = self._to(self._known[-1][0], tolerance)
            iterations += convergence.iterations
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

    def _follow(self, De: float) -> tuple[newton.Convergence, int]:
        """Start from the scout's solution plus what the order changed at the De before."""
        scout = self.scout
        convergence, iterations = scout.advance(De)
        scout._newton = None  # its factors take much memory
        if not convergence.converged:
            return convergence, iterations
        found = scout.flow.embed(scout._known[-1][1], self.flow)
        here = self._interpolated and math.isclose(self._known[-1][0], _coordinate(De))
        if here:
            self.flow.state.vec.data = self._known[-1][1]
        elif self._difference is not None:
            self.flow.state.vec.data += self._difference
        convergence = self._iterate(De, self.options.tolerance)
        iterations += convergence.iterations
        if convergence.converged:
            self._remember(_coordinate(De))
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
