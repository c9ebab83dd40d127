import itertools
import time

import numpy as np
import pytest
import xarray as xr
import yaml
from harness import run_script, written
from synthetic import DEMO_NODES, SINGLE, dns_result, superposed, triplet

from viscotrain.errors import TableError
from viscotrain.jobs import datasets
from viscotrain.table.assembly import combine
from viscotrain.table.attributes import INTERPOLATED, ITSELF, MIRROR, SAME_PAIR
from viscotrain.table.check import check_errors, combine_and_check
from viscotrain.table.cross_approximation import cross
from viscotrain.table.description import largest_error, memory_headline, summary
from viscotrain.table.interpolation import VelocityTable
from viscotrain.table.pairs import pair_velocity
from viscotrain.table.points import holes, inaccurate_points, interpolated_points
from viscotrain.table.present import after_start_up
from viscotrain.table.triplets import on_lines, simulations
from viscotrain.words import INACCURATE

INF = np.inf
SP, SF, DEBORAH = [1.1, 2.0, INF], [1.2, 3.0, 5.0, INF], (0.0, 1.0)


def results(**changes):
    return [dns_result(sp, sf, **changes) for sp, sf in itertools.product(SP, SF)]


def combined(parts, **changes):
    return combine(parts, sp=SP, sf=SF, deborah=DEBORAH, **changes)


# -------------------------------------------------------------------------------------- combine


def test_every_result_is_at_its_place_in_any_order():
    table = combined(reversed(results()))
    assert table["velocity"].dims == ("deborah", "sp", "sf", "particle")
    assert table["particle"].values.tolist() == ["trailing", "middle", "leading"]
    for De, sp, sf in itertools.product(DEBORAH, SP, SF):
        point = table.sel(deborah=De, sp=sp, sf=sf)
        np.testing.assert_array_equal(point["velocity"], superposed(sp, sf, scale=1 + De))
        assert point["pressure_gradient"] == 32 / (1 + De)
        assert point["status"] == 0
    np.testing.assert_array_equal(table["centreline_velocity"], [2.0, 1.9])
    np.testing.assert_array_equal(table["deborah_mean_relaxation_time"], [0.0, 0.56])


def test_memory_numbers_by_hand():
    """De |dU|/beta of the faster of the gaps that there are."""
    table = combined(results())
    at = {"deborah": 1.0, "sp": 1.1, "sf": 3.0}
    trailing, middle, leading = superposed(1.1, 3.0, scale=2)
    faster = max(abs(middle - trailing), abs(leading - middle))
    assert float(table["memory_number"].sel(at)) == pytest.approx(faster / 0.2, rel=1e-12)
    pair = 2 * (superposed(INF, 3.0)[2] - superposed(INF, 3.0)[1]) / 0.2
    for name, at in (("memory_number", {"sp": INF, "sf": 3.0}), ("pair_memory_number", {})):
        layer = table[name].sel(deborah=1.0).sel(at)
        found = layer if at else layer.sel(pair_distance=3.0)
        assert float(found) == pytest.approx(abs(pair), rel=1e-12), name
    assert (table["memory_number"].sel(deborah=0.0) == 0).all()
    assert float(table["memory_number"].sel(deborah=1.0, sp=INF, sf=INF)) == 0.0
    assert table["memory_number"].dims == ("deborah", "sp", "sf")


def test_a_table_says_at_which_deborah_numbers_gaps_change_too_fast():
    parts = results(deborah=(0.0, 20.0))
    table = combine(parts, sp=SP, sf=SF, deborah=[0.0, 20.0])
    largest = float(table["memory_number"].max())
    assert largest > 0.1
    line = f"  De 20: {largest:.2g}  beyond the quasi-steady range"
    assert line in summary(table).splitlines()
    assert memory_headline(table).endswith("; beyond the quasi-steady range: De 20")
    slow = table.assign(memory_number=table["memory_number"] * 0.1 / largest)
    assert memory_headline(slow) == "memory number up to 0.1"  # the limit is within
    assert "beyond" not in summary(slow)


def test_the_memory_number_of_a_hole_is_not_known():
    parts = results()
    parts[0] = dns_result(SP[0], SF[0], unsolved=[1.0])
    table = combined(parts, max_holes=1)
    assert np.isnan(table["memory_number"].sel(deborah=1.0, sp=SP[0], sf=SF[0]))
    assert np.isfinite(table["memory_number"]).sum() == table["memory_number"].size - 1


def test_particles_are_matched_by_name():
    turned = [result.isel(particle=[2, 0, 1]) for result in results()]
    xr.testing.assert_identical(combined(turned), combined(results()))


def test_results_at_more_deborah_numbers_are_used_where_needed():
    more = results(deborah=(0.0, 0.5, 1.0, 2.0))
    np.testing.assert_array_equal(combined(more)["velocity"], combined(results())["velocity"])


def test_variables_are_described():
    table = check_errors(combined(results()), [dns_result(1.5, 2.0)])
    for name, variable in table.variables.items():
        if name in ("deborah_longest_mode", "deborah_mean_relaxation_time"):
            continue  # the dns stage describes them, the results of these tests do not
        assert variable.attrs["long_name"], name
        if np.issubdtype(variable.dtype, np.floating):
            assert variable.attrs["units"] == "1", name
    assert len(table["status"].attrs["flag_values"]) == 4
    assert len(table["status"].attrs["flag_meanings"].split()) == 4


def test_holes_stay_visible():
    parts = [result for result in results() if (result["sp"], result["sf"]) != (2.0, 3.0)]
    parts[0] = dns_result(SP[0], SF[0], unsolved=[1.0])
    table = combined(parts, max_holes=3)
    assert list(holes(table)) == [(0.0, 2.0, 3.0), (1.0, 1.1, 1.2), (1.0, 2.0, 3.0)]
    assert np.isnan(table["velocity"].sel(sp=2.0, sf=3.0)).all()
    assert table["status"].sel(sp=2.0, sf=3.0).values.tolist() == [2, 2]
    assert table["status"].sel(sp=1.1, sf=1.2).values.tolist() == [0, 1]
    with pytest.raises(TableError) as caught:
        combined(parts, max_holes=2)
    message = str(caught.value)
    assert "3 of 24 points have no solution; allowed: 2 (table.max_holes)" in message
    assert "De 1, sp 1.1, sf 1.2: no convergence in 15 iterations" in message
    assert "De 0, sp 2, sf 3: not attempted" in message


def with_errors(result, trailing=1e-6, leading=2e-6, status=None):
    """A result with estimated errors, at its De = 1 with another status if given."""
    errors = np.where(np.isinf([result["sp"], result["sf"]]), np.nan, [trailing, leading])
    result = result.assign(
        velocity_error=("deborah", [3e-6, 3e-6]),
        relative_velocity_error=(("deborah", "pair"), [errors, errors]),
    ).assign_coords(pair=["middle-trailing", "leading-middle"])
    if status is not None:
        result["status"][1] = status
    return result


def test_points_that_are_not_accurate_are_used_and_counted():
    parts = [with_errors(result) for result in results()]
    parts[0] = with_errors(results()[0], trailing=7e-5, status=INACCURATE)
    table = combined(parts)
    assert not list(holes(table))
    assert inaccurate_points(table) == 1
    assert largest_error(table) == "7.0e-05 mean velocities at De 0, (sp 1.1, sf 1.2)"
    np.testing.assert_array_equal(table["velocity"], combined(results())["velocity"])
    between = [dns_result(1.5, 2.0)]
    between[0]["status"][1] = INACCURATE
    assert np.isfinite(check_errors(table, between)["check_error"]).all()
    text = summary(table)
    assert "points not accurate: 1" in text
    assert "De 1: 7.0e-05 mean velocities, at (sp 1.1, sf 1.2); 1 not accurate" in text
    single = table.sel(deborah=[0.0], sp=[INF], sf=[INF])
    assert largest_error(single).startswith("3.0e-06 mean velocities at De 0")


def test_results_without_estimates_have_none_in_the_table():
    table = combined(results())
    assert np.isnan(table["relative_velocity_error"]).all()
    assert largest_error(table) == "not estimated"
    assert largest_error(table.drop_vars("relative_velocity_error")) == "not estimated"


def test_estimated_errors_of_twins_have_the_pairs_of_the_twin():
    axis = [1.5, 2.5, INF]
    known = [(1.5, 1.5), (1.5, 2.5), (2.5, 2.5), (1.5, INF), (2.5, INF), (INF, INF)]
    parts = [with_errors(dns_result(*geometry)) for geometry in known]
    table = combine(parts, sp=axis, sf=axis, deborah=DEBORAH, max_holes=1)
    error = table["relative_velocity_error"]
    assert error.sel(deborah=0, sp=1.5, sf=2.5).values.tolist() == [1e-6, 2e-6]
    assert error.sel(deborah=0, sp=2.5, sf=1.5).values.tolist() == [2e-6, 1e-6]
    np.testing.assert_array_equal(error.sel(deborah=1, sp=1.5, sf=INF), [1e-6, np.nan])
    np.testing.assert_array_equal(error.sel(deborah=1, sp=INF, sf=1.5), [np.nan, 1e-6])
    assert float(table["velocity_error"].sel(deborah=1, sp=INF, sf=1.5)) == 3e-6


def test_without_the_single_sphere_pairs_are_incomplete():
    parts = [*results()[:-1], dns_result(INF, INF, unsolved=[1.0])]
    assert [De for De, *_ in holes(combined(parts, max_holes=6))] == [1.0] * 6
    with pytest.raises(TableError, match=r"sp 1\.1, sf inf: needs the single sphere"):
        combined(parts)


def test_a_solution_that_is_not_finite_is_a_hole():
    parts = results()
    parts[3]["velocity"][1, 0] = np.nan
    with pytest.raises(TableError, match=r"1 of 24 points"):
        combined(parts)


def test_geometries_off_the_grid_and_doubles_are_refused():
    with pytest.raises(TableError, match=r"\(sp 1\.7, sf 2\) is not on the grid"):
        combined([*results(), dns_result(1.7, 2.0)])
    with pytest.raises(TableError, match=r"\(sp 2, sf inf\) comes twice"):
        combined([*results(), dns_result(2.0, INF)])


# -------------------------------------------------------------------------------- interpolation


def test_check_errors_is_interpolated_minus_simulated():
    table = combined(results())
    checked = check_errors(table, [dns_result(1.5, 2.0), dns_result(1.3, 4.0)])
    assert checked["check_sp"].values.tolist() == [1.3, 1.5]
    interpolated = VelocityTable(table).at(1)(1.3, 4.0)
    error = checked["check_error"].sel(deborah=1, pair="leading-middle")[0]
    exact = superposed(1.3, 4.0, scale=2)
    assert error == pytest.approx((interpolated[2] - interpolated[1]) - (exact[2] - exact[1]))
    np.testing.assert_array_equal(checked["check_velocity"].sel(deborah=1)[0], exact)


def test_check_errors_at_holes_are_not_known():
    table = combined([*results()[1:], dns_result(SP[0], SF[0], unsolved=[1.0])], max_holes=1)
    checked = check_errors(table, [dns_result(1.5, 2.0), dns_result(1.3, 2.0, unsolved=[0.0])])
    known = np.isfinite(checked["check_error"]).all("pair").values
    np.testing.assert_array_equal(known, [[False, True], [False, False]])


# ------------------------------------------------------------------------------- file, summary


def test_file_is_the_same_byte_for_byte_and_reads_back(tmp_path):
    table = check_errors(combined(results()).assign_attrs(title="test"), [dns_result(1.5, 2.0)])
    datasets.write(table, tmp_path / "a.nc")
    time.sleep(1.1)  # clocks in a file count seconds
    datasets.write(table, tmp_path / "new" / "a.nc")
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "new" / "a.nc").read_bytes()
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "a.nc"), datasets.described(table))


def test_coordinates_in_the_file_have_no_fill_value(tmp_path):
    datasets.write(combined(results()), tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc") as table:
        for name in table.coords:
            assert "_FillValue" not in table[name].encoding, name
        assert table["sp"].values.tolist() == SP
        assert table["velocity"].encoding["complevel"] == 4


def test_pair_velocity_is_that_of_the_law():
    s = np.array([1.1, 1.5, 2.5, 4.5])  # nodes: no interpolation error
    law = np.diff(superposed(s, INF), axis=-1)[:, 0]  # middle minus trailing, in either position
    np.testing.assert_allclose(pair_velocity(triplet(), s), law, rtol=0, atol=1e-14)


def test_summary_tells_what_a_person_wants():
    parts = [*results()[:-2], dns_result(INF, 5.0, unsolved=[1.0]), dns_result(INF, INF)]
    table = combined(parts, max_holes=1).assign_attrs(title="a table", git_commit="abc")
    text = summary(check_errors(table, [dns_result(1.5, 2.0)]))
    for words in (
        "a table",
        "sp    3 values: 1.1 2 inf",
        "attraction until s = 1.",
        "then repulsion",
        "Holes: 1 of 24 points",
        "De 1: (sp inf, sf 5)",
        "De 1: not known",
        "at (sp 1.5, sf 2)",
        "git_commit: abc",
    ):
        assert words in text


def test_summary_of_a_newtonian_table():
    newtonian = combined(results())
    newtonian["velocity"][:] = newtonian["pair_velocity"][:] = 1.95
    assert "De 0: no relative motion above 1e-06 Ubar" in summary(newtonian)
    assert "not measured (table.check is 0)" in summary(newtonian)


# -------------------------------------------------------------------------------------- scripts


@pytest.fixture
def config(tmp_path):
    """A config file with the axes of the demo, and one result file per geometry and check."""
    table = {"sp": DEMO_NODES, "sf": DEMO_NODES, "pair": [], "check": 2}
    path = tmp_path / "config.yaml"
    path.write_text(yaml.safe_dump(written(table=table, figures={})))
    geometries = [*itertools.product(DEMO_NODES, DEMO_NODES), (1.3, 1.9), (3.1, 1.9)]
    for n, (sp, sf) in enumerate(geometries):
        datasets.write(dns_result(sp, sf), tmp_path / "dns" / f"{n}.nc")
    return path


@pytest.mark.slow
def test_scripts_from_the_command_line(config, tmp_path):
    output = tmp_path / "velocity_table.nc"
    done = run_script("table.py", "--configfile", config, output, *(tmp_path / "dns").iterdir())
    assert done.returncode == 0, done.stderr
    table = xr.load_dataset(output)
    assert table.sizes["check"] == 2
    assert table.attrs["Conventions"].startswith("CF-")
    assert yaml.safe_load(table.attrs["settings"])["sp"] == DEMO_NODES
    shown = run_script("inspect_table.py", output)
    assert shown.returncode == 0, shown.stderr
    assert shown.stdout.strip() == summary(table).strip()


@pytest.mark.slow
def test_script_ends_with_a_message_without_a_traceback(config, tmp_path):
    (tmp_path / "dns" / "0.nc").unlink()
    output = tmp_path / "velocity_table.nc"
    done = run_script("table.py", "--configfile", config, output, *(tmp_path / "dns").iterdir())
    assert done.returncode == 1
    assert done.stderr.startswith("error: 2 of 50 points have no solution; allowed: 0")
    assert "Traceback" not in done.stderr
    assert not output.exists()


# ------------------------------------------------------------------------------- same flows


def symmetric_result(sp, sf, deborah):
    """As `dns_result`, but at De = 0 of a law that is the same for the mirror image."""
    result = dns_result(sp, sf, deborah)
    mirrored = dns_result(sf, sp, deborah)["velocity"].values[:, ::-1]
    at_rest = result["deborah"] == 0
    mean = result["velocity"].copy(data=(result["velocity"].values + mirrored) / 2)
    result["velocity"] = result["velocity"].where(~at_rest, mean)
    return result


def all_needed(grid):
    """What is simulated of a grid that is wanted at every De."""
    return simulations({De: grid for De in DEBORAH})


@pytest.mark.parametrize("axis", [[1.1, 1.5, INF], DEMO_NODES])
def test_a_flow_with_two_names_is_in_the_table_twice(axis):
    """Of all simulations, those that are needed make the same table."""
    grid = list(itertools.product(axis, axis))
    needed = all_needed(grid)
    every = [symmetric_result(*triplet, DEBORAH) for triplet in grid]
    few = [symmetric_result(*triplet, own) for triplet, own in needed.items()]
    axes = {"sp": axis, "sf": axis, "deborah": DEBORAH}
    whole, table = combine(every, **axes), combine(few, **axes)
    n = len(axis) - 1
    assert len(few) == (n + 1) ** 2 - n
    assert sum(map(len, needed.values())) == 2 * len(few) - n * (n - 1) // 2
    xr.testing.assert_identical(table.drop_vars("origin"), whole.drop_vars("origin"))
    assert (whole["origin"] == ITSELF).all()
    assert (table["origin"].sel(sp=INF).isel(sf=slice(0, n)) == SAME_PAIR).all()
    assert (table["origin"].sel(sf=INF) == ITSELF).all()
    assert table["origin"].sel(sp=1.5, sf=1.1).values.tolist() == [MIRROR, ITSELF]
    assert (table["origin"].sel(sp=1.1, sf=1.5) == ITSELF).all()


def test_a_twin_that_failed_makes_two_holes():
    pairs = {"sp": [1.1, INF], "sf": [1.1, INF], "deborah": DEBORAH}
    parts = [dns_result(1.1, INF, unsolved=[1.0]), dns_result(1.1, 1.1), dns_result(INF, INF)]
    table = combine(parts, **pairs, max_holes=2)
    assert list(holes(table)) == [(1.0, 1.1, INF), (1.0, INF, 1.1)]
    with pytest.raises(TableError, match=r"sp inf, sf 1\.1: no convergence in 15 iterations"):
        combine(parts, **pairs)


def test_a_triplet_is_not_simulated_as_one_that_is_not_wanted():
    """Only sf has 1.2, so its pair and its triplets stand for themselves."""
    grid = list(itertools.product([1.1, 2.0, INF], [1.1, 1.2, INF]))
    needed = all_needed(grid)
    assert needed[INF, 1.2] == needed[2.0, 1.2] == needed[2.0, 1.1] == DEBORAH
    assert (INF, 1.1) not in needed


def test_mirrors_between_the_nodes_are_used():
    table = combined(results())
    parts = [dns_result(1.3, 1.9), dns_result(1.9, 1.3, deborah=[1.0])]
    checked = check_errors(table, parts)
    U = checked["check_velocity"].sel(deborah=0.0).values
    np.testing.assert_array_equal(U[1], U[0][::-1])
    assert np.isfinite(checked["check_error"]).all()


# ---------------------------------------------------------------------------- transient results


def trajectory(sp, sf, De, failed=False):
    """A transient simulation as its stage writes it; gaps have moved meanwhile."""
    present = [s + 0.03 * np.sin(3 * s) if np.isfinite(s) else s for s in (sp, sf)]
    there = np.isfinite([sp, 0.0, sf])
    distances = [s for s in present if np.isfinite(s)]
    end = superposed(*present, scale=1 + De)[there]
    return xr.Dataset(
        {
            "velocity": (("time", "sphere"), np.stack([np.zeros_like(end), end])),
            "distance": (("time", "gap"), np.tile(distances, (2, 1)).reshape(2, -1)),
            "pressure_gradient": ("time", [0.0, 32 / (1 + De)]),
            "status": ((), 1 if failed else 0),
            "reason": ((), "too small a step" if failed else ""),
            "centreline_velocity": ((), 1.9),
            "confinement": ((), 0.2),
            "deborah": ((), De),
            "deborah_longest_mode": ((), De),
            "deborah_mean_relaxation_time": ((), De / 2),
            "sp": ((), sp),
            "sf": ((), sf),
        },
        coords={
            "time": [0.0, 10.0],
            "sphere": np.array(["trailing", "middle", "leading"])[there],
        },
    )


def transient_results(**changes):
    return [
        after_start_up(trajectory(sp, sf, De, **changes))
        for sp, sf, De in itertools.product(DEMO_NODES, DEMO_NODES, DEBORAH)
    ]


def test_transient_velocities_are_carried_to_the_nodes():
    table = combine(transient_results(), sp=DEMO_NODES, sf=DEMO_NODES, deborah=DEBORAH)
    moved = table["present_sp"].isel(sf=-1, deborah=1) - table["sp"]
    assert float(abs(moved).isel(sp=slice(0, -1)).max()) > 0.02
    for k, De in enumerate(DEBORAH):
        exact = superposed(*np.meshgrid(DEMO_NODES, DEMO_NODES, indexing="ij"), scale=1 + De)
        error = np.diff(table["velocity"].values[k], axis=-1) - np.diff(exact, axis=-1)
        finite = np.abs(error[:-1, :-1])
        assert finite.max() < 3e-5 * (1 + De)
        uncarried = superposed(
            *(table[name].values[k] for name in ("present_sp", "present_sf")), scale=1 + De
        )
        wrong = np.diff(uncarried, axis=-1) - np.diff(exact, axis=-1)
        assert finite.max() < np.abs(wrong[:-1, :-1]).max() / 5


def test_transient_results_between_the_nodes_are_compared_at_their_present_distances():
    table = combine(transient_results(), sp=DEMO_NODES, sf=DEMO_NODES, deborah=DEBORAH)
    between = [after_start_up(trajectory(1.3, 2.0, De)) for De in DEBORAH]
    checked = check_errors(table, between)
    velocities = VelocityTable(table).at(1.0)
    present = (float(between[1][name][0]) for name in ("present_sp", "present_sf"))
    expected = np.diff(velocities(*present)) - np.diff(between[1]["velocity"].values[0])
    np.testing.assert_allclose(checked["check_error"].sel(deborah=1.0)[0], expected, atol=1e-15)


def test_a_start_up_of_a_pair_has_its_present_distance_under_both_names():
    parts = transient_results()
    needed = all_needed(list(itertools.product(DEMO_NODES, DEMO_NODES)))
    few = [
        part
        for part in parts
        if float(part["deborah"][0]) in needed.get((float(part["sp"]), float(part["sf"])), ())
    ]
    assert len(few) == len(parts) - 2 * 4 - 6
    axes = {"sp": DEMO_NODES, "sf": DEMO_NODES, "deborah": DEBORAH}
    table = combine(few, **axes)
    for name, other in (("present_sp", "present_sf"), ("present_sf", "present_sp")):
        turned = table[other].transpose("deborah", "sf", "sp").values
        np.testing.assert_array_equal(table[name].values[0], turned[0])
        np.testing.assert_array_equal(table[name].values[:, -1], turned[:, -1])


def test_a_start_up_that_fails_is_a_hole():
    bad = (1.1, 1.2, 1.0)
    parts = {
        point: after_start_up(trajectory(*point, failed=point == bad))
        for point in itertools.product(SP, SF, DEBORAH)
    }
    assert np.isnan(parts[bad]["velocity"]).all()
    with pytest.raises(TableError, match=r"1 of 24 points .*\n.*sp 1.1, sf 1.2: too small a step"):
        combined(parts.values())
    table = combined(parts.values(), max_holes=1)
    assert list(holes(table)) == [(1.0, 1.1, 1.2)]


# ------------------------------------------------------------------------- lines of the grid


SIX = [1.1, 1.3, 1.7, 2.2, 3.0, 4.5, INF]
PAIR = np.geomspace(1.1, 16, 40).tolist()
AXES = {"sp": SIX, "sf": SIX, "pair": sorted({*SIX[:-1], *PAIR}), "deborah": DEBORAH}
CROSSINGS = on_lines(SIX, 3)


def together(sp, sf, De):
    """U of spheres of which pairs feel De, and a third one adds a product."""
    a, b = (lambda s, k=k: k * (1 + De) * np.exp(-(s - 1) / 1.3) for k in (-2e-3, -1e-3))
    third = 1e-3 * np.exp(-(sp - 1)) * np.exp(-(sf - 1) / 0.8) * (1 + De / 2)
    outer = np.array([a(sp + sf), 0.0, b(sp + sf)])
    return SINGLE + np.array([a(sp), b(sp) + a(sf), b(sf)]) + outer + third * np.array([1, 2, -1])


def results_on_lines(law=together):
    """Simulations where sp or sf is on a line of the grid, and of pairs."""
    grid = [each for each in itertools.product(SIX, SIX) if set(each) & set(CROSSINGS)]
    results = []
    for sp, sf in {*grid, *((s, INF) for s in AXES["pair"])}:
        result = dns_result(sp, sf)
        missing = np.isinf([sp, 0.0, sf])
        result["velocity"][:] = [np.where(missing, np.nan, law(sp, sf, De)) for De in DEBORAH]
        results.append(result)
    return results


def test_lines_are_every_so_many_distances_with_the_first_and_not_the_last():
    assert CROSSINGS == [1.1, 2.2, INF]
    assert on_lines(SIX, 2) == [1.1, 1.7, 3.0, INF]
    assert on_lines(SIX[1:], 2) == [1.3, 2.2, INF]
    assert on_lines(SIX, 5) == [1.1, INF]
    assert on_lines(SIX, 1) == SIX
    assert on_lines([2.0, INF], 5) == [2.0, INF]


def test_velocities_between_lines_follow_from_those_on_them():
    table = combine(results_on_lines(), **AXES, line_spacing=3)
    assert not list(holes(table))
    between = table["origin"] == INTERPOLATED
    assert int(between.sum()) == interpolated_points(table) == 2 * 4 * 4
    for De, sp, sf in itertools.product(DEBORAH, SIX, SIX):
        point = table.sel(deborah=De, sp=sp, sf=sf)
        exact = together(sp, sf, De)
        if {sp, sf} & set(CROSSINGS):
            there = np.isfinite([sp, 0.0, sf])
            np.testing.assert_array_equal(point["velocity"][there], exact[there])
        else:
            assert int(point["origin"]) == INTERPOLATED
            np.testing.assert_allclose(point["velocity"], exact, rtol=0, atol=1e-6)
            assert np.isnan(point["velocity_error"])
    assert "32 points follow from those on lines" in summary(table)


@pytest.mark.parametrize("lines", [3, 5])
def test_a_sum_of_three_products_is_known_from_three_lines(lines):
    rng = np.random.default_rng(5)
    matrix = 1e-3 * rng.normal(size=(9, 3)) @ rng.normal(size=(3, 8))
    rows, columns = np.arange(9) < lines, np.arange(8) % 3 != 1
    known = np.where(rows[:, None] | columns, matrix, np.nan)
    known[~rows] = np.where(columns, known[~rows], np.nan)
    np.testing.assert_allclose(cross(known, rows, columns), matrix, rtol=0, atol=1e-13)


def test_errors_of_simulations_are_hardly_enlarged():
    """A fourth singular value would be theirs: with it some matrix is wrong a hundredfold."""
    error, found = 1e-5, []
    lines = np.arange(40) % 10 == 0
    for seed in range(6, 12):
        rng = np.random.default_rng(seed)
        matrix = 1e-3 * rng.normal(size=(40, 2)) @ rng.normal(size=(2, 40))
        wrong = matrix + error * rng.normal(size=matrix.shape)
        found.append(np.sqrt(np.mean((cross(wrong, lines, lines) - matrix) ** 2)))
    assert max(found) < 6 * error


def test_nothing_follows_from_nothing():
    lines = np.array([True, False, True])
    assert not cross(np.zeros((3, 3)), lines, lines).any()


def test_a_hole_on_the_lines_leaves_all_between_them_open():
    results = results_on_lines()
    for result in results:
        if (result["sp"], result["sf"]) == (1.7, 2.2):
            result["velocity"][1], result["status"][1] = np.nan, 1
            result["reason"] = ("deborah", ["", "stuck"])
    table = combine(results, **AXES, line_spacing=3, max_holes=17)
    assert len(list(holes(table))) == 1 + 16
    assert {De for De, *_ in holes(table)} == {1.0}
    with pytest.raises(TableError, match=r"17 of .*\n  De 1, sp 1\.7, sf 2\.2: stuck"):
        combine(results, **AXES, line_spacing=3)


def test_lines_too_far_apart_are_refused():
    results = results_on_lines()
    check = dns_result(1.2, 1.5)
    check["velocity"][:] = [together(1.2, 1.5, De) for De in DEBORAH]
    limits = {"line_spacing": 3, "accuracy": 1e-5, "relative_accuracy": 0.02}
    checked = combine_and_check([*results, check], **AXES, **limits)
    assert checked.sizes["check"] == 1
    check["velocity"][1, 1] += 2e-4
    with pytest.raises(TableError, match=r"(?s)at De 1, .*wrong at 1 of 1.*sp 1\.2, sf 1\.5: 2"):
        combine_and_check([*results, check], **AXES, **limits)


# ------------------------------------------------------------------------------- pairs


def test_pairs_between_the_nodes_are_in_the_table_and_used():
    between = [1.3, 7.0, 14.0]
    distance = sorted({*SP[:-1], *SF[:-1], *between})
    more = [dns_result(s, INF) for s in between]
    table = combined([*results(), *more], pair=distance)
    U = table["pair_velocity"].sel(pair_distance=1.3, deborah=1.0)
    np.testing.assert_array_equal(U, superposed(1.3, INF, scale=2)[:2])
    finer, coarser = VelocityTable(table).at(1.0), VelocityTable(combined(results())).at(1.0)
    for s in between:
        error = [abs(v(s, INF) - superposed(s, INF, scale=2)).max() for v in (finer, coarser)]
        assert error[0] < 1e-14 < error[1]


def test_a_pair_that_is_missing_is_a_hole():
    distance = sorted({*SP[:-1], *SF[:-1], 1.3})
    table = combined(results(), pair=distance, max_holes=2)
    assert list(holes(table)) == [(0.0, 1.3, INF), (1.0, 1.3, INF)]
    with pytest.raises(TableError, match=r"2 of 26 points"):
        combined(results(), pair=distance)
    with pytest.raises(TableError, match="holes are never filled"):
        VelocityTable(table).at(0.0)


def test_transient_pairs_are_carried_to_their_distances():
    table = combine(transient_results(), sp=DEMO_NODES, sf=DEMO_NODES, deborah=DEBORAH)
    moved = table["present_pair_distance"].sel(deborah=1.0) - table["pair_distance"]
    assert float(abs(moved).max()) > 0.02
    exact = superposed(np.array(DEMO_NODES[:-1]), INF, scale=2)[:, :2]
    error = abs(table["pair_velocity"].sel(deborah=1.0).values - exact)
    assert error.max() < 2e-4  # from four distances
