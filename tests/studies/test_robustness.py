"""The designed sample: its design, the arithmetic of its summary, and the results that are kept."""

import json
import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from harness import VERIFICATION

from viscotrain.config.models import DnsConfig
from viscotrain.fluid.parameters import DimensionlessFluid, Mode
from viscotrain.studies import robustness, sample
from viscotrain.studies.robustness import DEFAULT, FLOOR, REFERENCE
from viscotrain.studies.sample import CORNER, MAIN

KEPT = VERIFICATION / "robustness" / "sample.csv"
# The point of the end-to-end test: no physics, only that everything fits together.
COARSE = DnsConfig(
    velocity_order=3,
    sphere_elements=6,
    wall_size=0.25,
    margin=1.5,
    accuracy=1e-2,
    relative_accuracy=0.5,
    max_unknowns=10_000,
)
EASY = sample.Point(
    index=0,
    part=MAIN,
    fluid=DimensionlessFluid(0.5, (Mode(0.5, 1.0, 0.3),)),
    confinement=0.3,
    sp=math.inf,
    sf=2.0,
    deborah=0.5,
)

# --------------------------------------------------------------------------------------- design


def test_every_coordinate_has_one_point_in_each_stratum():
    for points in sample.coordinates(sample.SEED):
        count = len(points)
        strata = np.sort((points * count).astype(int), axis=0)
        assert (strata == np.arange(count)[:, None]).all()


def test_the_same_seed_makes_the_same_design():
    assert sample.design() == sample.design(sample.SEED)
    assert sample.design() != sample.design(sample.SEED + 1)
    assert [point.index for point in sample.design()] == list(range(72))


def test_all_is_within_its_range_and_reaches_its_ends():
    points = [point for point in sample.design() if point.part == MAIN]
    assert len(points) == sample.MAIN_POINTS >= 60
    mobilities = [mode.mobility for point in points for mode in point.fluid.modes]
    gaps = [s - 1 for point in points for s in (point.sp, point.sf) if math.isfinite(s)]
    moving = [point.deborah for point in points if point.deborah > 0]
    for values, (low, high) in (
        (mobilities, sample.MOBILITY),
        ([point.fluid.solvent for point in points], sample.SOLVENT),
        ([point.confinement for point in points], sample.CONFINEMENT),
        (gaps, sample.GAP),
        (moving, sample.DEBORAH),
    ):
        assert low <= min(values) < 1.3 * low
        assert high / 1.3 < max(values) <= high
    assert len(points) - len(moving) == 3
    times = [mode.relaxation_time for point in points for mode in point.fluid.modes[1:]]
    assert min(times) >= sample.TIME_RATIO[0] and max(times) < sample.TIME_RATIO[1]


def test_modes_and_spheres_are_in_equal_numbers():
    points = [point for point in sample.design() if point.part == MAIN]
    assert np.bincount([len(point.fluid.modes) for point in points]).tolist() == [0] + 4 * [15]
    spheres = [1 + math.isfinite(point.sp) + math.isfinite(point.sf) for point in points]
    assert np.bincount(spheres).tolist() == [0, 20, 20, 20]


def test_the_corner_has_weak_mobilities_or_little_solvent():
    points = [point for point in sample.design() if point.part == CORNER]
    assert len(points) == sample.CORNER_POINTS >= 12
    weak = [max(mode.mobility for mode in point.fluid.modes) <= 0.05 for point in points]
    little = [0.01 <= point.fluid.solvent <= 0.05 for point in points]
    assert all(one or other for one, other in zip(weak, little, strict=True))
    assert sum(weak) == sum(little) == 6
    assert any(mode.mobility == 0 for point in points for mode in point.fluid.modes)
    assert all(0 < point.deborah <= 5 for point in points)


# -------------------------------------------------------------------------------------- summary


def made_up(n, part, converged=True, estimate=math.nan, error=math.nan, seconds=10.0):
    """A default run and, if there is an error, its reference."""
    shared = {"index": n, "part": part, "deborah": 1.0, "cpu_seconds": seconds}
    shared |= {"converged": converged, "accurate": converged, "deborah_reached": 0.7}
    shared |= {"reason": "" if converged else "no convergence", "physics_digest": "other"}
    rows = [shared | {"run": DEFAULT, "estimate": estimate}]
    if math.isfinite(error):
        rows.append(shared | {"run": REFERENCE, "true_error": error})
    return rows


@pytest.fixture
def results():
    rows = [
        *made_up(0, MAIN, estimate=5e-6, error=1e-6),  # covered, close
        *made_up(1, MAIN, estimate=1e-6, error=5e-6),  # not covered, close
        *made_up(2, MAIN, estimate=1e-4, error=1e-6),  # covered, not close
        *made_up(3, MAIN, estimate=FLOOR / 50, error=FLOOR / 2),  # both at the floor
        *made_up(4, MAIN, converged=False, seconds=50.0),
        *made_up(5, CORNER, estimate=1e-6),
    ]
    return pd.DataFrame(rows)


def test_shares_of_a_made_up_table(results):
    found = robustness.summarised(results)
    assert found.points == {MAIN: 5, CORNER: 1}
    assert found.converged == {MAIN: pytest.approx(0.8), CORNER: 1.0}
    assert found.accurate == {MAIN: 1.0, CORNER: 1.0}
    assert found.compared == 4
    assert found.covered == pytest.approx(3 / 4)
    assert found.close == pytest.approx(3 / 4)


def test_the_report_names_what_failed(results):
    text = robustness.report(results, "present")
    assert "main: 5 of 60 points run, 80.0% converged" in text
    assert "main 4 default: De 1 not solved, reached 0.7: no convergence" in text
    assert "median 10, maximum 50 CPU s" in text
    assert "another version" in text


def test_the_error_that_counts_is_of_relative_velocities():
    pair = {"velocity_middle": 1.0, "leading_minus_middle": 0.1}
    assert robustness.true_error(pair, {"velocity_middle": 2.0, "leading_minus_middle": 0.4}) == (
        pytest.approx(0.3)
    )
    assert robustness.true_error({"velocity_middle": 1.0}, {"velocity_middle": 1.5}) == 0.5
    read = {"velocity_middle": 1.0, "leading_minus_middle": math.nan}  # from a file
    assert robustness.true_error(read, {"velocity_middle": 1.5}) == 0.5


def test_references_are_finer():
    default = DnsConfig()
    reference = robustness.finer(default)
    assert reference.velocity_order > default.velocity_order
    assert reference.sphere_elements > default.sphere_elements
    assert reference.accuracy == pytest.approx(default.accuracy / 10)
    assert reference.relative_accuracy == pytest.approx(default.relative_accuracy / 10)
    assert reference.margin == default.margin
    assert reference.max_velocity_order == default.max_velocity_order + 1
    assert reference.max_unknowns == 2 * default.max_unknowns
    DnsConfig.model_validate(reference.model_dump())


# ------------------------------------------------------------------------------------- solution


def test_a_point_is_solved_and_compared():
    row = robustness.solve(EASY, settings=COARSE)
    reference = robustness.solve(EASY, run=REFERENCE, settings=COARSE)
    reference = robustness.with_error(reference, row)
    assert row["converged"] and row["accurate"] and row["deborah_reached"] == EASY.deborah
    assert row["leading_minus_middle"] == row["velocity_leading"] - row["velocity_middle"]
    assert json.loads(row["modes"]) == [[0.5, 1.0, 0.3]]
    assert reference["elements"] > row["elements"]
    assert 0 < reference["true_error"] <= row["estimate"] < 1e-2
    assert set(row) | set(reference) <= set(robustness.COLUMNS)


def test_a_point_that_fails_is_a_row_with_a_reason():
    impatient = COARSE.model_copy(update={"max_iterations": 1})
    row = robustness.solve(EASY, settings=impatient)
    assert not row["converged"] and "no convergence" in row["reason"]
    assert row["deborah_reached"] == 0
    overlapping = robustness.solve(replace(EASY, sf=0.9), settings=COARSE)
    assert not overlapping["converged"] and "overlap" in overlapping["reason"]


# ----------------------------------------------------------------------------------------- kept


@pytest.fixture(scope="module")
def kept():
    if not KEPT.exists():
        pytest.skip("no results are kept")
    table = pd.read_csv(KEPT)
    return table[table["seed"] == sample.SEED]


def test_kept_results_are_of_this_design(kept):
    runs = kept[kept["run"] == DEFAULT].set_index("index").sort_index()
    points = sample.design()
    assert runs.index.tolist() == [point.index for point in points]
    for name, of_point in (
        ("confinement", lambda point: point.confinement),
        ("deborah", lambda point: point.deborah),
        ("solvent", lambda point: point.fluid.solvent),
    ):
        assert runs[name].values == pytest.approx([of_point(point) for point in points])


def test_kept_results_reach_far(kept):
    found = robustness.summarised(kept)
    assert found.converged[MAIN] >= 0.95
    runs = kept[kept["run"] == DEFAULT]
    assert runs["converged"].mean() >= 0.95
    lost = runs[~runs["converged"].astype(bool)]
    assert lost["reason"].str.len().gt(0).all()
