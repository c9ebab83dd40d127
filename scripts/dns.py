"""Dns stage: one geometry (sp, sf) at all Deborah numbers at which the study needs it.

python scripts/dns.py --configfile config/config.yaml --sp 1.5 --sf inf OUTPUT [TIMING]
"""

from pathlib import Path
from typing import Annotated

from viscotrain.config import stages
from viscotrain.config.names import geometry_name
from viscotrain.jobs import datasets
from viscotrain.jobs.command import announce
from viscotrain.jobs.entry import SF, SP, Job, Result, Timing, made, run
from viscotrain.jobs.progress import line
from viscotrain.studies.dns import solve_geometry

Fields = Annotated[Path | None, made("folder for VTU files of all points", named=True)]


def main(job: Job, sp: SP, sf: SF, result: Result, timing: Timing = None, fields: Fields = None):
    """Solve, write the dataset and, beside it, the CPU time."""
    solved, seconds = solve_geometry(job.settings, sp, sf, report=print, vtu_folder=fields)
    job.write(solved, result)
    datasets.write_csv(seconds, timing)
    announce(line(geometry_name(sp, sf), solved))


run(main, settings=stages.dns, solves=True)
