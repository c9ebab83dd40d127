"""What jobs ask a cluster for."""

import pytest

from viscotrain.jobs import resources


def test_higher_deborah_numbers_ask_for_more():
    times = [resources.minutes("dns", De) for De in (0, 5, 31, 62)]
    assert times == sorted(times)
    assert times[0] == resources.SHORTEST < times[-1]
    assert resources.minutes("dns", 1000) == times[-1]  # the largest that was measured
    assert resources.minutes("transient", 62) > 5 * times[-1]
    assert resources.megabytes(5) < resources.megabytes(62)


@pytest.mark.parametrize("stage", resources.TIMES)
def test_every_attempt_asks_for_twice_as_much(stage):
    first = resources.minutes(stage, 62)
    assert [resources.minutes(stage, 62, attempt) for attempt in (2, 3)] == [2 * first, 4 * first]
    assert resources.megabytes(1, attempt=2) == 2 * resources.megabytes(1)


def test_what_was_measured_has_room():
    """Of the slowest geometry up to De = 62 with its 90,000 unknowns: 2130 MB, a minute."""
    assert resources.megabytes(62) > 1.3 * 2130
    assert resources.minutes("dns", 62) > 10
