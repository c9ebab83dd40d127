"""How a process that solves uses its machine: one thread, and memory that it keeps."""

import ctypes
import sys

from ngsolve import SetNumThreads

# Parameters of mallopt, from malloc.h of the GNU C library
M_TRIM_THRESHOLD, M_MMAP_MAX = -1, -4


def use_one_core():
    """Solve on one thread and keep freed memory for the next factorisation.

    Each factorisation takes and frees hundreds of MB. Given back to the system, every page of it
    has to be filled with zeros again, which took a tenth of the CPU time.
    """
    SetNumThreads(1)
    library = ctypes.CDLL(None) if sys.platform == "linux" else None
    if library is not None and hasattr(library, "mallopt"):
        library.mallopt(M_MMAP_MAX, 0)
        library.mallopt(M_TRIM_THRESHOLD, 2**31 - 1)
