"""What the scripts share: where they print, and how they end when something is wrong."""

import contextlib
import os
import signal
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

from viscotrain.errors import ViscotrainError
from viscotrain.files import in_words

INTERRUPTED = 128 + signal.SIGINT  # exit status, as shells count


def announce(text: str):
    """Print to a job's log, and also where Snakemake prints what it does.

    A job's process has the terminal of Snakemake as its standard error; only Python's names for
    it lead to the log while `reporting`.
    """
    print(text)
    if sys.__stderr__ is not None:
        print(text, file=sys.__stderr__, flush=True)


@contextlib.contextmanager
def reporting(log: str | Path | None = None) -> Iterator[None]:
    """Print to a log file, if there is one, and end with a message where viscotrain refuses.

    Faults of the disk and the machine, too, are a message and not a traceback.

    Args:
        log: File that takes what is printed, tracebacks included; None for the terminal.
    """
    try:
        with contextlib.ExitStack() as stack:
            if log:
                file = stack.enter_context(open(log, "w", encoding="utf-8", buffering=1))
                stack.enter_context(contextlib.redirect_stdout(file))
                stack.enter_context(contextlib.redirect_stderr(file))
                if number := os.environ.get("SLURM_JOB_ID"):
                    print(f"Slurm job {number}")  # by which `sacct` and the administrators know it
            try:
                yield
            except ViscotrainError as error:
                print(f"error: {error}", file=sys.stderr)
                sys.exit(1)
            except KeyboardInterrupt:
                print("interrupted", file=sys.stderr)
                sys.exit(INTERRUPTED)
            except OSError:
                raise
            except Exception:
                if log:
                    traceback.print_exc()
                raise
    except OSError as error:  # where a log cannot be written to either
        print(f"error: {in_words(error)}", file=sys.__stderr__)
        sys.exit(1)
