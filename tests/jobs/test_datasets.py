"""Files of results: what every variable is, and bytes that depend on the content only."""

import pytest
import xarray as xr

from viscotrain.jobs import datasets


def test_shared_variables_are_described_unless_their_stage_did():
    own = xr.Dataset({"sp": 1.5, "reason": "", "x": 1.0}, coords={"deborah": [0.0, 1.0]})
    own["sp"].attrs["long_name"] = "distance after the start-up"
    found = datasets.described(own)
    assert found["deborah"].attrs["units"] == "1"
    assert found["sp"].attrs == {"long_name": "distance after the start-up"}
    assert found["reason"].attrs["long_name"].startswith("why")
    assert not found["x"].attrs
    assert not own["deborah"].attrs  # what is being computed with stays as it is


@pytest.mark.slow
def test_every_variable_of_every_file_says_what_it_is(finished_study):
    found = (finished_study / "results").rglob("*.nc")
    files = sorted(path for path in found if path.stat().st_size)  # figures there are empty
    assert {path.parent.name for path in files} >= {"dns", "table", "trains", "order", "design_map"}
    silent = []
    for path in files:
        with xr.open_dataset(path) as dataset:
            names = (
                name for name, own in dataset.variables.items() if "long_name" not in own.attrs
            )
            silent += [f"{path.name}: {name}" for name in names]
    assert not silent, "\n".join(silent)
