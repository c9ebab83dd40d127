"""Velocities in a duct: all spheres as much faster as the flow, relative velocities the same."""

import numpy as np
import pytest
import xarray as xr

from viscotrain.errors import TableError
from viscotrain.table.drift import in_duct, open_table


@pytest.fixture
def table(tiny_table):
    return xr.load_dataset(tiny_table)


def flow(table, largest):
    De = table["deborah"].values
    return xr.Dataset({"centreline_velocity": ("deborah", largest)}, coords={"deborah": De})


def test_all_spheres_are_as_much_faster_as_the_flow(table):
    """A Newtonian square at De = 0, and less than the tube at De = 1."""
    largest = np.array([2.0963, 1.7])
    duct = in_duct(table, flow(table, largest))
    drift = largest - table["centreline_velocity"].values
    for name in ("velocity", "pair_velocity"):
        assert duct[name].dims == table[name].dims
        moved = (duct[name] - table[name]).transpose("deborah", ...).values
        np.testing.assert_allclose(moved, np.broadcast_to(drift, moved.T.shape).T, atol=1e-14)
    np.testing.assert_allclose(duct["centreline_velocity"], largest)
    relative = [data["velocity"].diff("particle").values for data in (table, duct)]
    np.testing.assert_allclose(*relative, atol=1e-14)


def test_a_tube_is_as_it_was(tiny_table, table):
    assert open_table(tiny_table, None).dataset.identical(table)


def test_without_a_flow_there_are_no_velocities(table):
    with pytest.raises(TableError, match="not known at De = 1; allowed"):
        in_duct(table, flow(table, [2.1, np.nan]))
