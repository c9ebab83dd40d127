"""What the dns stage stores: datasets, marked failures, fields."""

import math

import harness
import numpy as np
import pytest
import xarray as xr
import yaml

from viscotrain.config import stages
from viscotrain.config.settings import FlowSettings
from viscotrain.jobs import datasets, provenance
from viscotrain.studies import dns
from viscotrain.words import INACCURATE, NOT_ATTEMPTED, NOT_CONVERGED, SOLVED, has_solution

STUDY = harness.study()
TINY = stages.flow(STUDY)


def quiet(_):
    pass


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """The tiny study's triplet, as written and read again, and the folder of its VTU files."""
    folder = tmp_path_factory.mktemp("dns")
    lines = []
    result, timing = dns.solve_geometry(TINY, 1.5, 1.5, lines.append, vtu_folder=folder)
    result = result.assign_attrs(provenance.attributes("test", TINY, "0123"))
    datasets.write(result, folder / "result.nc")
    return xr.load_dataset(folder / "result.nc"), timing, lines, folder


def test_dataset_is_complete_finite_and_described(solved):
    result, *_ = solved
    assert has_solution(result["status"]).all()
    assert result["velocity"].dims == ("deborah", "particle")
    for name in ("velocity", "pressure_gradient", "centreline_velocity", "residual"):
        assert np.isfinite(result[name]).all(), name
    for name, variable in result.data_vars.items():
        assert variable.attrs["long_name"], name
        if variable.dtype.kind == "f":
            assert variable.attrs["units"], name
    for coordinate in result.coords.values():
        assert "_FillValue" not in coordinate.encoding or coordinate.dtype.kind != "f"
    assert set(result.attrs) >= {"git_commit", "code_digest", "software_versions"}
    again = FlowSettings.model_validate(yaml.safe_load(result.attrs["settings"]))
    assert again.stated().text() == TINY.stated().text()


def test_velocities_are_ordered_and_plausible(solved):
    """Spheres on the axis are a little slower than the undisturbed centreline."""
    result, *_ = solved
    assert (result["velocity"] < result["centreline_velocity"]).all()
    assert (result["velocity"] > 0.95 * result["centreline_velocity"]).all()
    assert result["centreline_velocity"][0] == pytest.approx(2.0)
    Newtonian = result["velocity"].sel(deborah=0)
    assert Newtonian.sel(particle="trailing") == pytest.approx(
        float(Newtonian.sel(particle="leading")), abs=1e-5
    )


def test_both_deborah_numbers_are_stored(solved):
    result, *_ = solved
    mean = TINY.dimensionless_fluid.mean_relaxation_time
    assert result["deborah_longest_mode"].values == pytest.approx([0, 1])
    assert result["deborah_mean_relaxation_time"].values == pytest.approx([0, mean])


def test_the_log_has_a_line_per_deborah_number(solved):
    _, timing, lines, _ = solved
    assert len(lines) == len(TINY.deborah) == len(timing)
    for De, line in zip(TINY.deborah, lines, strict=True):
        assert line.startswith(f"De {De:g}:")
        assert "iterations" in line and "residual" in line and "CPU s" in line


def test_missing_spheres_have_no_velocity_of_their_own():
    result, _ = dns.solve_geometry(TINY, math.inf, 1.5, quiet)
    assert np.isnan(result["velocity"].sel(particle="trailing")).all()
    assert np.isfinite(result["velocity"].sel(particle=["middle", "leading"])).all()


def test_errors_are_stored_by_the_pairs_that_are_there():
    study = stages.flow(harness.study(dns={"velocity_order": 3, "accuracy": 1.0}))
    result, _ = dns.solve_geometry(study, math.inf, 1.5, quiet)
    error = result["relative_velocity_error"]
    assert np.isnan(error.sel(pair="middle-trailing")).all()
    assert (error.sel(pair="leading-middle") > 0).all()
    assert (result["velocity_error"] > 0).all()
    assert (result["status"] == SOLVED).all()
    assert set(result["reason"].values) == {""}


def test_a_point_that_is_not_accurate_is_solved_and_marked():
    rough = {"accuracy": 1e-12, "relative_accuracy": 0.0, "max_unknowns": 1}
    lines = []
    study = stages.flow(harness.study(dns=rough | {"velocity_order": 3}))
    result, _ = dns.solve_geometry(study, math.inf, 1.5, lines.append)
    assert (result["status"] == INACCURATE).all()
    assert np.isfinite(result["velocity"].sel(particle="middle")).all()
    assert all("NOT ACCURATE" in line for line in lines)
    assert "estimated error" in str(result["reason"][1].item())


def test_no_unique_flow_is_named():
    """A mobility above 1/2 with hardly any solvent: shear stress decreases with the rate."""
    modes = (STUDY.fluid.modes[0].model_copy(update={"mobility": 0.95}),)
    fluid = {"modes": modes, "solvent_viscosity": 1e-4}
    failing = harness.study(fluid=fluid, dns={"max_iterations": 1}, deborah={"values": (5.0,)})
    study = stages.flow(failing)
    assert math.isnan(dns.undisturbed(study, 5.0).centreline_velocity)
    result, _ = dns.solve_geometry(study, math.inf, math.inf, quiet)
    assert "no unique steady flow: shear stress" in str(result["reason"][0].item())


def test_failure_is_a_result():
    """One iteration cannot converge: NaN, a status and a reason, and no exception."""
    failing = stages.flow(harness.study(dns={"max_iterations": 1}))
    result, timing = dns.solve_geometry(failing, 1.5, 1.5, quiet)
    assert result["status"].values.tolist() == [NOT_CONVERGED, NOT_ATTEMPTED]
    assert np.isnan(result["velocity"]).all()
    reason = str(result["reason"][0].item())
    assert reason.startswith("not resolved at De = 0, on ")
    assert "no convergence" in reason and "dns.max_iterations" in reason
    assert "smaller De" in str(result["reason"][1].item())
    assert len(timing) == 1


def test_vtu_files_open_in_pyvista(solved):
    pyvista = pytest.importorskip("pyvista")
    *_, folder = solved
    result, *_ = solved
    grid = pyvista.read(folder / "De1.vtu")
    assert {"velocity_z", "pressure", "stress_zz", "stress_zr"} <= set(grid.point_data)
    speed = grid.point_data["velocity_z"]
    # 0 at the wall, the centreline at most; the pointwise error at the axis is 1e-2 on this mesh
    assert speed.min() == pytest.approx(0, abs=1e-6)
    assert speed.max() == pytest.approx(float(result["centreline_velocity"][1]), abs=2e-2)


def test_sampled_fields_have_the_flow_in_them():
    field = dns.field(TINY, 1.5, 1.5, quiet)
    assert field["deborah"].values.tolist() == list(TINY.deborah)
    a, z = float(field["confinement"]) / 2, field["z"] - field["sphere_position"]
    inside = (np.hypot(z, field["r"]) < a * (1 - 1e-9)).any("sphere")
    for name in ("velocity_z", "stress_zz"):
        assert (field[name].isnull().any("deborah") == inside).all()
    wall = field.sel(deborah=1.0).isel(r=-1)
    assert np.abs(wall["velocity_z"]).max() < 1e-9
    # near the wall shear makes a tension along the flow, tau_zz > 0, and drags it, tau_zr < 0
    assert (wall["stress_zz"] > 0).all() and (wall["stress_zr"] < 0).all()
    # the spheres' own velocities are those of the fluid at their poles
    poles = field.sel(deborah=1.0, r=0.0)
    for sphere in field["sphere"].values:
        at = float(field["sphere_position"].sel(sphere=sphere)) + 1.02 * a
        fluid = float(poles["velocity_z"].sel(z=at, method="nearest"))
        assert fluid == pytest.approx(
            float(field["sphere_velocity"].sel(deborah=1.0, sphere=sphere)), abs=0.02
        )
    # at the ends of the box there is the stress of the flow without spheres, known exactly
    ends = field.sel(deborah=1.0).isel(z=[0, -1])
    largest = float(np.abs(ends["undisturbed_stress_zz"]).max())
    for name in ("zz", "rr", "zr"):
        error = ends[f"stress_{name}"] - ends[f"undisturbed_stress_{name}"]
        assert np.abs(error).max() < 0.02 * largest, name


# ------------------------------------------------------------------------------- same flows


def velocities(study, sp, sf):
    """U by De and particle, of a direct solution at every De."""
    found = [s.velocities for _, s in dns.solutions(study, dns.triplet(study, sp, sf))]
    assert len(found) == len(study.deborah)
    return found


def test_a_pair_has_the_same_velocities_under_both_names():
    behind, ahead = velocities(TINY, 1.5, math.inf), velocities(TINY, math.inf, 1.5)
    for first, second in zip(behind, ahead, strict=True):
        assert first["trailing"] == pytest.approx(second["middle"], abs=1e-8)
        assert first["middle"] == pytest.approx(second["leading"], abs=1e-8)


def test_the_mirror_image_has_the_same_velocities_without_elasticity():
    study = TINY.at([0.0])
    (near,), (far,) = velocities(study, 1.2, 2.5), velocities(study, 2.5, 1.2)
    assert near["trailing"] == pytest.approx(far["leading"], abs=2e-7)
    assert near["middle"] == pytest.approx(far["middle"], abs=2e-7)
    assert near["leading"] == pytest.approx(far["trailing"], abs=2e-7)


def test_a_file_holds_the_deborah_numbers_at_which_it_is_needed():
    axis = (1.2, 1.5, math.inf)
    study = harness.study(table={"sp": axis, "sf": axis})
    result, timing = dns.solve_geometry(stages.dns(study, 1.5, 1.2), 1.5, 1.2, quiet)
    assert result["deborah"].values.tolist() == [1.0]
    assert timing["deborah"].tolist() == [1.0]


def test_the_study_says_which_deborah_number_is_meant():
    """A De of the mean relaxation time is solved at a larger one of the longest mode."""
    deborah = STUDY.deborah.model_copy(
        update={"values": (0.5,), "definition": "mean_relaxation_time"}
    )
    mean = stages.flow(STUDY.model_copy(update={"deborah": deborah}))
    longest = 0.5 / STUDY.dimensionless_fluid.mean_relaxation_time
    ((De, solution),) = dns.solutions(mean, dns.triplet(mean, math.inf, math.inf))
    assert (De, solution.deborah) == (0.5, pytest.approx(longest))
    result, _ = dns.solve_geometry(mean, math.inf, math.inf, quiet)
    assert result["deborah_longest_mode"].item() == pytest.approx(longest)
    assert result["deborah_mean_relaxation_time"].item() == pytest.approx(0.5)
    deborah = STUDY.deborah.model_copy(update={"values": (longest,)})
    same = stages.flow(STUDY.model_copy(update={"deborah": deborah}))
    expected, _ = dns.solve_geometry(same, math.inf, math.inf, quiet)
    np.testing.assert_allclose(result["velocity"], expected["velocity"], rtol=1e-9)
