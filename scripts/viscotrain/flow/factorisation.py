"""LU factors of a linearised form, with solutions of the system and of the transposed one.

The flow is a `BatchedForm`, which has no matrix and factorises by `fronts`. Any other form of
ngsolve is factorised by its UMFPACK (T. A. Davis, ACM Trans. Math. Softw. 30, 2004, 196).
"""

import ngsolve
import numpy as np
from netgen.libngpy._meshing import NgException

from viscotrain.errors import ViscotrainError
from viscotrain.flow.batches import BatchedForm, VectorFactors
from viscotrain.flow.fronts import Precision, SingularError


class FactorisationError(ViscotrainError):
    """The matrix is singular or too large."""


class NgsolveFactors:
    """LU factors of a matrix of ngsolve.

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


def factorise(
    form: ngsolve.BilinearForm | BatchedForm,
    free: ngsolve.BitArray,
    precision: Precision = np.float64,
) -> NgsolveFactors | VectorFactors:
    """LU factors of the present matrix of a form.

    Args:
        form: Linearised.
        free: Unknowns to solve for.
        precision: Of the factors of a `BatchedForm`; others have double precision.

    Raises:
        FactorisationError: It is singular or too large.
    """
    if not isinstance(form, BatchedForm):
        return NgsolveFactors(form.mat, free)
    try:
        return form.factorise(free, precision)
    except SingularError as error:
        raise FactorisationError("singular matrix") from error
