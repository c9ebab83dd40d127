"""Which geometries are solved by one job."""

import math

import pytest
from harness import study

from viscotrain.config import stages
from viscotrain.config.geometries import simulated
from viscotrain.jobs import grouping

STUDIES = ["tiny", "config", "paper"]


@pytest.mark.parametrize("name", STUDIES)
@pytest.mark.parametrize("minutes", [1e-6, grouping.MINUTES, 1.0, 30.0])
def test_every_geometry_is_in_one_job_with_others_of_the_same_settings(name, minutes):
    own = study(name)
    jobs = grouping.jobs(own, minutes)
    geometries = [geometry for job in jobs for geometry in job]
    assert len(geometries) == len(set(geometries))
    assert set(geometries) == set(simulated(own))
    for job in jobs:
        assert len({repr(stages.dns(own, *geometry).stated()) for geometry in job}) == 1
    assert jobs[0][0] == (math.inf, math.inf)


def test_a_job_holds_the_work_that_is_asked_for():
    """Half an hour of what takes 21 s up to De = 62, 2.8 s up to De = 5, as measured."""
    sizes = {name: max(map(len, grouping.jobs(study(name), 30.0))) for name in ("paper", "config")}
    assert sizes == {"paper": 82, "config": 25}  # all those with the same Deborah numbers
    assert max(map(len, grouping.jobs(study("paper"), 10.0))) == pytest.approx(600 / 21, rel=0.2)
    assert max(map(len, grouping.jobs(study("paper")))) == 1
    assert max(map(len, grouping.jobs(study("config")))) == pytest.approx(20 / 2.8, abs=1)


@pytest.mark.parametrize("minutes", [0.1, 0.5, 2.0])
def test_jobs_of_the_same_settings_are_of_the_same_size(minutes):
    """All cores are busy to the end."""
    own, sizes = study("config"), {}
    for job in grouping.jobs(own, minutes):
        sizes.setdefault(simulated(own)[job[0]], []).append(len(job))
    assert len(sizes) == 2
    assert all(max(found) - min(found) <= 1 for found in sizes.values())


def test_a_large_study_has_few_hundred_jobs():
    axis = (*(1.02 + 0.02 * n for n in range(99)), math.inf)
    jobs = grouping.jobs(study("config", table={"sp": axis, "sf": axis}))
    assert sum(map(len, jobs)) > 9_900
    assert len(jobs) <= 2 * grouping.MOST  # mirror images have other Deborah numbers


@pytest.mark.parametrize("size", [1, 3, 1000])
def test_the_config_may_say_how_many(size):
    jobs = grouping.jobs(study("config", dns={"geometries_per_job": size}), minutes=30.0)
    assert max(map(len, jobs)) == min(size, 25)
    assert len(jobs) == sum(math.ceil(number / size) for number in (25, 6))


def test_the_number_is_no_setting_of_a_geometry():
    one, many = study("config"), study("config", dns={"geometries_per_job": 7})
    assert repr(stages.dns(one, 1.2, 1.2).stated()) == repr(stages.dns(many, 1.2, 1.2).stated())
