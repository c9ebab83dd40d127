"""Studies of convergence on made-up numbers, what they vary, and what they report."""

import itertools
import math

import harness
import numpy as np
import pandas as pd
import pytest
import xarray as xr

from viscotrain.config import stages
from viscotrain.drawing import verification_figures
from viscotrain.drawing.style import deborah_look
from viscotrain.studies import accuracy, start_up
from viscotrain.studies.accuracy import RELATIVE, observed_orders, with_errors
from viscotrain.studies.convergence import convergence_rows, settings

DEMO = stages.convergence(harness.study("config"))


def rows(values, error, default, deborah=1.0):
    """Relative velocities that approach (1e-3, -2e-3) with the given error."""
    return pd.DataFrame(
        {
            "sp": 1.5,
            "sf": 2.5,
            "deborah": deborah,
            "value": values,
            "default": [value == default for value in values],
            RELATIVE[0]: [1e-3 + error(value) for value in values],
            RELATIVE[1]: [-2e-3 - 3 * error(value) for value in values],
        }
    )


def test_order_in_time_and_error_of_the_controlled_steps():
    table = rows([0.1, 0.05, 0.025, 0.0125], lambda h: 0.01 * h**2, default=None)
    controlled = rows([0.0], lambda _: 5e-6, default=0.0)
    table = pd.concat([table, controlled], ignore_index=True)
    table = with_errors(table, "time_step")
    assert table["error"].values == pytest.approx([3e-4, 7.5e-5, 1.875e-5, 4.6875e-6, 1.5e-5])
    (found,) = observed_orders(table, "time_step").itertuples()
    assert found.observed == pytest.approx(2.0)
    assert found.default_error == pytest.approx(1.5e-5)
    assert found.default_error_share == pytest.approx(1.5e-5 / 2.015e-3)


def test_order_of_the_mesh_is_a_power():
    table = with_errors(rows([1.4, 1.0, 0.7, 0.01], lambda h: 1e-4 * h**4, default=1.0), "mesh")
    (found,) = observed_orders(table, "mesh").itertuples()
    assert found.observed == pytest.approx(4.0, abs=0.01)
    assert found.default_error == pytest.approx(3e-4, rel=1e-6)


def test_box_and_order_converge_by_a_factor():
    table = with_errors(rows([1, 2, 3, 9], lambda x: 1e-2 * 10.0**-x, default=2), "box")
    (found,) = observed_orders(table, "box").itertuples()
    assert found.observed == pytest.approx(10.0, rel=1e-3)
    assert found.default_error == pytest.approx(3e-4, rel=1e-5)


def test_below_the_noise_no_order_is_claimed():
    table = with_errors(rows([1.4, 1.0, 0.7], lambda h: 1e-8 * h, default=1.0), "mesh")
    (found,) = observed_orders(table, "mesh").itertuples()
    assert math.isnan(found.observed)


def test_each_kind_varies_one_thing():
    for kind in ("mesh", "box"):
        found = list(settings(DEMO, kind))
        assert [default for _, default, _ in found].count(True) == 1
        for _, default, study in found:
            assert (study == DEMO) == default
            given, own = study.dns.model_dump(), DEMO.dns.model_dump()
            changed = {name for name in own if given[name] != own[name]}
            allowed = {
                "mesh": {
                    "sphere_elements",
                    "axis_size",
                    "wall_size",
                    "accuracy",
                    "relative_accuracy",
                    "max_unknowns",
                },
                "box": {"margin"},
            }[kind]
            assert changed == (set() if default else allowed)


def test_finer_meshes_are_finer_at_the_start_and_at_the_end():
    found = [study.dns for *_, study in settings(DEMO, "mesh")]
    accuracies = np.array([dns.accuracy for dns in found]) / DEMO.dns.accuracy
    assert accuracies == pytest.approx([4, 1, 0.25], rel=0.03)
    for coarse, fine in itertools.pairwise(found):
        assert fine.relative_accuracy < coarse.relative_accuracy
        assert fine.wall_size < coarse.wall_size
        assert fine.sphere_elements > coarse.sphere_elements
        assert fine.max_unknowns > 2 * coarse.max_unknowns


def test_boxes_are_longer_than_the_default_one():
    assert [margin for margin, *_ in settings(DEMO, "box")] == [2.0, 4.0, 6.0]


def test_orders_around_the_one_found_are_on_its_mesh():
    tiny = stages.convergence(harness.study("tiny"))
    table = convergence_rows(tiny.at([0.0, 1.0]), "order", math.inf, 1.5, report=print)
    for _, part in table.groupby("deborah"):
        assert part["elements"].nunique() == 1
        (found,) = part.loc[part["default"], "value"]
        assert list(part["value"] - found) == [-1, 0, 1]
    errors = with_errors(table, "order").set_index(["deborah", "value"])["error"]
    assert errors.loc[0.0].max() < 1e-5
    low, middle, high = errors.loc[1.0]
    assert low > middle > high == 0 and 1e-7 < middle < 1e-4


def comparison(sp=1.5, deborah=5.0):
    """Transient relative velocities 1e-5 above the quasi-steady ones at the end."""
    spheres = ["trailing", "middle", "leading"] if np.isfinite(sp) else ["middle", "leading"]
    time = np.linspace(0.0, 10 * deborah, 11)
    U = np.arange(len(spheres)) * 1e-3 * (1 + np.exp(-time[:, None]))
    at_end = U[[5, -1]] - np.arange(len(spheres)) * 1e-5
    gaps = len(spheres) - 1
    return xr.Dataset(
        {
            "velocity": (("time", "sphere"), U),
            "distance": (("time", "gap"), np.full((time.size, gaps), 1.5)),
            "quasi_steady_velocity": (("check", "sphere"), at_end),
            "check_time": ("check", time[[5, -1]]),
            "sp": sp,
            "sf": 2.5,
            "deborah": deborah,
            "deborah_longest_mode": deborah,
        },
        coords={"time": time, "sphere": spheres, "gap": np.arange(1, gaps + 1)},
    )


def test_differences_are_transient_minus_quasi_steady():
    np.testing.assert_allclose(
        accuracy.remaining_differences(comparison()), np.full((2, 2), 1e-5), atol=1e-12
    )


def test_a_start_up_of_less_than_a_relaxation_time_is_compared_at_its_end(monkeypatch):
    """`dns.transient.duration` may be below 1; there was nothing to compare then."""
    monkeypatch.setattr(start_up, "_quasi_steady", lambda *_: np.array([0.0, 1e-3, 2e-3]))
    whole = comparison().drop_vars(["quasi_steady_velocity", "check_time"])
    short = whole.isel(time=slice(0, 1)).assign_coords(time=[0.4 * 5.0])
    compared = start_up.compare_start_up(DEMO, short, lambda _: None)
    assert compared["check_time"].values == pytest.approx([2.0])
    table = xr.Dataset(coords={"deborah": [5.0]})
    text = accuracy.accuracy(table, [compared], [], pd.DataFrame(), {})
    assert "transient, 0.4 relaxation times after rest | 5 | 1.0e-03 Ubar" in text
    whole = start_up.compare_start_up(DEMO, whole, lambda _: None)
    assert whole["check_time"].values == pytest.approx([5, 10, 15, 20, 30, 40, 50])


def train(deborah):
    time = np.linspace(0, 100, 5)
    distance = np.full((5, 3), 2.0)
    return xr.Dataset(
        {
            "distance": (("time", "gap"), distance),
            "model_distance": (
                ("closure", "time", "gap"),
                np.stack([distance + 0.001, distance + 0.002]),
            ),
            "deborah": deborah,
        },
        coords={
            "time": time,
            "gap": [1, 2, 3],
            "sphere": list("abcd"),
            "closure": ["every_sphere", "nearest"],
        },
    )


SPACING = pd.DataFrame(
    {
        "deborah": 0.0,
        "gap": [0.3, 0.3, 4.0] * 2,
        "number": [1, 2, 1] * 2,
        "direct": 1e-3,
        "closure": ["every_sphere"] * 3 + ["nearest"] * 3,
        "error": [1e-5, -3e-5, 1e-7, 1e-4, -3e-4, 1e-6],
    }
)


def test_statement_of_accuracy_holds_every_number():
    table = xr.Dataset(
        {"check_error": (("deborah", "check", "pair"), np.full((1, 2, 2), -8e-5))},
        coords={"deborah": [5.0]},
    )
    studies = {"mesh": rows([1.4, 1.0, 0.7, 0.01], lambda h: 1e-4 * h**4, default=1.0)}
    text = accuracy.accuracy(table, [comparison()], [train(0.0)], SPACING, studies)
    for number in ("3.0e-04 Ubar (13 %)", "order 4", "8.0e-05 Ubar", "1.0e-05 Ubar"):
        assert number in text, number
    then = "direct simulation until 100 D/Ubar | 0"
    assert f"train model, 4 spheres, every sphere | {then} | 0.003 d" in text
    assert f"train model, 4 spheres, two neighbours | {then} | 0.006 d" in text
    assert "gaps of 0.3 d, every sphere | equally spaced spheres | 0 | 3.0e-05 Ubar" in text
    assert "gaps of 0.3 d, two neighbours | equally spaced spheres | 0 | 3.0e-04 Ubar" in text
    assert all(line.count("|") == 5 for line in text.splitlines())


def test_figures_hold_their_data():
    pair, three = comparison(np.inf), comparison()
    drawn = verification_figures.start_up([three, pair]).data
    assert set(drawn["pair"]) == {"middle-trailing", "leading-middle"}
    assert len(drawn) == 3 * 11
    assert drawn["quasi_steady_Ubar"].notna().sum() == 3 * 2
    closed = verification_figures.closure([train(0.0), train(5.0)], SPACING).data
    assert (closed["comparison"] == "train").sum() == 2 * 2 * 5 * 3
    errors = verification_figures.convergence(rows([1.4, 1.0, 0.7], abs, default=1.0), "mesh").data
    assert errors["error"].max() > 0


def test_a_start_up_is_drawn_whole_with_held_velocities_on_it():
    """A panel for each run and one for what remains, in the colour of De, gaps by their dashes."""
    figure = verification_figures.start_up([comparison(), comparison(np.inf, 1.0)]).figure
    three, pair, remaining = figure.axes
    assert three.get_title("left") == "De = 5: $s_p$ = 1.5 $d$, $s_f$ = 2.5 $d$"
    behind, behind_held, ahead, ahead_held, _ = three.lines
    assert ahead.get_linestyle() == "-" and behind.get_linestyle() == "--"
    np.testing.assert_allclose(ahead.get_ydata()[0], 2.0)  # 1e-3 Ubar
    np.testing.assert_allclose(ahead_held.get_ydata()[-1], 1 + np.exp(-50) - 0.01)
    assert three.get_ylim()[1] > 2.0 and behind_held.get_linestyle() == "None"
    assert len(pair.lines) == 3 and pair.lines[0].get_linestyle() == "-"
    colours = [line.get_color().tolist() for line in (three.lines[0], pair.lines[0])]
    assert colours == [deborah_look(De)["color"].tolist() for De in (5.0, 1.0)]
    for line, color in zip(remaining.lines, colours, strict=True):
        assert line.get_color().tolist() == color
        np.testing.assert_allclose(line.get_ydata(), 1e-5, rtol=1e-6)


def test_errors_of_both_models_are_told_apart():
    late = train(5.0)
    late["model_distance"][:, :2] = np.nan
    figure = verification_figures.closure([train(0.0), late], SPACING).figure
    first, second, error, share = figure.axes
    dashes = {name: own["ls"] for name, own in verification_figures.MODELS.items()}
    assert len(set(map(str, dashes.values()))) == 2
    assert len(first.lines) == 1 + 2 * 3
    np.testing.assert_allclose(first.lines[1].get_ydata(), 0.001)
    np.testing.assert_allclose(first.lines[-1].get_ydata(), 0.006)
    (told,) = first.texts
    assert told.get_text().splitlines() == [
        "every sphere: at most 0.003 $d$",
        "two neighbours: at most 0.006 $d$",
    ]
    assert "start-up" in [text.get_text() for text in second.texts]
    assert second.patches[0].get_width() == 50.0
    np.testing.assert_allclose(error.lines[0].get_ydata(), [3e-5, 1e-7])
    np.testing.assert_allclose(share.lines[0].get_ydata(), [3.0, 0.01])
