"""Reading and writing files so that a fault is one line of text and leaves nothing half-written.

A file is written beside its place, brought to the disk, and renamed: under its own name there is
either nothing, or what was there before, or all of it. What a run reads of its own results may be
damaged; making it again is what helps.
"""

import contextlib
import errno
import glob
import os
from collections.abc import Collection, Iterator
from pathlib import Path

import pandas as pd
import xarray as xr

from viscotrain.errors import FileError

MADE_HERE = "code_digest"  # an attribute of every dataset that a job writes
AGAIN = "delete it and run again"
WAYS_OUT = {
    errno.ENOSPC: "free some space and run again; what was finished is kept",
    errno.EDQUOT: "free some of your quota and run again; what was finished is kept",
    errno.EROFS: "run in a folder that can be written to (--directory)",
    errno.EACCES: "run in a folder that you may write to (--directory)",
    errno.EPERM: "run in a folder that you may write to (--directory)",
    errno.EMFILE: "allow more open files (ulimit -n), or run fewer jobs at once (--cores)",
    errno.ENFILE: "allow more open files on this machine, or run fewer jobs at once (--cores)",
}
SMALLEST_FREE = 1 << 20  # bytes on a disk that is not full


@contextlib.contextmanager
def whole(path: str | Path) -> Iterator[Path]:
    """A name to write to, of the same ending, that takes the place of a file when it is complete.

    Args:
        path: Of the file; its folder is made if needed.

    Raises:
        FileError: It cannot be written.
    """
    path = Path(path)
    part = path.with_name(f".{os.getpid()}.part.{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        for left in path.parent.glob(f".*.part.{glob.escape(path.name)}"):
            left.unlink(missing_ok=True)  # by a process that was killed
        yield part
        with part.open("rb") as written:
            os.fsync(written.fileno())
        part.replace(path)
    except OSError as error:
        raise FileError(f"{path} cannot be written: {_in_words(error)}") from error
    except RuntimeError as error:  # of the netCDF library, whatever happened to the disk
        if not _is_full(path.parent):
            raise
        full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        raise FileError(f"{path} cannot be written: {_in_words(full)}") from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def _is_full(folder: Path) -> bool:
    disk = os.statvfs(folder)
    return disk.f_bavail * disk.f_frsize < SMALLEST_FREE


def in_words(error: OSError) -> str:
    """What happened to which file, and what to do about it if that is known."""
    named = f"{error.filename}: " if error.filename else ""
    return named + _in_words(error)


def _in_words(error: OSError) -> str:
    code = error.errno
    if code is None:
        return str(error)
    helps = WAYS_OUT.get(code)
    return os.strerror(code) + (f"; {helps}" if helps else "")


def write_text(text: str, path: str | Path) -> None:
    """Write a text file."""
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")


def read_dataset(path: str | Path, own: bool = True) -> xr.Dataset:
    """A netCDF file with all its values.

    Args:
        path: Of the file.
        own: Whether it must be one that a job has written.

    Raises:
        FileError: It is no such file, or cannot be read.
    """
    try:
        found = xr.load_dataset(path, engine="netcdf4")
    except FileNotFoundError as error:
        raise FileError(f"{path} does not exist") from error
    except OSError as error:
        if error.errno in WAYS_OUT:
            raise FileError(f"{path} cannot be read: {_in_words(error)}") from error
        raise FileError(f"{path} is damaged, or no netCDF file: {AGAIN}") from error
    except (RuntimeError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise FileError(f"{path} is damaged: {AGAIN}") from error
    if own and MADE_HERE not in found.attrs:
        raise FileError(f"{path} is not a file of viscotrain: {AGAIN}")
    return found


def read_csv(path: str | Path, columns: Collection[str] = ()) -> pd.DataFrame:
    """A CSV file that a job has written, with these columns and numbers in them.

    Raises:
        FileError: It is no such file.
    """
    try:
        found = pd.read_csv(path)
        found[list(columns)].astype(float)
    except FileNotFoundError as error:
        raise FileError(f"{path} does not exist") from error
    except (OSError, ValueError, KeyError) as error:  # pandas' own errors are of ValueError
        raise FileError(f"{path} is damaged: {AGAIN}") from error
    return found
