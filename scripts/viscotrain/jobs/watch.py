"""The workflow's eye on its simulations: a warning as soon as the table has too many holes.

Jobs know the settings of their stage only; the workflow knows the study, and hears of every job
that ends. It imports what opens datasets then, not when its rules are read.
"""

import logging
import sys
from pathlib import Path
from typing import Any

from viscotrain.config.study import Study


class HolesWatch(logging.Handler):
    """Counts holes whenever a job has finished; a handler for the logger of Snakemake.

    Args:
        study: The config.
        folder: Of its results.
    """

    def __init__(self, study: Study, folder: str | Path):
        super().__init__()
        self._study, self._folder = study, Path(folder)
        self._simulations: Any = None
        self._warned_of = study.table.max_holes

    def emit(self, record: logging.LogRecord):
        """Warn if there are more holes than are allowed, and more than were warned of."""
        if str(getattr(record, "event", "")) != "job_finished":
            return
        from viscotrain.jobs import progress

        if self._simulations is None:
            self._simulations = progress.Simulations(self._study, self._folder)
        missing = progress.holes(self._study, self._simulations.outcomes())
        if missing > self._warned_of:
            self._warned_of = missing
            print(
                f"warning: the table has {missing} holes by now; allowed: "
                f"{self._study.table.max_holes} (table.max_holes). The table step will refuse them",
                file=sys.stderr,
                flush=True,
            )
