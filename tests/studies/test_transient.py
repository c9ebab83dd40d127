"""From a study to spheres that start from rest: what is stored, and how a killed run goes on."""

import numpy as np
import pytest
from harness import study

from viscotrain.config import stages
from viscotrain.flow.geometry import Geometry
from viscotrain.studies.dns import triplet
from viscotrain.studies.transient import follow_spheres, start_up_time, time_options
from viscotrain.words import NOT_CONVERGED, SOLVED

STUDY = study()
TINY = stages.transient(STUDY, 1.0)
NEWTONIAN = stages.transient(STUDY, 0.0)


def changed(**settings):
    return TINY.model_copy(update={"transient": TINY.transient.model_copy(update=settings)})


def silent(_):
    """Take a line and do nothing."""


def test_times_are_in_relaxation_times():
    three = stages.transient(STUDY, 3.0)
    assert start_up_time(three, 3.0) == pytest.approx(6.0)
    assert time_options(three, 3.0).first_step == pytest.approx(3e-3)
    assert start_up_time(NEWTONIAN, 0.0) == 0.0


def test_newtonian_spheres_move_without_start_up():
    """A train of four keeps moving by its velocities; distances follow."""
    geometry = Geometry.train(0.2, [1.3, 2.0, 1.6], margin=1.5)
    result, steps = follow_spheres(NEWTONIAN, geometry, 0.0, until=2.0, report=silent)
    assert result.sizes == {"time": len(steps), "sphere": 4, "gap": 3}
    assert int(result["status"]) == SOLVED
    time, velocity = result["time"].values, result["velocity"].values
    middle = (velocity[1:] + velocity[:-1]) / 2
    moved = (np.diff(time)[:, None] * middle).sum(axis=0)
    along = result["position"].values
    assert along[-1] - along[0] == pytest.approx(moved, abs=1e-5)
    assert result["distance"].values == pytest.approx(np.diff(along, axis=1) / 0.2)


@pytest.mark.slow
def test_a_killed_run_goes_on_where_it_was(tmp_path):
    checkpoint = tmp_path / "run.npz"
    geometry = triplet(TINY, np.inf, 1.5)
    whole, _ = follow_spheres(TINY, geometry, 1.0, until=0.05, report=silent)
    lines = []

    def die(line):
        lines.append(line)
        if len(lines) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        follow_spheres(TINY, geometry, 1.0, until=0.05, report=die, checkpoint=checkpoint)
    again = []
    rest, _ = follow_spheres(
        TINY, geometry, 1.0, until=0.05, report=again.append, checkpoint=checkpoint
    )
    assert again[0].startswith("goes on from t = ")
    assert len(again) - 1 == len(whole["time"]) - 4  # the last step before the kill is lost
    np.testing.assert_allclose(rest["time"], whole["time"], rtol=1e-6)
    np.testing.assert_allclose(rest["velocity"], whole["velocity"], atol=1e-6)


@pytest.mark.slow
def test_a_checkpoint_of_other_settings_is_not_used(tmp_path):
    checkpoint = tmp_path / "run.npz"
    geometry = triplet(TINY, np.inf, 1.5)
    follow_spheres(TINY, geometry, 1.0, until=0.01, report=silent, checkpoint=checkpoint)
    lines = []
    other = changed(relative_tolerance=1e-5)
    follow_spheres(other, geometry, 1.0, until=0.01, report=lines.append, checkpoint=checkpoint)
    assert lines[0].startswith("t 0 ")


def test_steps_that_cannot_converge_end_with_a_reason():
    lines = []
    hopeless = changed(max_iterations=1)
    geometry = triplet(TINY, np.inf, 1.5)
    result, _ = follow_spheres(hopeless, geometry, 1.0, until=1.0, report=lines.append)
    assert int(result["status"]) == NOT_CONVERGED
    assert "no convergence" in str(result["reason"].values)
    assert lines[-1].startswith("NOT SOLVED")
