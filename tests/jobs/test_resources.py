"""What jobs ask a cluster for."""

import pytest
from harness import study

from viscotrain.jobs import resources


def test_higher_deborah_numbers_ask_for_more():
    times = [resources.minutes("dns", De, geometries=10) for De in (0, 5, 31, 62)]
    assert times == sorted(times)
    assert times[0] == resources.SHORTEST < times[-1]
    assert resources.minutes("dns", 1000, geometries=10) == times[-1]  # the largest measured
    assert resources.minutes("transient", 62) > 8 * resources.minutes("dns", 62)
    assert resources.megabytes(5) < resources.megabytes(62)


@pytest.mark.parametrize("stage", resources.TIMES)
def test_every_attempt_asks_for_twice_as_much(stage):
    first = resources.minutes(stage, 62)
    assert [resources.minutes(stage, 62, attempt) for attempt in (2, 3)] == [2 * first, 4 * first]
    assert resources.megabytes(1, attempt=2) == 2 * resources.megabytes(1)


def test_several_geometries_ask_for_the_time_of_all_and_the_memory_of_one():
    """Four times what the slowest one takes, for each more: half an hour asks for three to four."""
    one, ten = (resources.minutes("dns", 62, geometries=number) for number in (1, 10))
    assert ten - one == pytest.approx(9 * 4 * resources._at(62)[0] / 60, abs=1)
    assert resources.minutes("dns", 62, 3, 10) == 4 * ten
    number = round(1800 / resources.flow_seconds(62))
    assert 2 * 30 < resources.minutes("dns", 62, geometries=number) < 8 * 30


def test_what_was_measured_has_room():
    """Of the slowest geometries of the full study, up to 90,000 unknowns: 2130 MB, 39 CPU s."""
    assert resources.megabytes(62) > 1.3 * 2130
    assert 60 * resources.minutes("dns", 62) > 5 * 39


def test_longer_trains_ask_for_more():
    """Twice as long a channel holds twice the spheres, each of which feels as many as before."""
    demo = study("config")
    longer = study("config", channel={"length": 2 * demo.channel.length})
    seconds = [resources.train_seconds(each, 0.004, demo.trains) for each in (demo, longer)]
    assert 2 < seconds[1] / seconds[0] < 4
    assert seconds[0] > 9  # as measured in the demo
    assert resources.minutes_for(seconds[1]) > resources.minutes_for(seconds[0], attempt=1)
    assert resources.minutes_for(1.0) == resources.SHORTEST


def test_what_does_not_solve_has_room():
    assert resources.megabytes_for(300) > 300
    assert resources.megabytes_for(300, attempt=3) == 4 * resources.megabytes_for(300)
