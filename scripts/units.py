"""Units stage: what one of each dimensionless number of a study is in physical units.

python scripts/units.py --configfile config/config.yaml OUTPUT
"""

from viscotrain.config import stages
from viscotrain.fluid.units import physical_units
from viscotrain.jobs.entry import Job, Result, run


def main(job: Job, result: Result):
    """Write the factors at all Deborah numbers."""
    own = job.settings
    units = physical_units(
        own.known_fluid,
        own.longest_modes(),
        channel_diameter=own.channel_diameter,
        particle_diameter=own.particle_diameter,
        section=own.section,
    )
    job.write(units, result, "physical units")


run(main, settings=stages.units)
