"""Writing datasets: compressed, free of clocks, coordinates without fill values."""

from pathlib import Path

import numpy as np
import xarray as xr

COMPRESSION = 4  # zlib level


def write(dataset: xr.Dataset, path: str | Path) -> None:
    """Write a netCDF file, whose bytes depend on the content only; its folder is made if needed."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    encoding = {}
    for name, variable in dataset.variables.items():
        options = encoding[name] = {}
        if name in dataset.coords:
            options["_FillValue"] = None
        if variable.ndim and np.issubdtype(variable.dtype, np.number):
            options |= {"zlib": True, "complevel": COMPRESSION}
    dataset.to_netcdf(path, engine="netcdf4", encoding=encoding)
