r"""Print whether a train of one spacing orders, and along which length of channel.

python scripts/ordering_length.py results/demo/table/velocity_table.nc --deborah 5 --spacing 3 \
    [--diameter-variation 0.02 --length 800]
"""

from typing import Annotated

from viscotrain.jobs.entry import Deborah, Job, Table, option, positive, run
from viscotrain.table.interpolation import VelocityTable
from viscotrain.trains import order, tolerance
from viscotrain.words import ORDERED_VARIATION

Spacing = Annotated[float, option("distance of neighbours, centre to centre, in d")]


Variation = Annotated[float, option("coefficient of variation of the spheres' diameters")]
Length = Annotated[
    float, option("of the channel, in D, over which diameters count", convert=positive)
]


def main(
    job: Job,
    table: Table,
    deborah: Deborah,
    spacing: Spacing,
    diameter_variation: Variation = 0.0,
    length: Length = 800.0,
):
    """Analyse one train."""
    velocities = VelocityTable.open(table)
    print(order.of_one_train(velocities, deborah, spacing))
    if diameter_variation > 0:
        wanted = tolerance.Wanted("every_sphere", "even", length, ORDERED_VARIATION)
        print(tolerance.of_one_train(velocities, deborah, spacing, diameter_variation, wanted))


run(main)
