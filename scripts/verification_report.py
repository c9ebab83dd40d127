r"""Verification stage: all comparisons and studies -> figures and a statement of accuracy.

By hand, of what the stage has made:

python scripts/verification_report.py FOLDER --table TABLE --start-up NC... \
    --closure-train NC... --closure-gap CSV... --convergence CSV...
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from viscotrain import files
from viscotrain.drawing import verification_figures as figures
from viscotrain.jobs import drawings
from viscotrain.jobs.entry import Job, folder_for, run, taken
from viscotrain.studies.findings import Findings
from viscotrain.table.interpolation import VelocityTable


def main(
    job: Job,
    table: Annotated[Path, taken("velocity table", named=True)],
    folder: Annotated[Path, folder_for("accuracy")],
    start_up: Annotated[Sequence[Path], taken("of start_up.py", named=True)] = (),
    closure_train: Annotated[Sequence[Path], taken("of closure_train.py", named=True)] = (),
    closure_gap: Annotated[Sequence[Path], taken("of closure_gap.py", named=True)] = (),
    convergence: Annotated[Sequence[Path], taken("of convergence.py", named=True)] = (),
):
    """Draw every figure that there is data for and write `accuracy.md`."""
    velocities = VelocityTable.open(table)
    found = Findings.read(velocities, start_up, closure_train, closure_gap, convergence)
    for name, drawing in figures.all_of(found):
        drawings.save(drawing, folder / name)
    text = found.accuracy(velocities.dataset)
    files.write_text(text, folder / "accuracy.md")
    print(text)


run(main)
