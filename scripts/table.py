"""Table stage: results of all geometries -> velocity table, with its interpolation error.

python scripts/table.py --configfile config/config.yaml OUTPUT DNS_FILE...
"""

from viscotrain.config import stages
from viscotrain.jobs import agreement, datasets
from viscotrain.jobs.entry import Job, Result, Simulated, run
from viscotrain.table import description, present
from viscotrain.table.check import combine_and_check


def main(job: Job, table: Result, results: Simulated):
    """Combine the files of the grid's geometries; those off the grid check the interpolation."""
    parts = {str(path): datasets.read(path) for path in results}
    simulations = agreement.refuse_strangers(parts)
    at_end = [present.at_end(part) for part in parts.values()]
    velocities = combine_and_check(at_end, **dict(job.settings))
    job.write(velocities.assign_attrs(simulations), table, "velocity table")
    print(description.summary(velocities))


run(main, settings=stages.table)
