"""Print what a velocity table holds: ranges, holes, interpolation error, provenance.

python scripts/inspect_table.py results/demo/table/velocity_table.nc
"""

from pathlib import Path

from viscotrain.jobs.entry import Job, run, taken
from viscotrain.table import description
from viscotrain.table.interpolation import VelocityTable


def main(job: Job, file: Path):
    """Print the summary of one file."""
    print(description.summary(VelocityTable.open(file).dataset))


run(main, [taken("file", "velocity table")])
