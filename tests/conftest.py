"""Fixtures for all stages; one thread each, like the jobs of the workflow."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported

import pytest

from viscotrain.fluid.parameters import DimensionlessFluid, Mode


@pytest.fixture
def hyaluronic_acid() -> DimensionlessFluid:
    """The two-mode fluid of the study: 1 wt% in PBS."""
    return DimensionlessFluid.from_physical(
        0.051, [Mode(0.257, 0.0752, 0.283), Mode(0.254, 0.00848, 0.49)]
    )
