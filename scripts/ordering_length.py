"""Print whether a train of one spacing orders, and along which length of channel.

python scripts/ordering_length.py results/demo/table/velocity_table.nc --deborah 5 --spacing 3
"""

from typing import Annotated

from viscotrain.jobs.entry import Deborah, Job, Table, option, run
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import order

Spacing = Annotated[float, option("distance of neighbours, centre to centre, in d")]


def main(job: Job, table: Table, deborah: Deborah, spacing: Spacing):
    """Analyse one train."""
    velocities = VelocityTable.open(table)
    print(order.of_one_train(velocities, deborah, spacing))


run(main)
