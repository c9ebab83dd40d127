"""Trains of one condition: what the table tells about them is in their file."""

import itertools

import harness
import pytest
from synthetic import DEMO_NODES, dns_result

from viscotrain.config import stages
from viscotrain.studies.train_runs import simulate
from viscotrain.table.assembly import combine
from viscotrain.table.check import check_errors
from viscotrain.table.interpolation import VelocityTable


def test_trains_hold_the_error_of_the_velocities_at_their_deborah_number():
    """The largest one between the distances, of the layer of this De and of no other."""
    results = [dns_result(*where) for where in itertools.product(DEMO_NODES, DEMO_NODES)]
    table = combine(results, sp=DEMO_NODES, sf=DEMO_NODES, deborah=[0.0, 1.0])
    table = check_errors(table, [dns_result(1.3, 1.9)])
    settings = stages.trains(harness.study("tiny"))
    found = simulate(settings, VelocityTable(table), 1.0, 0.01)
    expected = abs(table["check_error"].sel(deborah=1.0)).max()
    assert float(found["velocity_error"]) == pytest.approx(float(expected))
    assert float(found["velocity_error"]) > float(abs(table["check_error"]).sel(deborah=0.0).max())
