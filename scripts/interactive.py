"""Interactive stage: velocity table and trains -> one page for a browser.

From the command line:
python scripts/interactive.py --configfile config/config.yaml TABLE OUTPUT TRAIN...
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from viscotrain.config.models import Study, load_study, parse_study
from viscotrain.drawing import interactive
from viscotrain.jobs.command import reporting


def main(study: Study, table: str | Path, trains: Sequence[str | Path], output: str | Path):
    """Write the page."""
    text = interactive.page(
        xr.load_dataset(table),
        [xr.load_dataset(path) for path in trains],
        study.study,
        study.channel.diameter,
    )
    Path(output).write_text(text, encoding="utf-8")
    print(f"{output}: {len(text) / 1e6:.1f} MB")


def _command_line():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--configfile", required=True, help="config of the study")
    parser.add_argument("table", help="velocity table")
    parser.add_argument("output", help="HTML file to write")
    parser.add_argument("trains", nargs="*", help="netCDF files of the trains")
    a = parser.parse_args()
    with reporting():
        main(load_study(a.configfile), a.table, a.trains, a.output)


if "snakemake" in globals():
    with reporting(snakemake.log[0]):  # noqa: F821
        main(
            parse_study(snakemake.config),  # noqa: F821
            snakemake.input.table,  # noqa: F821
            snakemake.input.trains,  # noqa: F821
            snakemake.output[0],  # noqa: F821
        )
elif __name__ == "__main__":
    _command_line()
