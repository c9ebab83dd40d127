r"""Transient stage: one geometry (sp, sf) at one Deborah number, from rest to after the start-up.

python scripts/transient.py --configfile config/config.yaml --sp 1.5 --sf 2.5 --deborah 5 \
    OUTPUT [TIMING]
"""

from pathlib import Path

from viscotrain.config import stages
from viscotrain.config.names import point_name
from viscotrain.jobs import datasets, progress
from viscotrain.jobs.entry import DEBORAH, DISTANCES, Job, made, run
from viscotrain.studies.transient import follow_triplet


def main(job: Job, sp: float, sf: float, deborah: float, result: Path, timing: Path | None):
    """Simulate, write the dataset and, beside it, the CPU time; a killed run goes on."""
    with job.checkpoint(result) as checkpoint:
        followed, seconds = follow_triplet(
            job.settings, sp, sf, deborah, report=print, checkpoint=checkpoint, code=job.code
        )
        job.write(followed, result)
        datasets.write_csv(seconds, timing)
    progress.announce_line(job.whole_study(), point_name(sp, sf, deborah), followed, result)


run(
    main,
    solves=True,
    settings=stages.transient,
    arguments=[
        *DISTANCES,
        DEBORAH,
        made("result", "netCDF file to write"),
        made("timing", "CSV file for CPU times", optional=True),
    ],
)
