"""Spheres through a whole channel: what is recorded, the models, and the results that are kept."""

import itertools

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from harness import VERIFICATION, study
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from synthetic import BETA, DEMO_NODES, dns_result

from viscotrain.studies import whole_channel
from viscotrain.studies.whole_channel import CASE, TIMES, Case
from viscotrain.table.assembly import combine
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.pairs import pair_velocity
from viscotrain.words import QUASI_STEADY_LIMIT

KEPT = VERIFICATION / "memory"
DEBORAH = 10.0


@pytest.fixture(scope="module")
def table():
    grid = itertools.product(DEMO_NODES, DEMO_NODES)
    parts = [dns_result(sp, sf, deborah=(DEBORAH,)) for sp, sf in grid]
    return VelocityTable(combine(parts, sp=DEMO_NODES, sf=DEMO_NODES, deborah=[DEBORAH]))


@pytest.fixture(scope="module")
def direct():
    return pd.read_csv(KEPT / "direct.csv", dtype={"first": str})


@pytest.fixture(scope="module")
def outlet():
    return pd.read_csv(KEPT / "outlet.csv", dtype={"first": str})


def of(frame, *case):
    """Rows of one case."""
    return frame[(frame[CASE] == pd.Series(Case(*case).row)).all(axis=1)]


def test_every_case_once():
    cases = whole_channel.cases()
    assert len(set(cases)) == len(cases) == 26
    plain = [case for case in cases if case.variant == "default"]
    assert len(plain) == 2 * 3 * 2 * 2  # spheres, De, start, first distances


def test_what_is_recorded_lies_between_the_steps():
    """A cubic in time is met exactly, with its slope."""
    time = np.array([0.0, 50.0, 180.0, 430.0])

    def distance(t):
        return 1.5 + 4e-3 * t - 5e-6 * t**2 + 2e-9 * t**3

    rate = 4e-3 - 1e-5 * time + 6e-9 * time**2
    trajectory = xr.Dataset(
        {
            "distance": (("time", "gap"), distance(time)[:, None]),
            "velocity": (("time", "sphere"), np.stack([0 * rate, BETA * rate], axis=1)),
            "confinement": BETA,
        },
        coords={"time": time},
    )
    rows = whole_channel.recorded(trajectory, Case((1.5,), "rest", 31.0))
    np.testing.assert_allclose(rows["time"], TIMES)
    np.testing.assert_allclose(rows["distance"], distance(TIMES), rtol=1e-12)
    assert rows["relative_velocity"].iloc[0] == pytest.approx(BETA * 4e-3)
    assert rows["first"].unique().tolist() == ["1.5"]


@pytest.mark.parametrize("c", [0.0, 0.2])
def test_model_of_a_pair(table, c):
    velocities = table.at(DEBORAH)

    def rate(_, s):
        held = pair_velocity(velocities, s)
        return held * (1 + c * DEBORAH * abs(held) / BETA) / BETA

    exact = solve_ivp(rate, (0, TIMES[-1]), [2.0], t_eval=TIMES, rtol=1e-9, atol=1e-9).y.T
    found = whole_channel.model(table, Case((2.0,), "rest", DEBORAH), BETA, c)
    np.testing.assert_allclose(found, exact, atol=1e-6)


def test_the_coefficient_that_was_put_in_is_found(table, monkeypatch):
    case = Case((2.0,), "developed", DEBORAH)
    monkeypatch.setattr(whole_channel, "FITTED", case)
    made = whole_channel.model(table, case, BETA, 0.17)[:, 0]
    rows = pd.DataFrame(
        [
            case.row | {"gap": 1, "time": t, "distance": s, "relative_velocity": 1e-3}
            for t, s in zip(TIMES, made, strict=True)
        ]
    )
    assert whole_channel.fitted(rows, table, BETA) == 0.17
    found = whole_channel.compare(rows, table, BETA, 0.17).iloc[0]
    assert found["memory_largest_error"] < 1e-9
    held = whole_channel.model(table, case, BETA)[-1, 0]
    assert found["model_error"] == pytest.approx(held - made[-1])
    assert found["memory_number"] == pytest.approx(DEBORAH * 1e-3 / BETA)


# ----------------------------------------------------------------------------------- what is kept


def test_kept_comparison_follows_from_the_kept_simulations(direct, outlet):
    for name, own in outlet.groupby(CASE, sort=False):
        rows = direct[(direct[CASE] == pd.Series(dict(zip(CASE, name, strict=True)))).all(axis=1)]
        ends = rows[rows["time"] == TIMES[-1]].sort_values("gap")["distance"]
        np.testing.assert_allclose(own["direct"], ends, rtol=1e-4)
        M = name[2] * rows["relative_velocity"].abs().max() / BETA
        np.testing.assert_allclose(own["memory_number"], M, rtol=1e-4)
        for model in ("model", "memory"):
            np.testing.assert_allclose(own[f"{model}_error"], own[model] - own["direct"], atol=2e-4)
            assert (own[f"{model}_largest_error"] >= own[f"{model}_error"].abs() - 1e-5).all()
        first = [float(s) for s in name[0].split()]
        starts = rows[rows["time"] == 0].sort_values("gap")["distance"]
        np.testing.assert_allclose(starts, first, rtol=1e-7)


def test_all_asked_for_is_kept(outlet):
    found = set(outlet[CASE].itertuples(index=False, name=None))
    assert found == {tuple(case.row.values()) for case in whole_channel.cases()}


def test_kept_statement_follows_from_the_kept_comparison(outlet):
    statement = (KEPT / "outlet.md").read_text(encoding="utf-8")
    assert statement == whole_channel.statement(outlet)


@pytest.fixture(scope="module")
def held():
    return pd.read_csv(KEPT / "held_pairs.csv")


def test_kept_models_of_pairs_follow_from_the_kept_velocities(outlet, held):
    """With another interpolation of the table's pairs, without and with memory."""
    for row in outlet[~outlet["first"].str.contains(" ")].to_dict("records"):
        own = held[held["deborah"] == row["deborah"]].sort_values("distance", ascending=False)
        velocity = PchipInterpolator(1 / own["distance"], own["relative_velocity"])
        for model, c in (("model", 0.0), ("memory", row["c"])):

            def rate(_, s, velocity=velocity, strength=c * row["deborah"] / BETA):
                U = velocity(1 / s)
                return U * (1 + strength * abs(U)) / BETA

            end = solve_ivp(rate, (0, TIMES[-1]), [float(row["first"])], rtol=1e-8).y[0, -1]
            assert end == pytest.approx(row[model], abs=0.02), row


def test_velocities_that_relax_to_those_of_the_table_cannot_follow(direct, held):
    """A pair that parts is faster than any pair of the table, from a start at the table's."""
    largest = held[held["deborah"] == 62]["relative_velocity"].max()
    own = of(direct, (1.5,), "developed", 62.0)["relative_velocity"]
    assert own.max() > 1.1 * largest
    assert own.iloc[0] < 0.7 * largest


def test_the_memory_of_gaps_cures_the_outlet(outlet):
    """Fitted to one case, it brings the largest error of all cases below 0.1 d."""
    cases = outlet[outlet["variant"] == "default"]
    assert cases["model_error"].abs().max() > 0.1
    assert cases["memory_error"].abs().max() < 0.1
    fitted = cases[(cases[CASE] == pd.Series(whole_channel.FITTED.row)).all(axis=1)]
    assert abs(fitted["model_error"].item()) == cases["model_error"].abs().max()
    (c,) = set(outlet["c"])
    assert study("paper").trains.memory == c


def test_within_the_range_distances_may_be_held(outlet):
    within = outlet[outlet["memory_number"] < QUASI_STEADY_LIMIT]
    assert set(within["deborah"]) == {5.0}
    assert within["model_largest_error"].max() < 0.1


def test_how_the_mesh_moves_and_how_fine_it_is_do_not_matter(direct):
    """By far less than the errors of the model, at De = 62."""
    reference = of(direct, (1.5,), "rest", 62.0)["distance"].to_numpy()
    for variant, allowed in (("smooth", 0.02), ("finer", 0.03)):
        other = of(direct, (1.5,), "rest", 62.0, variant)["distance"].to_numpy()
        assert np.abs(other - reference).max() < allowed, variant
