r"""Table stage: results of all geometries -> velocity table, with its errors and size response.

python scripts/table.py --configfile config/config.yaml OUTPUT DNS_FILE... \
    [--spheres DNS_FILE...]
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.jobs import agreement, datasets
from viscotrain.jobs.entry import Job, Result, Simulated, run, taken
from viscotrain.table import description, present
from viscotrain.table.check import combine_and_check
from viscotrain.table.size_response import with_size_response

Spheres = Annotated[
    Sequence[Path], taken("files of dns.py of single spheres of other diameters", named=True)
]


def main(job: Job, table: Result, results: Simulated, spheres: Spheres = ()):
    """Combine the files of the grid's geometries; those off the grid check the interpolation."""
    parts = {str(path): datasets.read(path) for path in results}
    simulations = agreement.refuse_strangers(parts)
    at_end = [present.at_end(part) for part in parts.values()]
    velocities = combine_and_check(at_end, **dict(job.settings))
    velocities = velocities.assign_attrs(simulations)
    if spheres:
        singles = {str(path): datasets.read(path) for path in spheres}
        code = agreement.refuse_other_spheres(velocities, singles)
        velocities = with_size_response(velocities, list(singles.values())).assign_attrs(code)
    job.write(velocities, table, "velocity table")
    print(description.summary(velocities))


run(main, settings=stages.table)
