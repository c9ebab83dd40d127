"""What a job says about its simulation, and when holes are too many."""

import logging

import pytest
import xarray as xr
from harness import study
from snakemake_interface_logger_plugins.common import LogEvent

from viscotrain.config import stages
from viscotrain.config.geometries import simulated_deborahs
from viscotrain.jobs import progress, provenance
from viscotrain.jobs.digests import digest
from viscotrain.jobs.watch import HolesWatch
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


@pytest.fixture
def watch(folder):
    return HolesWatch(STUDY, folder)


def finished(watch, capsys, name, data) -> str:
    """What the workflow says when a simulation has finished."""
    data.to_netcdf(watch._folder / "dns" / f"{name}.nc")
    watch.handle(logging.makeLogRecord({"event": LogEvent.JOB_FINISHED, "job_id": 1}))
    return capsys.readouterr().err


def test_a_line_counts_what_was_solved():
    assert progress.line("a", result(1.1, 1.5)) == "a: solved 2 of 2 De, up to 1"
    assert progress.line("a", result(1.5, 1.1)) == "a: solved 1 of 1 De, up to 1"
    pair = progress.line("a", result(1.1, INF, failed_from=1))
    assert pair == "a: solved 1 of 2 De, up to 0; no convergence"
    assert progress.line("a", result(1.1, 1.5, failed_from=0)) == (
        "a: solved 0 of 2 De; no convergence"
    )


def test_the_warning_comes_with_the_hole_that_is_too_much(watch, capsys):
    pair = finished(watch, capsys, "sp1.1_sfinf", result(1.1, INF, failed_from=1))
    assert pair == ""  # two holes
    triplet = finished(watch, capsys, "sp1.1_sf1.5", result(1.1, 1.5, failed_from=0))
    # the mirror image at De = 0 too
    assert triplet == (
        "warning: the table has 5 holes by now; allowed: 2 (table.max_holes). "
        "The table step will refuse them\n"
    )
    assert finished(watch, capsys, "sp1.1_sf1.1", result(1.1, 1.1)) == ""


def test_other_records_are_no_reason_to_count(watch, capsys):
    result(1.1, 1.5, failed_from=0).to_netcdf(watch._folder / "dns" / "sp1.1_sf1.5.nc")
    watch.handle(logging.makeLogRecord({"event": LogEvent.JOB_INFO}))
    watch.handle(logging.makeLogRecord({"msg": "words"}))
    assert capsys.readouterr().err == ""


def test_points_that_are_not_accurate_are_solved_and_named(folder):
    rough = result(1.1, 1.5).assign(
        velocity_error=("deborah", [1e-7, 2e-6]),
        relative_velocity_error=(("deborah", "pair"), [[1e-7, 1e-7], [4e-5, 3e-5]]),
    )
    rough["status"][1] = INACCURATE
    rough["reason"][1] = "estimated error is too large"
    rough.to_netcdf(folder / "dns" / "sp1.1_sf1.5.nc")
    assert progress.line("sp1.1_sf1.5", rough) == (
        "sp1.1_sf1.5: solved 2 of 2 De, up to 1; not accurate: 1, "
        "largest estimated error 4.0e-05 Ubar at De 1"
    )
    assert progress.holes(STUDY, progress.outcomes(STUDY, folder)) == 0


def test_without_the_single_sphere_every_pair_is_a_hole(watch, capsys):
    text = finished(watch, capsys, "spinf_sfinf", result(INF, INF, failed_from=1))
    assert "has 6 holes" in text


def test_files_of_other_settings_do_not_count(folder):
    result(1.1, INF, failed_from=0).to_netcdf(folder / "dns" / "sp1.1_sfinf.nc")
    dns = STUDY.dns.model_copy(update={"tolerance": 1e-8})
    assert progress.outcomes(STUDY.model_copy(update={"dns": dns}), folder) == {}
    assert len(progress.outcomes(STUDY, folder)) == 2
