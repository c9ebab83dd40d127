"""Print what a velocity table holds: ranges, holes, interpolation error, provenance.

From the command line: python scripts/inspect_table.py results/demo/table/velocity_table.nc
"""

import argparse

from viscotrain.jobs.command import reporting
from viscotrain.table import description
from viscotrain.table.interpolation import VelocityTable


def main(path: str):
    """Print the summary of one file."""
    print(description.summary(VelocityTable.open(path).dataset))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("file", help="velocity table")
    with reporting():
        main(parser.parse_args().file)
