"""One run at a time in a folder of results, by a lock that ends with the process that holds it.

Snakemake's own lock is a file that a killed run leaves behind, for its user to find out about; this
one the operating system takes back. It holds on one machine, and on network disks that lock files.
"""

import contextlib
from pathlib import Path

from viscotrain.errors import RunError
from viscotrain.files import in_words

LOCK = ".running"
_held: list = []  # files of this process: closed, they would lock no more


def hold(folder: str | Path) -> None:
    """Take the folder for this process, until it ends.

    Raises:
        RunError: Another run has it.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        return
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        file = (Path(folder) / LOCK).open("a")
    except OSError as error:
        raise RunError(f"{folder} cannot be written to: {in_words(error)}") from error
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise RunError(f"another run works in {folder}: wait for its end, or stop it") from None
    except OSError:  # the disk knows no locks
        with contextlib.suppress(OSError):
            file.close()
        return
    _held.append(file)
