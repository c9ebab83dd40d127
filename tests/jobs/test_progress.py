"""What a job says about its simulation, and when holes are too many."""

import pytest
import xarray as xr
from harness import study

from viscotrain.config import stages
from viscotrain.config.geometries import simulated_deborahs
from viscotrain.jobs import progress, provenance
from viscotrain.jobs.digests import digest
from viscotrain.words import INACCURATE

INF = float("inf")
STUDY = study(table={"sp": (1.1, 1.5, INF), "sf": (1.1, 1.5, INF), "max_holes": 2})


def result(sp, sf, failed_from=INF):
    """A file of the dns stage, as far as it is looked at."""
    deborahs = simulated_deborahs(STUDY, sp, sf)
    status = [int(De >= failed_from) for De in deborahs]
    reason = ["no convergence" if bad else "" for bad in status]
    return xr.Dataset(
        {"status": ("deborah", status), "reason": ("deborah", reason)},
        coords={"deborah": list(deborahs)},
        attrs=provenance.attributes("test", stages.dns(STUDY, sp, sf), digest("dns")),
    )


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "dns").mkdir()
    return tmp_path


def line(folder, name, data):
    data.to_netcdf(folder / "dns" / f"{name}.nc")
    return progress.line(STUDY, name, data, folder)


def test_a_line_counts_what_was_solved(folder):
    assert line(folder, "sp1.1_sf1.5", result(1.1, 1.5)) == (
        "sp1.1_sf1.5: solved 2 of 2 De, up to 1"
    )
    assert line(folder, "sp1.5_sf1.1", result(1.5, 1.1)) == (
        "sp1.5_sf1.1: solved 1 of 1 De, up to 1"
    )


def test_the_warning_comes_with_the_hole_that_is_too_much(folder):
    pair = line(folder, "sp1.1_sfinf", result(1.1, INF, failed_from=1))
    assert pair == "sp1.1_sfinf: solved 1 of 2 De, up to 0; no convergence"  # two holes
    triplet = line(folder, "sp1.1_sf1.5", result(1.1, 1.5, failed_from=0))
    assert triplet.startswith("sp1.1_sf1.5: solved 0 of 2 De; no convergence\nwarning: ")
    # the mirror image at De = 0 too
    assert "has 5 holes by now; allowed: 2 (table.max_holes)" in triplet
    assert "warning" not in line(folder, "sp1.1_sf1.1", result(1.1, 1.1))


def test_points_that_are_not_accurate_are_solved_and_named(folder):
    rough = result(1.1, 1.5).assign(
        velocity_error=("deborah", [1e-7, 2e-6]),
        relative_velocity_error=(("deborah", "pair"), [[1e-7, 1e-7], [4e-5, 3e-5]]),
    )
    rough["status"][1] = INACCURATE
    rough["reason"][1] = "estimated error is too large"
    assert line(folder, "sp1.1_sf1.5", rough) == (
        "sp1.1_sf1.5: solved 2 of 2 De, up to 1; not accurate: 1, "
        "largest estimated error 4.0e-05 Ubar at De 1"
    )
    assert progress.holes(STUDY, progress.outcomes(STUDY, folder)) == 0


def test_without_the_single_sphere_every_pair_is_a_hole(folder):
    assert "has 6 holes" in line(folder, "spinf_sfinf", result(INF, INF, failed_from=1))


def test_files_of_other_settings_do_not_count(folder):
    line(folder, "sp1.1_sfinf", result(1.1, INF, failed_from=0))
    dns = STUDY.dns.model_copy(update={"tolerance": 1e-8})
    assert progress.outcomes(STUDY.model_copy(update={"dns": dns}), folder) == {}
    assert len(progress.outcomes(STUDY, folder)) == 2
