"""Dns stage: one geometry (sp, sf) at all Deborah numbers at which the study needs it.

python scripts/dns.py --configfile config/config.yaml --sp 1.5 --sf inf OUTPUT [TIMING]
"""

from pathlib import Path

from viscotrain.config import stages
from viscotrain.config.names import geometry_name
from viscotrain.jobs import datasets, progress
from viscotrain.jobs.entry import DISTANCES, Job, made, run
from viscotrain.studies.dns import solve_geometry


def main(job: Job, sp: float, sf: float, result: Path, timing: Path | None, fields: Path | None):
    """Solve, write the dataset and, beside it, the CPU time."""
    solved, seconds = solve_geometry(job.settings, sp, sf, report=print, vtu_folder=fields)
    job.write(solved, result)
    datasets.write_csv(seconds, timing)
    progress.announce_line(job.whole_study(), geometry_name(sp, sf), solved, result)


run(
    main,
    solves=True,
    settings=stages.dns,
    arguments=[
        *DISTANCES,
        made("result", "netCDF file to write"),
        made("timing", "CSV file for CPU times", optional=True),
        made("fields", "folder for VTU files of all points", flag="--fields", optional=True),
    ],
)
