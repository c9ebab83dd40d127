"""Writing datasets and tables: compressed, free of clocks, coordinates without fill values."""

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from viscotrain import files
from viscotrain.table.attributes import ATTRIBUTES
from viscotrain.words import DEBORAH_NUMBERS

COMPRESSION = 4  # zlib level
# What files of several stages hold for their readers, who need not say it themselves.
SHARED = {
    **{name: {"long_name": words, "units": "1"} for name, words in DEBORAH_NUMBERS.items()},
    **{name: ATTRIBUTES[name] for name in ("sp", "sf", "status", "centreline_velocity")},
    "confinement": {"long_name": "sphere over channel diameter", "units": "1"},
    "length": {"long_name": "periodic length over channel diameter", "units": "1"},
    "reason": {"long_name": "why there is no solution, or none that is accurate"},
    "sphere": {"long_name": "sphere, named along the flow"},
}


def read(path: str | Path) -> xr.Dataset:
    """A dataset with all its values.

    Raises:
        FileError: It is damaged, or not of this program.
    """
    return files.read_dataset(path)


def write(dataset: xr.Dataset, path: str | Path) -> None:
    """Write a netCDF file, whose bytes depend on the content only; its folder is made if needed.

    Values carry checksums, so that damage is found where they are read.
    """
    dataset = described(dataset)
    encoding: dict[Hashable, dict[str, Any]] = {}
    for name, variable in dataset.variables.items():
        options: dict[str, Any] = {}
        encoding[name] = options
        if name in dataset.coords:
            options["_FillValue"] = None
        if variable.ndim and np.issubdtype(variable.dtype, np.number):
            options |= {"zlib": True, "complevel": COMPRESSION, "fletcher32": True}
    with files.whole(path) as part:
        dataset.to_netcdf(part, engine="netcdf4", encoding=encoding)


def described(dataset: xr.Dataset) -> xr.Dataset:
    """A dataset whose shared variables say what they are, where their stage does not."""
    dataset = dataset.assign_attrs({files.MADE_HERE: ""} | dataset.attrs)
    for name, attributes in SHARED.items():
        if name in dataset.variables and "long_name" not in dataset[name].attrs:
            dataset[name].attrs.update(attributes)
    return dataset


def write_csv(table: pd.DataFrame, path: str | Path | None, digits: int | None = None) -> None:
    """Write a table, with so many significant digits; its folder is made if needed.

    Args:
        table: Without an index of a meaning.
        path: None for nowhere.
        digits: None for all.
    """
    if path is None:
        return
    form = None if digits is None else f"%.{digits}g"
    with files.whole(path) as part:
        table.to_csv(part, index=False, float_format=form, lineterminator="\n")
