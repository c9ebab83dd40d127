"""LU factorisation of the linearised flow, with the ordering computed once per form.

UMFPACK (T. A. Davis, ACM Trans. Math. Softw. 30, 2004, 196) factorises in two stages: an analysis
of the pattern, which orders the unknowns, and the numerical factorisation. `mat.Inverse` of ngsolve
repeats the first with each matrix, a quarter of the cost, and refines each solution twice, four
fifths of the cost of a solution, which Newton's method does not need. The wheel of ngsolve exports
the C interface of its UMFPACK; here it is called directly. Where it is not found `mat.Inverse`
serves instead.

A `BatchedForm` has no matrix and factorises by `fronts`, in half of the time of UMFPACK and with
nothing to analyse. UMFPACK serves all other forms.

Ngsolve stores rows, UMFPACK columns: what is factorised is the transposed matrix, and A x = b is
solved as the transposed system of it.

Settings: the defaults, measured on matrices of 24,000 and 54,000 unknowns. Entries that are zero
stay in the pattern: without them it is not symmetric, and the factors are 4 times as large. The
symmetric strategy, which is what UMFPACK chooses for this pattern, has a third of the fill of the
unsymmetric one; without scaling of the rows the fill explodes. METIS instead of AMD, other sizes of
blocks, pivots or fronts: no gain.
"""

import ctypes
import weakref
from pathlib import Path

import netgen
import ngsolve
import numpy as np
from netgen.libngpy._meshing import NgException

from viscotrain.batches import BatchedForm, VectorFactors
from viscotrain.fronts import SingularError

# Constants of umfpack.h
CONTROL_SIZE, INFO_SIZE = 20, 90
STRATEGY, REFINEMENTS = 5, 7  # positions in Control
SYMMETRIC = 3
PLAIN, TRANSPOSED = 0, 1  # systems A x = b and A' x = b
ERRORS = {1: "singular matrix", -1: "out of memory"}

WORD = ctypes.c_int64


class FactorisationError(Exception):
    """The matrix is singular or too large."""


class Analysis:
    """Ordering of the free unknowns of a form, for all its matrices.

    Args:
        matrix: One of them.
        free: Unknowns to solve for.
    """

    def __init__(self, matrix: ngsolve.BaseMatrix, free: ngsolve.BitArray):
        self._free = np.fromiter(free, bool, len(free))
        _, columns, firsts = (np.asarray(part) for part in matrix.CSR())
        self._entries = columns.size
        lengths = np.diff(firsts.astype(np.int64))
        self._kept = np.repeat(self._free, lengths) & self._free[columns]
        rows = np.repeat(np.arange(self._free.size), lengths)[self._kept]
        count = int(self._free.sum())
        numbers = np.cumsum(self._free) - 1
        self._firsts = np.zeros(count + 1, dtype=np.int64)
        np.cumsum(np.bincount(numbers[rows], minlength=count), out=self._firsts[1:])
        self._columns = numbers[columns[self._kept]].astype(np.int64)
        self._symbolic = ctypes.c_void_p()
        values = self.values(matrix)
        size, symbolic = WORD(count), ctypes.byref(self._symbolic)
        pattern = _pointer(self._firsts), _pointer(self._columns), _pointer(values)
        _check(_LIBRARY.umfpack_dl_symbolic(size, size, *pattern, symbolic, *_settings()))
        weakref.finalize(self, _LIBRARY.umfpack_dl_free_symbolic, ctypes.byref(self._symbolic))

    def fits(self, matrix: ngsolve.BaseMatrix) -> bool:
        """Whether the matrix can have this pattern."""
        return len(matrix.CSR()[1]) == self._entries and matrix.height == self._free.size

    def values(self, matrix: ngsolve.BaseMatrix) -> np.ndarray:
        """Entries in rows and columns of free unknowns."""
        return np.asarray(matrix.CSR()[0])[self._kept]

    def factorise(self, matrix: ngsolve.BaseMatrix) -> "Factors":
        """LU factors of a matrix of this pattern.

        Raises:
            FactorisationError: It is singular or too large.
        """
        numeric, values = ctypes.c_void_p(), self.values(matrix)
        pattern = _pointer(self._firsts), _pointer(self._columns), _pointer(values)
        status = _LIBRARY.umfpack_dl_numeric(
            *pattern, self._symbolic, ctypes.byref(numeric), *_settings()
        )
        factors = Factors(numeric, self._free)  # even of a singular matrix: frees what was made
        _check(status)
        return factors


class Factors:
    """LU factors of one matrix, for as many right-hand sides as needed.

    Args:
        numeric: What UMFPACK returned.
        free: Mask of the unknowns in it.
    """

    def __init__(self, numeric: ctypes.c_void_p, free: np.ndarray):
        self._numeric, self._free = numeric, free
        weakref.finalize(self, _LIBRARY.umfpack_dl_free_numeric, ctypes.byref(numeric))

    def solve(self, right: ngsolve.BaseVector, solution: ngsolve.BaseVector):
        """Solve A x = b for the free unknowns; the others become zero."""
        self._solve(TRANSPOSED, right, solution)  # the factors are those of the transposed matrix

    def solve_transposed(self, right: ngsolve.BaseVector, solution: ngsolve.BaseVector):
        """Solve A' x = b, as adjoint problems need it."""
        self._solve(PLAIN, right, solution)

    def _solve(self, system: int, right: ngsolve.BaseVector, solution: ngsolve.BaseVector):
        b = right.FV().NumPy()[self._free]
        x = np.empty_like(b)
        no_matrix = (None, None, None)  # of use for refinement only
        _check(
            _LIBRARY.umfpack_dl_solve(
                WORD(system), *no_matrix, _pointer(x), _pointer(b), self._numeric, *_settings()
            )
        )
        values = solution.FV().NumPy()
        values[:] = 0.0
        values[self._free] = x


class NgsolveFactors:
    """The same by ngsolve's own interface.

    Args:
        matrix: To be factorised.
        free: Unknowns to solve for.

    Raises:
        FactorisationError: It is singular or too large.
    """

    def __init__(self, matrix: ngsolve.BaseMatrix, free: ngsolve.BitArray):
        try:
            self._inverse = matrix.Inverse(free, inverse="umfpack")
        except NgException as error:
            raise FactorisationError(str(error)) from error

    def solve(self, right: ngsolve.BaseVector, solution: ngsolve.BaseVector):
        """Solve A x = b for the free unknowns; the others become zero."""
        solution.data = self._inverse * right

    def solve_transposed(self, right: ngsolve.BaseVector, solution: ngsolve.BaseVector):
        """Solve A' x = b, as adjoint problems need it."""
        solution.data = self._inverse.T * right


_analyses: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()  # by form, then by free set


def factorise(
    form: ngsolve.BilinearForm | BatchedForm, free: ngsolve.BitArray
) -> Factors | NgsolveFactors | VectorFactors:
    """LU factors of the present matrix of a form; its pattern is analysed the first time only.

    Args:
        form: With an assembled matrix.
        free: Unknowns to solve for.

    Raises:
        FactorisationError: It is singular or too large.
    """
    if isinstance(form, BatchedForm):
        try:
            return form.factorise(free)
        except SingularError as error:
            raise FactorisationError("singular matrix") from error
    if _LIBRARY is None:
        return NgsolveFactors(form.mat, free)
    analyses = _analyses.setdefault(form, {})
    key = str(free)
    if key not in analyses or not analyses[key].fits(form.mat):
        analyses[key] = Analysis(form.mat, free)
    return analyses[key].factorise(form.mat)


def _find_library() -> ctypes.CDLL | None:
    """The library of ngsolve that contains UMFPACK; None if it is not found."""
    package = Path(netgen.__file__).parent
    for folder in (package.parent / "netgen_mesher.libs", package):
        for path in sorted(folder.glob("*ngla*")):
            try:
                library = ctypes.CDLL(str(path))
            except OSError:
                continue
            if hasattr(library, "umfpack_dl_symbolic"):
                return library
    return None


def _settings() -> tuple:
    """Control and Info."""
    control, info = (ctypes.c_double * CONTROL_SIZE)(), (ctypes.c_double * INFO_SIZE)()
    _LIBRARY.umfpack_dl_defaults(control)
    control[STRATEGY], control[REFINEMENTS] = SYMMETRIC, 0
    return control, info


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def _check(status: int):
    if status != 0:
        raise FactorisationError(ERRORS.get(status, f"status {status} of UMFPACK"))


_LIBRARY = _find_library()
