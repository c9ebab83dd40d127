"""Print what a velocity table holds: ranges, holes, interpolation error, provenance.

python scripts/inspect_table.py results/demo/table/velocity_table.nc
"""

from viscotrain.jobs.entry import Job, Table, run
from viscotrain.table import description
from viscotrain.table.interpolation import VelocityTable


def main(job: Job, table: Table):
    """Print the summary of one file."""
    print(description.summary(VelocityTable.open(table).dataset))


run(main)
