"""Verification stage: all comparisons and studies -> figures and a statement of accuracy.

With the verification folder of a study that has been verified:

python scripts/verification_report.py --table TABLE FOLDER
"""

from pathlib import Path

from viscotrain.drawing import verification_figures as figures
from viscotrain.jobs import drawings
from viscotrain.jobs.entry import Job, folder_of, made, run, taken
from viscotrain.studies.findings import Findings
from viscotrain.table.interpolation import VelocityTable

PATTERNS = {  # of the files by their rules
    "start_up": "start_up/*.nc",
    "closure_train": "closure/train_*.nc",
    "closure_gap": "closure/gap*.csv",
    "convergence": "convergence/*.csv",
}


def main(job: Job, table, folder: Path, start_up, closure_train, closure_gap, convergence):
    """Draw every figure that there is data for and write `accuracy.md`."""
    files = [start_up, closure_train, closure_gap, convergence]
    if job.by_hand:
        files = [sorted(folder.glob(pattern)) for pattern in PATTERNS.values()]
    velocities = VelocityTable.open(table)
    found = Findings.read(velocities, *files)
    for kind, rows in found.studies.items():
        drawings.save(figures.convergence(rows, kind), folder / kind)
    if found.start_ups:
        drawings.save(figures.start_up(found.start_ups), folder / "start_up")
    if found.trains:
        drawings.save(figures.closure(found.trains, found.spacing), folder / "closure")
    text = found.accuracy(velocities.dataset)
    (folder / "accuracy.md").write_text(text, encoding="utf-8")
    print(text)


run(
    main,
    [
        taken("table", "velocity table", flag="--table"),
        made("folder", "results/<study>/verification", key="accuracy", convert=folder_of),
        *(
            taken(
                name,
                f"files {pattern}; all in the folder",
                flag=f"--{name}",
                many=True,
                optional=True,
            )
            for name, pattern in PATTERNS.items()
        ),
    ],
)
