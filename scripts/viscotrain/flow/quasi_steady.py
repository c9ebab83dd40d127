"""Direct numerical simulation: quasi-steady velocities of force-free spheres in one geometry.

Quasi-steady. The mesh moves with the spheres, with velocity w between them, and the time derivative
at a fixed point of the mesh is dropped: the stress has settled at the present distances.

De = 0. The flow is Newtonian and linear; solved in high order, it is exact to 1e-7 at little cost.

Ladder. The way to any De leads over the rungs 1, 3, 10, 30, ... below it, on the mesh of the start
and in the order below the lowest that results are taken from. From its rung a De is reached by a
branch of its own, so that what is found there does not depend on which others are asked for.

Climb. From there the order is raised. The iteration of each order begins with the error of the
order below (`refinement`), and goes on only if that is too large. Where orders gain little, it ends
one order higher, with the error that is promised there. Where no order within the limits promises
to be accurate, or only at a higher cost than on a finer mesh, there is such a mesh for this De, and
a new climb up to this order on it, from well below: guesses from another mesh are poor, and low
orders cost little. There the error tells early whether the mesh keeps its promise.

Stuck. Where a higher order cannot be solved, the mesh is refined by the error of the order below.
Where nothing was found, the De is solved on the mesh of the start in short steps of De, as long as
these take few iterations, and is accurate only if its estimate says so. Such points are marked;
they may depend on which De were asked for before. Pseudo-transient continuation (C. T. Kelley & D.
E. Keyes, SIAM J. Numer. Anal. 35, 1998, 508) found no more: on three points of the sample of
`studies.robustness` that are lost, none of five variants converged within 60 to 160 steps.
"""

import itertools
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import ngsolve
import numpy as np

from viscotrain.flow import newton, refinement
from viscotrain.flow.continuation import GUESS_TOLERANCE, Continuation, Steps
from viscotrain.flow.discretisation import Flow, copy
from viscotrain.flow.meshes import Sizes
from viscotrain.fluid.parameters import NEWTONIAN

NEWTONIAN_ORDER = 6  # of the velocity, at least
LOWEST_ORDER = 3  # of the velocity, of results; scouts go one below
# Of the solutions that errors are estimated from. Of 54 points of the sample of
# `studies.robustness` whose meshes are the same with 1e-5 and matrices made more often, estimates
# of three differ by more than 10 %, by 44 % at most: errors are not known that well.
SCOUT_TOLERANCE = 1e-3
RUNGS = (1.0, 3.0)  # of the ladder in one decade
REFINEMENTS = 3  # of one De
LEAST_GAIN = 1.5  # of a mesh over that before, for another one to be tried
RESCUE_REDUCTION = 4.0  # of the error, by the mesh of an order that is stuck
SHORT_STEP = 1.5  # ratio of De where nothing else helped
MOST_SOLVES = 10  # of `max_iterations` each, that such steps are worth

Remesh = Callable[[Sizes], ngsolve.Mesh]


@dataclass(frozen=True)
class SolverOptions:
    """Accuracy and convergence; meaning and defaults stand in `config.DnsConfig`."""

    tolerance: float
    max_iterations: int
    deborah_step: float
    accuracy: float = math.inf
    relative_accuracy: float = 0.0
    max_velocity_order: int = 0
    max_unknowns: float = 0

    @property
    def steps(self) -> Steps:
        """Of continuations."""
        return Steps(self.max_iterations, self.deborah_step)

    @property
    def limits(self) -> refinement.Limits:
        """Of refinement."""
        return refinement.Limits(self.max_velocity_order, self.max_unknowns)


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
        reached: Largest De up to `deborah` that was solved on the way, be it in low order.
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
    fallback: bool
    reached: float

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
        flow: Geometry, fluid and the mesh to start with; in the lowest order of results.
        deborahs: lambda_1 Ubar/D, ascending.
        options: When an iteration has converged, how far a step goes, how accurate the result is.
        remesh: Makes a mesh of the geometry with other sizes; None keeps the mesh.
    """
    ladder = _Ladder(flow, options, remesh)
    start_mesh: Continuation | None = None
    for De in deborahs:
        started = time.process_time()
        found = ladder.at(De) if De > 0 else _newtonian(flow, options)
        if not found.convergence.converged and De > 0 and remesh is not None:
            start_mesh = start_mesh or _scouted(flow.on(flow.mesh), options)
            found = _better(found, _plainly(start_mesh, De, options))
        solved = found.convergence.converged
        yield Solution(
            flow=found.flow,
            deborah=De,
            velocities=found.flow.sphere_velocities() if solved else {},
            pressure_gradient=found.flow.pressure_gradient() if solved else math.nan,
            convergence=found.convergence,
            iterations=found.iterations,
            seconds=time.process_time() - started,
            error=found.error,
            accurate=found.accurate,
            fallback=found.fallback,
            reached=De if solved else found.reached,
        )
        if not solved:
            return


def in_order(solution: Solution, order: int, options: SolverOptions) -> dict[str, float]:
    """Velocities as in `Solution` in another order of the velocity on the same mesh.

    Args:
        solution: The last one asked for, solved.
        order: Of the velocity.
        options: When an iteration has converged.
    """
    known, De = solution.flow, solution.deborah
    flow = known.variant(known.fluid, order)
    flow.state.vec.data = known.embed(copy(known.state.vec), flow)
    path = Continuation(flow, options.tolerance, options.steps)
    return flow.sphere_velocities() if path.settle(De).converged else {}


@dataclass
class _Found:
    """What became of one De; as in `Solution`."""

    flow: Flow
    convergence: newton.Convergence
    iterations: int
    error: refinement.Estimate | None = None
    accurate: bool = False
    fallback: bool = False
    reached: float = 0.0

    def judge(self, error: refinement.Estimate | None, options: SolverOptions):
        """Take the estimate, and say whether it is within what is allowed."""
        self.error = error
        self.accurate = error is not None and error.decisive <= _allowed(self.flow, options)


def _plainly(path: Continuation, De: float, options: SolverOptions) -> _Found:
    """Go on to De in short steps in the lowest order of results, on the mesh as it is."""
    iterations = 0
    while True:
        step = min(De, SHORT_STEP * max(path.deborah, 1.0))
        convergence, more = path.advance(step)
        iterations += more
        if step == De or not convergence.converged:
            break
        if iterations > MOST_SOLVES * options.max_iterations:
            reason = f"given up at De = {step:g} after {iterations} iterations"
            convergence = replace(convergence, reason=reason)
            break
    found = _Found(path.flow, convergence, iterations, fallback=True, reached=path.deborah)
    if convergence.converged:
        flow = path.flow.variant(path.flow.fluid, path.flow.velocity_order + 1)
        above = Continuation(flow, SCOUT_TOLERANCE, options.steps, path)
        found.judge(above.error_below(De), options)
        found.convergence = path.finish(options.tolerance)
    return found


def _better(first: _Found, second: _Found) -> _Found:
    """The second result if it converged, or else the first; with the iterations of both."""
    iterations = first.iterations + second.iterations
    reached = max(first.reached, second.reached)
    found = second if second.convergence.converged else first
    return replace(found, iterations=iterations, reached=reached)


def _newtonian(flow: Flow, options: SolverOptions) -> _Found:
    """De = 0, with an order well below, which costs little, to bound the error."""
    order = max(flow.velocity_order, NEWTONIAN_ORDER)
    below, solver = (flow.variant(NEWTONIAN, k) for k in (order - 2, order))
    for each in (below, solver):
        # linear: with factors of double precision the second update is the last
        iteration = newton.ModifiedNewton(each.newtonian, each.free_newtonian, np.float64)
        convergence = iteration.solve(
            each.state, tolerance=options.tolerance, max_iterations=options.max_iterations
        )
    found = _Found(solver, convergence, convergence.iterations)
    if convergence.converged:
        found.judge(refinement.compared(solver, below), options)
    return found


def _allowed(flow: Flow, options: SolverOptions) -> float:
    """Error that is allowed in the velocities that count."""
    largest = max(map(abs, flow.relative_velocities()), default=0.0)
    return max(options.accuracy, options.relative_accuracy * largest)


def _scouted(flow: Flow, options: SolverOptions, tolerance: float = SCOUT_TOLERANCE):
    """A continuation whose scouts go down to the lowest order."""
    scout = None
    if flow.velocity_order >= LOWEST_ORDER:
        below = flow.variant(flow.fluid, flow.velocity_order - 1)
        loose = below.velocity_order < LOWEST_ORDER
        scout = _scouted(below, options, GUESS_TOLERANCE if loose else SCOUT_TOLERANCE)
    return Continuation(flow, tolerance, options.steps, scout)


class _Ladder:
    """The rungs passed so far, and the climbs that start from them."""

    def __init__(self, flow: Flow, options: SolverOptions, remesh: Remesh | None):
        self._top, self._options, self._remesh = flow, options, remesh
        self._rungs = (10**n * rung for n in itertools.count() for rung in RUNGS)
        self._next = next(self._rungs)
        self._path = _scouted(flow.variant(flow.fluid, flow.velocity_order - 1), options)
        self._higher: dict[int, Continuation] = {}  # by order, on the mesh of the ladder

    def at(self, De: float) -> _Found:
        """Solve in the lowest order of results or a higher one."""
        start, convergence, iterations = self._approach(De)
        if not convergence.converged:
            return _Found(start.flow, convergence, iterations, reached=start.deborah)
        path, found, plan = self._climb(start, De, self._higher)
        iterations += found.iterations
        for remaining in reversed(range(REFINEMENTS)):
            if found.accurate or plan is None or plan.sizes is None or self._remesh is None:
                break
            mesh = self._remesh(plan.sizes)
            order = max(refinement.first_order(plan.order), self._top.velocity_order - 1)
            finer = self._on_another_mesh(mesh, order, [start, path])
            convergence, more = finer.advance(De)
            iterations += more
            if not convergence.converged:
                break
            least = found.error.decisive / LEAST_GAIN if found.error else math.inf
            finer, better, plan = self._climb(finer, De, {}, least if remaining else 0.0)
            iterations += better.iterations
            if _is_better(better, found):
                path, found = finer, better
        if found.convergence.converged:
            found.convergence = path.finish(self._options.tolerance)
            iterations += found.convergence.iterations
        return replace(found, iterations=iterations, reached=De)

    def _approach(self, De: float) -> tuple[Continuation, newton.Convergence, int]:
        """A branch of the ladder at De, or where it is stuck."""
        iterations = 0
        while self._next <= De:
            convergence, more = self._path.advance(self._next)
            iterations += more
            if not convergence.converged:
                reason = f"on the way, at De = {self._next:g}: {convergence.reason}"
                return self._path, replace(convergence, reason=reason), iterations
            self._next = next(self._rungs)
        branch = self._path.twin()
        convergence, more = branch.advance(De)
        return branch, convergence, iterations + more

    def _climb(
        self,
        path: Continuation,
        De: float,
        higher: dict[int, Continuation],
        worth: float = math.inf,
    ) -> tuple[Continuation, _Found, refinement.Plan | None]:
        """Raise the order until the error is small or another mesh promises more.

        Args:
            path: Is at De, one order below the lowest of results or above.
            De: lambda_1 Ubar/D.
            higher: Continuations on the same mesh by order, known from smaller De.
            worth: Error from which on another mesh is worth a trial.
        """
        iterations, found, plan = 0, None, None
        if path.flow.velocity_order >= self._top.velocity_order:
            found = _Found(path.flow, newton.Convergence(), 0)
        while True:
            above = self._above(path, higher)
            promised = None
            if found is not None:
                found.judge(above.error_below(De), self._options)
                plan, promised = self._plan(found, worth)
                if not promised and (plan is None or plan.sizes is not None):
                    above.forget_matrix()
                    return path, found, plan
            convergence, more = above.advance(De)
            iterations += more
            if not convergence.converged:
                error = found.error if found else above.error_below(De)
                above.forget_matrix()
                found = found or _Found(above.flow, convergence, 0)
                found.iterations = iterations
                return path, found, self._rescue(path, error)
            path, found, plan = above, _Found(above.flow, convergence, iterations), None
            if promised:
                found.judge(promised, self._options)
                return path, found, None

    def _plan(
        self, found: _Found, worth: float
    ) -> tuple[refinement.Plan | None, refinement.Estimate | None]:
        """How to become accurate, on another mesh only if the error is worth a trial.

        If no plan is needed or of use, the errors of the order above if they are known.
        """
        allowed, limits = _allowed(found.flow, self._options), self._options.limits
        promised, plan = refinement.promised(found.error, limits), None
        if found.error and not found.accurate and not (promised and promised.decisive <= allowed):
            again = found.error.decisive <= worth and self._remesh is not None
            plan = refinement.plan(found.flow, found.error, allowed, limits, again)
        return plan, promised if plan is None else None

    def _above(self, below: Continuation, higher: dict[int, Continuation]) -> Continuation:
        """The continuation one order above."""
        order = below.flow.velocity_order + 1
        path = higher.get(order)
        if path is None or path.flow.mesh is not below.flow.mesh:
            own = order == self._top.velocity_order and below.flow.mesh is self._top.mesh
            flow = self._top if own else below.flow.variant(below.flow.fluid, order)
            path = higher[order] = Continuation(flow, SCOUT_TOLERANCE, self._options.steps)
        path.scout = below
        return path

    def _rescue(
        self, path: Continuation, error: refinement.Estimate | None
    ) -> refinement.Plan | None:
        """A finer mesh where the order above a path is stuck, by the error of the path."""
        if error is None:
            return None
        limits = refinement.Limits(error.order, self._options.max_unknowns)
        plan = refinement.plan(path.flow, error, error.decisive / RESCUE_REDUCTION, limits)
        return plan and plan._replace(order=max(plan.order, self._top.velocity_order))

    def _on_another_mesh(
        self, mesh: ngsolve.Mesh, order: int, known: list[Continuation]
    ) -> Continuation:
        """With what is known as guesses."""
        top = self._top
        flow = Flow(top.geometry, mesh, top.fluid, order, top.mean_velocity)
        finer = Continuation(flow, SCOUT_TOLERANCE, self._options.steps)
        finer.start_from(known)
        return finer


def _is_better(new: _Found, old: _Found) -> bool:
    """Whether the error of a solution is smaller than that of another one, or the only known."""
    if not new.convergence.converged:
        return False
    if not old.convergence.converged or old.error is None:
        return True
    return new.error is not None and new.error.decisive < old.error.decisive
