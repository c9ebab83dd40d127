r"""Transient stage: one geometry (sp, sf) at one Deborah number, from rest to after the start-up.

python scripts/transient.py --configfile config/config.yaml --sp 1.5 --sf 2.5 --deborah 5 \
    OUTPUT [TIMING]
"""

from viscotrain.config import stages
from viscotrain.config.names import point_name
from viscotrain.jobs import datasets
from viscotrain.jobs.command import announce
from viscotrain.jobs.entry import SF, SP, Deborah, Job, Result, Timing, run
from viscotrain.jobs.progress import line
from viscotrain.studies.transient import follow_triplet


def main(job: Job, sp: SP, sf: SF, deborah: Deborah, result: Result, timing: Timing = None):
    """Simulate, write the dataset and, beside it, the CPU time; a killed run goes on."""
    with job.checkpoint(result) as checkpoint:
        followed, seconds = follow_triplet(
            job.settings, sp, sf, deborah, report=print, checkpoint=checkpoint, code=job.code
        )
        job.write(followed, result)
        datasets.write_csv(seconds, timing)
    announce(line(point_name(sp, sf, deborah), followed))


run(main, settings=stages.transient, solves=True)
