"""Channel flow stage: velocity, pressure gradient and shear rate at the wall, without spheres.

python scripts/channel_flow.py --configfile config/config.yaml OUTPUT
"""

from viscotrain.config import stages
from viscotrain.jobs.entry import Job, Result, run
from viscotrain.studies import channel_flow


def main(job: Job, result: Result):
    """Solve the flow at all Deborah numbers and write it."""
    own = job.settings
    numbers = dict(zip(own.deborah, own.longest_modes, strict=True))
    found = channel_flow.channel_flow(own.known_fluid, numbers, own.section)
    job.write(found, result, "flow without spheres")
    print(channel_flow.summary(found))


run(main, settings=stages.channel_flow, solves=True)
