"""Variables of datasets: dimensionless, and described."""

from collections.abc import Sequence

import xarray as xr


def described(values, dims: Sequence[str], long_name: str, **attributes) -> xr.Variable:
    """A dimensionless variable."""
    return xr.Variable(dims, values, {"long_name": long_name, "units": "1", **attributes})
