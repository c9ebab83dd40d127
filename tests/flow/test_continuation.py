"""Direct numerical simulation against exact, semi-analytic and published results.

Tolerances are the accuracy that the project states for its default settings.
"""

import math

import harness
import ngsolve
import numpy as np
import pandas as pd
import pytest

from viscotrain.config import stages
from viscotrain.flow import continuation, newton, quasi_steady, refinement
from viscotrain.flow.discretisation import Flow, copy
from viscotrain.flow.geometry import Geometry
from viscotrain.flow.meshes import MeshOptions, make_mesh
from viscotrain.fluid.parameters import NEWTONIAN, DimensionlessFluid, Mode
from viscotrain.fluid.pipe import pipe_flow
from viscotrain.studies.dns import make_flow, solutions, solver_options, triplet

DEMO = harness.study("config")
FLOW = stages.flow(DEMO)


def study(confinement=0.2, deborah=(0.0,), **dns_settings):
    """The demo study, default resolution, with another sphere and other Deborah numbers."""
    particle = {"diameter": confinement * DEMO.channel.diameter}
    changed = {"particle": particle, "deborah": {"values": deborah}, "dns": dns_settings}
    return stages.flow(harness.study("config", **changed))


def velocities(sp, sf, **options) -> np.ndarray:
    """U (deborah, sphere) with default settings."""
    config = study(**options)
    found = [solution for _, solution in solutions(config, triplet(config, sp, sf))]
    assert all(solution.solved for solution in found)
    return np.array([list(solution.velocities.values()) for solution in found])


def rows(name):
    return list(pd.read_csv(harness.REFERENCE / name, comment="#").itertuples(index=False))


# ------------------------------------------------------------------------------ Newtonian fluid


@pytest.mark.slow
@pytest.mark.parametrize("row", rows("newtonian_triplet.csv"))
def test_newtonian_triplet(row):
    (U,) = velocities(row.sp, row.sf, confinement=row.confinement)
    assert pytest.approx([row.U1, row.U2, row.U3], abs=1e-6) == U


@pytest.mark.slow
@pytest.mark.parametrize("row", rows("newtonian_pair.csv"))
def test_newtonian_pair_keeps_its_distance(row):
    (U,) = velocities(math.inf, row.spacing, confinement=row.confinement)
    assert pytest.approx([row.velocity] * 2, abs=1e-6) == U
    assert U[1] - U[0] == pytest.approx(0, abs=1e-7)


@pytest.mark.parametrize("row", rows("newtonian_sphere.csv"))
def test_newtonian_sphere(row):
    (U,) = velocities(math.inf, math.inf, confinement=row.confinement)
    assert pytest.approx([row.velocity], abs=1e-6) == U


def test_newtonian_triplet_is_reversible():
    """Turning the flow around mirrors the triplet."""
    (U,), (mirrored,) = velocities(1.3, 2.1), velocities(2.1, 1.3)
    assert pytest.approx(mirrored[::-1], abs=1e-7) == U


def test_periodic_images_are_out_of_reach():
    (U,), (longer,) = velocities(1.2, 1.6), velocities(1.2, 1.6, margin=3.0)
    assert pytest.approx(longer, abs=1e-6) == U


# ---------------------------------------------------------------------------- viscoelastic fluid


def empty_tube(axis_size: float, wall_size: float, order: int, fluid) -> Flow:
    geometry = Geometry(0.2, spheres=(), positions=(), length=0.4, reference=None)
    options = MeshOptions(
        wall_size=wall_size, axis_size=axis_size, sphere_elements=14, gap_elements=3
    )
    return Flow(geometry, make_mesh(geometry, options, order=1), fluid, order)


@pytest.mark.slow
@pytest.mark.parametrize("resolution", ["default", "fine"])
def test_tube_without_spheres_is_the_semi_analytic_flow(resolution, hyaluronic_acid):
    """Pressure gradient on the default mesh; velocity at the axis, one point, on a finer one."""
    default = DEMO.dns.axis_size, DEMO.dns.wall_size, DEMO.dns.velocity_order
    sizes = {"default": default, "fine": (0.025, 0.05, 4)}
    reference = rows("giesekus_pipe.csv")
    flow = empty_tube(*sizes[resolution], hyaluronic_acid)
    De = [row.deborah for row in reference]
    for row, solution in zip(
        reference, quasi_steady.solve(flow, De, solver_options(FLOW)), strict=True
    ):
        assert solution.pressure_gradient == pytest.approx(row.pressure_gradient, rel=1e-4)
        if resolution == "fine":
            centreline = solution.flow.fields().u.z(solution.flow.mesh(0.17, 0.0))
            assert centreline == pytest.approx(row.centreline, abs=1e-4)
            exact = pipe_flow(hyaluronic_acid, row.deborah)
            assert centreline == pytest.approx(exact.centreline_velocity, abs=1e-4)


@pytest.mark.slow
def test_single_sphere_agrees_with_two_other_codes():
    """U of one sphere, beta = 0.2, tube of 4 D, converged by two independent codes to 1e-6."""
    converged = {0.5: 1.829855, 1.0: 1.770559, 2.0: 1.695214, 5.0: 1.653117}
    U = velocities(math.inf, math.inf, deborah=tuple(converged))[:, 0]
    assert pytest.approx(list(converged.values()), abs=4e-6) == U


def test_relative_velocity_of_a_pair_begins_linearly_in_deborah():
    """Memory alone moves a pair: halving De halves it, within the next order, De of 1 %."""
    relative = np.diff(velocities(math.inf, 1.5, deborah=(0.005, 0.01)))[:, 0]
    assert 1.9 < relative[1] / relative[0] < 2.1
    assert abs(relative[1]) > 1e-6  # well above the error of the simulation


@pytest.mark.slow
def test_oldroyd_b_drag_on_a_sphere_in_a_two_to_one_tube():
    """K = F/(6 pi eta_0 a U), eta_s = eta_0/2, De = lambda U/a.

    Lunsmann, Genieser, Armstrong & Brown, J. Non-Newtonian Fluid Mech. 48, 1993, 63. The wall
    moves backwards with the velocity 1 and the fluid has no flux relative to it.
    """
    published = {0.0: 5.9474, 0.3: 5.694, 0.6: 5.412}
    fluid = DimensionlessFluid(0.5, (Mode(0.5, 1.0, 0.0),))
    geometry = Geometry.triplet(0.5, math.inf, math.inf, margin=3.0)
    options = MeshOptions(wall_size=0.1, axis_size=0.05, sphere_elements=24, gap_elements=3)
    flow = Flow(geometry, make_mesh(geometry, options, 4), fluid, 4, mean_velocity=0.0)
    wall = flow.unknown_of("wall")
    flow.state.vec[wall] = -1.0
    flow.free[wall] = flow.free_newtonian[wall] = False
    a = geometry.radius
    for De, K in published.items():
        flow.deborah.Set(De * a)
        form, free = (flow.viscoelastic, flow.free) if De else (flow.newtonian, flow.free_newtonian)
        iteration = newton.ModifiedNewton(form, free)
        result = iteration.solve(flow.state, tolerance=1e-8, max_iterations=20)
        assert result.converged
        residual = flow.state.vec.CreateVector()
        form.Apply(flow.state.vec, residual)
        force_on_wall = 2 * math.pi * residual[wall]  # opposite to the drag on the sphere
        assert -force_on_wall / (6 * math.pi * a) == pytest.approx(K, abs=1e-3)


def test_embedding_in_higher_order_changes_nothing(hyaluronic_acid):
    flow = make_flow(FLOW, triplet(FLOW, math.inf, 1.5))
    (solution,) = quasi_steady.solve(flow, [0.5], solver_options(FLOW))
    assert solution.solved
    raised = flow.variant(hyaluronic_acid, 4)
    before = flow.sphere_velocities(), flow.pressure_gradient()
    flow.embed(copy(flow.state.vec), raised)
    assert raised.sphere_velocities() == pytest.approx(before[0], abs=1e-12)
    assert raised.pressure_gradient() == pytest.approx(before[1], abs=1e-10)
    for mine, other in zip(flow.fields().psi[0], raised.fields().psi[0], strict=True):
        difference = ngsolve.Integrate((mine - other) ** 2, flow.mesh)
        assert difference == pytest.approx(0, abs=1e-20)


def test_newtonian_fluid_without_modes_needs_no_conformation():
    flow = make_flow(FLOW, triplet(FLOW, math.inf, math.inf)).variant(NEWTONIAN, 3)
    assert flow.fields().psi == []


# ---------------------------------------------------------------------------------- accuracy


COARSE = {"velocity_order": 3, "sphere_elements": 6, "wall_size": 0.25, "axis_size": 0.15}


def test_what_is_found_does_not_depend_on_the_other_deborah_numbers():
    found = []
    for deborahs in ((0.5, 2.0), (2.0,)):
        config = study(deborah=deborahs, accuracy=1e-3, **COARSE)
        *_, (_, last) = solutions(config, triplet(config, math.inf, 1.5))
        found.append(last)
    both, alone = found
    assert both.flow.mesh.ne == alone.flow.mesh.ne
    relative = [np.diff(list(each.velocities.values())) for each in found]
    assert pytest.approx(relative[1], abs=1e-6) == relative[0]


@pytest.mark.slow
@pytest.mark.parametrize(("highest", "finest"), [(3, 5e-5), (7, 1e-6)])
def test_meshes_or_orders_are_raised_until_the_estimate_is_small(highest, finest):
    found = []
    for accuracy in (1e-2, finest):
        config = study(
            deborah=(2.0,),
            accuracy=accuracy,
            relative_accuracy=0.0,
            max_velocity_order=highest,
            **COARSE,
        )
        ((_, solution),) = solutions(config, triplet(config, math.inf, 1.5))
        assert solution.accurate
        assert max(solution.error.relative) <= solution.estimated_error <= accuracy
        assert solution.error.velocity <= solution.estimated_error
        found.append(solution)
    coarse, fine = found
    orders = coarse.flow.velocity_order, fine.flow.velocity_order
    if highest == 3:
        assert orders == (3, 3) and coarse.flow.mesh.ne < fine.flow.mesh.ne
    else:
        assert orders[0] < orders[1] <= highest
    difference = np.subtract(*(np.diff(list(each.velocities.values())) for each in found))
    assert abs(difference) < coarse.estimated_error


def test_too_few_unknowns_give_a_solution_that_is_not_accurate():
    few = study(deborah=(1.0,), accuracy=1e-9, relative_accuracy=0.0, max_unknowns=1, **COARSE)
    ((_, solution),) = solutions(few, triplet(few, math.inf, 1.5))
    assert solution.solved and not solution.accurate
    assert solution.estimated_error > 1e-9
    assert set(solution.velocities) == {"middle", "leading"}


def coarse_pair():
    config = study(**COARSE)
    return make_flow(config, triplet(config, math.inf, 1.5))


def options(**changes):
    """Of the coarse pair: small updates, so that what remains is the discretisation."""
    given = {"tolerance": 1e-9, "max_iterations": 40, "deborah_step": 3.0, "accuracy": 1.0}
    given |= {"max_velocity_order": 7, "max_unknowns": 1e6}
    return quasi_steady.SolverOptions(**given | changes)


def residual(flow):
    """Rms of the residual at the state of a flow."""
    found = flow.state.vec.CreateVector()
    flow.viscoelastic.Apply(flow.state.vec, found)
    ngsolve.Projector(flow.free, True).Project(found)
    return found.Norm() / math.sqrt(flow.free.NumSet())


@pytest.fixture
def same_mesh(monkeypatch):
    """Whatever the order above promises, it is solved."""
    monkeypatch.setattr(
        refinement, "plan", lambda _, error, *__: refinement.Plan(error.order + 1, None)
    )


@pytest.mark.parametrize(("share", "order"), [(1.01, 3), (0.99, 4), (0.2, 4), (0.03, 5)])
def test_the_lowest_order_that_is_accurate_is_the_result(same_mesh, share, order):
    """Its error, its velocities and its state are of the same order."""
    (rough,) = quasi_steady.solve(coarse_pair(), [1.0], options())
    accuracy = share * rough.estimated_error
    (found,) = quasi_steady.solve(coarse_pair(), [1.0], options(accuracy=accuracy))
    assert rough.flow.velocity_order == rough.error.order == 3
    assert found.flow.velocity_order == found.error.order == order
    assert found.accurate and found.estimated_error <= accuracy
    assert found.velocities == found.flow.sphere_velocities()
    assert found.flow.deborah.Get() == pytest.approx(1.0)
    assert residual(found.flow) < 1e-12
    difference = np.subtract(*(each.flow.relative_velocities() for each in (rough, found)))
    assert np.abs(difference).max() < rough.estimated_error


@pytest.mark.parametrize("accuracy", [1.0, 1.1e-3, 1e-4])
def test_nothing_begun_at_one_deborah_number_is_used_at_the_next(same_mesh, accuracy):
    """In the middle one the first is accurate in order 3, in which the other begins order 4."""
    wanted = options(accuracy=accuracy)
    first, both = quasi_steady.solve(coarse_pair(), [1.0, 2.0], wanted)
    orders = {1.0: (3, 3), 1.1e-3: (3, 4), 1e-4: (4, 4)}
    assert (first.error.order, both.error.order) == orders[accuracy]
    (alone,) = quasi_steady.solve(coarse_pair(), [2.0], wanted)
    assert both.flow.velocity_order == alone.flow.velocity_order
    assert both.velocities == pytest.approx(alone.velocities, abs=1e-9)
    assert both.estimated_error == pytest.approx(alone.estimated_error, rel=1e-4)


@pytest.mark.parametrize("accuracy", [1.0, 1e-4])
def test_no_matrix_is_kept_between_deborah_numbers(same_mesh, accuracy):
    """The factors of an order that was not needed take much memory."""
    ladder = quasi_steady._Ladder(coarse_pair(), options(accuracy=accuracy), None)
    assert ladder.at(1.0).accurate
    assert len(ladder._higher) == {1.0: 2, 1e-4: 3}[accuracy]
    assert all(path._begun is None for path in ladder._higher.values())


def test_a_mesh_is_refined_where_the_lowest_order_is_stuck(monkeypatch):
    """By the error of the order below it, from which that order had begun."""
    config = study(deborah=(1.0,), accuracy=1.0, **COARSE)
    pair, errors = triplet(config, math.inf, 1.5), []
    elements = make_flow(config, pair).mesh.ne
    iterate, plan = continuation.Continuation._iterate, refinement.plan

    def stuck_on_the_first_mesh(path, De, tolerance, *others):
        if path.flow.velocity_order == 3 and path.flow.mesh.ne == elements:
            return newton.Convergence(updates=[1.0], reason="stuck")
        return iterate(path, De, tolerance, *others)

    def noted(flow, error, *others):
        errors.append((flow.velocity_order, error.order))
        return plan(flow, error, *others)

    monkeypatch.setattr(continuation.Continuation, "_iterate", stuck_on_the_first_mesh)
    monkeypatch.setattr(refinement, "plan", noted)
    ((_, solution),) = solutions(config, pair)
    assert errors[0] == (2, 2)
    assert solution.solved and solution.accurate and not solution.fallback
    assert solution.flow.mesh.ne > elements
    assert solution.flow.velocity_order == solution.error.order >= 3


# ------------------------------------------------------------------------------------ continuation


@pytest.fixture
def two_orders():
    """A continuation of order 4 whose scout, of order 3, is at De = 1."""
    flow, steps = coarse_pair(), continuation.Steps(40, 3.0)
    below = continuation.Continuation(flow, 1e-9, steps)
    above = continuation.Continuation(flow.variant(flow.fluid, 4), 1e-9, steps, below)
    assert below.advance(1.0)[0].converged
    return below, above


def test_an_error_of_the_order_below_leaves_its_solution(two_orders):
    """Or brings it back, where another continuation of the same flow has gone on."""
    below, above = two_orders
    before = below.flow.state.vec.FV().NumPy().copy()
    assert below.twin().advance(2.0)[0].converged
    error = above.error_below(1.0)
    assert error.order == 3 and error.decisive > 1e-5
    assert np.array_equal(below.flow.state.vec.FV().NumPy(), before)
    assert [path.flow.deborah.Get() for path in two_orders] == pytest.approx([1.0, 1.0])
    assert above.deborah == 0.0  # it has no solution yet


def test_there_is_no_error_without_a_solution_below(two_orders):
    below, above = two_orders
    assert above.error_below(2.0) is None
    assert below.error_below(1.0) is None
    assert above._begun is None


def test_an_order_goes_on_from_the_error_of_the_one_below(two_orders):
    """With its matrix, and to the solution that it finds without."""
    _, above = two_orders
    other = above.twin()
    above.error_below(1.0)
    assert above.twin()._begun is None
    convergence, _ = above.advance(1.0)
    assert convergence.converged and convergence.factorisations == 0
    assert above._begun is None
    begun = above.flow.sphere_velocities()
    convergence, _ = other.advance(1.0)
    assert convergence.converged and convergence.factorisations > 0
    assert other.flow.sphere_velocities() == pytest.approx(begun, abs=1e-10)


def test_what_an_order_changed_before_is_not_added_to_what_is_begun(two_orders):
    """The iteration starts where its matrix was made."""
    below, above = two_orders
    assert above.advance(1.0)[0].converged
    assert below.advance(2.0)[0].converged
    above.error_below(2.0)
    expected = residual(above.flow)
    convergence, _ = above.advance(2.0)
    assert convergence.converged and convergence.factorisations == 0
    assert convergence.residuals[0] == expected


def test_a_matrix_that_is_forgotten_is_of_no_use_at_the_next_deborah_number(two_orders):
    _, above = two_orders
    other, own = above.twin(), copy(above.flow.state.vec)
    above.error_below(1.0)
    above.forget_matrix()
    convergence, _ = above.advance(2.0)
    assert convergence.converged and convergence.factorisations > 0
    found = above.flow.sphere_velocities(), convergence.updates
    above.flow.state.vec.data = own
    convergence, _ = other.advance(2.0)
    assert other.flow.sphere_velocities() == found[0]
    assert convergence.updates == found[1]


def test_a_singular_matrix_is_no_error_and_nothing_begun(two_orders, monkeypatch):
    _, above = two_orders

    def singular(*_):
        raise newton.FactorisationError

    monkeypatch.setattr(newton, "factorise", singular)
    assert above.error_below(1.0) is None
    assert above._begun is None


def test_steps_that_fail_are_halved():
    """A first guess that is too far is refused; the result is that of small steps."""
    coarse = {"velocity_order": 3, "wall_size": 0.25, "accuracy": 1.0}
    few = study(deborah=(2.0,), max_iterations=7, deborah_step=50.0, **coarse)
    many = study(deborah=(0.5, 1.0, 2.0), **coarse)
    *_, (_, hard) = solutions(few, triplet(few, math.inf, math.inf))
    *_, (_, easy) = solutions(many, triplet(many, math.inf, math.inf))
    assert hard.solved
    assert hard.velocities["middle"] == pytest.approx(easy.velocities["middle"], abs=1e-7)


def test_a_point_that_does_not_converge_ends_the_path_with_a_reason():
    hopeless = study(deborah=(0.0, 1.0, 2.0), max_iterations=1)
    found = list(solutions(hopeless, triplet(hopeless, 1.5, 1.5)))
    assert [solution.solved for _, solution in found] == [False]
    assert "no convergence" in found[-1][1].convergence.reason
    assert found[-1][1].reached == 0


def test_a_point_on_a_rung_that_fails_tells_how_far_the_ladder_led(monkeypatch):
    config = study(deborah=(3.5,), **COARSE)
    iterate = continuation.Continuation._iterate

    def until_two(path, De, tolerance):
        if De > 2:
            return newton.Convergence(updates=[1.0], reason="stuck")
        return iterate(path, De, tolerance)

    monkeypatch.setattr(continuation.Continuation, "_iterate", until_two)
    ((_, solution),) = solutions(config, triplet(config, math.inf, math.inf))
    assert not solution.solved and 1 <= solution.reached <= 2


def test_short_steps_end_after_too_many_iterations(monkeypatch):
    monkeypatch.setattr(quasi_steady, "MOST_SOLVES", 0)
    config = study(deborah=(2.0,), **COARSE)
    flow = make_flow(config, triplet(config, math.inf, math.inf))
    options = solver_options(config)
    path = continuation.Continuation(flow, 1e-5, options.steps)
    found = quasi_steady._plainly(path, 2.0, options)
    assert "given up at De = 1.5" in found.convergence.reason
    assert found.reached == pytest.approx(1.5)


def test_where_the_ladder_is_stuck_the_mesh_of_the_start_is_taken_in_short_steps(monkeypatch):
    config = study(deborah=(2.0,), **COARSE)
    pair = triplet(config, math.inf, 1.5)
    ((_, expected),) = solutions(study(deborah=(2.0,), accuracy=1.0, **COARSE), pair)
    stuck = newton.Convergence(updates=[1.0], reason="stuck")
    monkeypatch.setattr(
        quasi_steady._Ladder,
        "at",
        lambda ladder, De: quasi_steady._Found(ladder._top, stuck, iterations=1),
    )
    ((_, solution),) = solutions(config, pair)
    assert solution.solved and solution.fallback and not expected.fallback
    assert solution.velocities == pytest.approx(expected.velocities, abs=1e-6)
    assert solution.error.order == solution.flow.velocity_order == 3
    assert solution.estimated_error == pytest.approx(expected.estimated_error, rel=1e-3)
    assert solution.velocities == solution.flow.sphere_velocities()
    assert residual(solution.flow) < 1e-8
