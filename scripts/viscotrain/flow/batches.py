"""Residual, linearisation and LU factors of costly integrals, for all elements at once.

Ngsolve linearises an integrand by evaluating it once per pair of a trial and a test quantity, which
for the constitutive equations took half of the time of a solution. Here the integrand F, linear in
the test quantities t (values and derivatives of test functions), is evaluated with its derivatives
by the trial quantities s (`jets`) in one pass over arrays,

    residual   R_a  = sum_q w |J| sum_t  dF/dt     B_ta(q),
    matrix     K_ab = sum_q w |J| sum_ts d2F/dt ds B_ta(q) B_sb(q),

with B the shape functions and their derivatives, q the points and w the weights of the rule that
ngsolve uses. In coordinates of the reference triangle B is the same for all elements of a kind,
that is, with the same sense of their edges; so the sums are one product of matrices for each pair
of components and each kind. The results are those of ngsolve up to round-off. The matrix is never
put together: matrices of elements are what is factorised (`fronts`), by themselves in
single precision, in which a solution has errors that an iteration corrects (`newton`).
"""

from collections.abc import Callable, Iterator

import ngsolve
import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from viscotrain.flow.dissection import Dissection
from viscotrain.flow.elements import BATCH, Elements
from viscotrain.flow.fronts import FrontalFactors, Precision
from viscotrain.flow.jets import Jet

Integrals = Callable[[list, list, Callable], list]


class BatchedForm:
    """A nonlinear form, with the interface of `ngsolve.BilinearForm` as far as it is used.

    Args:
        space: Product of scalar spaces on triangles, each in H1 or one number.
        integrals: Integrands over the domain, of the trial and the test functions of the
            components, as jets; the third argument makes values of a vector of the space.
        rest: Integrals over boundaries, linear, in a form on the same space.
    """

    def __init__(self, space: ngsolve.FESpace, integrals: Integrals, rest: ngsolve.BilinearForm):
        self.space = space
        self._integrals, self._rest = integrals, rest
        self._made: Elements | None = None
        self._blocks: dict[tuple[int, int], tuple] = {}  # the latest linearisation, by components
        self._rest_in_elements: tuple | None = None
        self._dissections: dict[str, Dissection] = {}

    @property
    def _elements(self) -> "Elements":
        """Made when first used: forms are made for counting unknowns, too."""
        if self._made is None:
            self._made = Elements(self.space)
        return self._made

    def Apply(self, state: ngsolve.BaseVector, residual: ngsolve.BaseVector):
        """Residual at a state."""
        self._rest.Apply(state, residual)
        values, elements = residual.FV().NumPy(), self._elements
        with np.errstate(invalid="ignore", over="ignore"):  # an iteration that diverges stops
            for i, fluxes in self._terms(state, slopes=False).items():
                unknowns = elements.of_components[i]
                exists = unknowns >= 0
                shares = elements.tested(i, fluxes)[exists]
                values += np.bincount(unknowns[exists], shares, values.size)

    def AssembleLinearization(self, state: ngsolve.BaseVector):
        """Evaluate the linearisation at a state."""
        elements = self._elements
        self._blocks = {}
        with np.errstate(invalid="ignore", over="ignore"):  # an iteration that diverges stops
            for i, fluxes in self._terms(state, slopes=True).items():
                slopes: dict[int, dict] = {}
                for t, flux in enumerate(fluxes):
                    for (j, s), slope in flux.slopes.items() if isinstance(flux, Jet) else ():
                        slopes.setdefault(j, {})[t, s] = slope
                for j, own in slopes.items():
                    self._blocks[i, j] = elements.referred(own)
        self._rest.AssembleLinearization(state)

    def _matrices(self, precision: Precision = np.float64) -> Iterator[tuple[slice, NDArray]]:
        """Elements and their matrices (elements, unknowns, unknowns), overwritten by the next."""
        elements = self._elements
        used, (owners, rows, columns) = self._places_of_rest()
        values = np.asarray(self._rest.mat.CSR()[0])[used]
        size = elements.unknowns.shape[1]
        space = np.empty((BATCH, size, size), precision)
        for kind, members in elements.batches():
            matrices = space[: members.stop - members.start]
            matrices[:] = 0.0
            for (i, j), (names, slopes) in self._blocks.items():
                elements.add_block(matrices, kind, members, (i, j), names, slopes[members])
            own = (owners >= members.start) & (owners < members.stop)
            place = owners[own] - members.start, rows[own], columns[own]
            matrices[place] += values[own]  # no place twice
            yield members, matrices

    def _places_of_rest(self) -> tuple[NDArray, tuple]:
        """Entries of the rest that are not zero, and their places in matrices of elements."""
        if self._rest_in_elements is None:
            values, columns, firsts = (np.asarray(part) for part in self._rest.mat.CSR())
            ends = firsts.astype(np.int64)
            rows = np.repeat(np.arange(len(ends) - 1), ends[1:] - ends[:-1])
            used = np.flatnonzero(values)
            places = self._elements.places(rows[used], columns[used].astype(np.int64))
            self._rest_in_elements = used, places
        return self._rest_in_elements

    def _terms(self, state: ngsolve.BaseVector, slopes: bool) -> dict[int, list]:
        """By component of the test functions: coefficients of its value and derivatives."""
        elements = self._elements
        elements.update()
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            trial = elements.quantities(state, slopes)
            test = elements.test_quantities()
            found: dict[tuple[int, int], object] = {}
            for integrand in self._integrals(trial, test, elements.quantities):
                for name, term in integrand.terms.items():
                    found[name] = found[name] + term if name in found else term
        terms: dict[int, list] = {}
        for (i, t), term in found.items():
            terms.setdefault(i, [0.0, 0.0, 0.0])[t] = term
        return terms

    def matrix(self) -> scipy.sparse.csr_matrix:
        """The latest linearisation as one matrix."""
        shape = self.space.ndof, self.space.ndof
        total = scipy.sparse.csr_matrix(shape)
        for members, matrices in self._matrices():
            numbers = self._elements.unknowns[members]
            rows, columns = np.broadcast_arrays(numbers[:, :, None], numbers[:, None, :])
            there = (rows >= 0) & (columns >= 0)
            entries = matrices[there], (rows[there], columns[there])
            total += scipy.sparse.csr_matrix(entries, shape)
        return total

    def factorise(self, free: ngsolve.BitArray, precision: Precision) -> "VectorFactors":
        """LU factors of the latest linearisation.

        Args:
            free: Unknowns to solve for.
            precision: Type of the numbers in the factors.

        Raises:
            fronts.SingularError: There are none.
        """
        key = str(free)
        if key not in self._dissections:
            mask, elements = np.fromiter(free, bool, len(free)), self._elements
            self._dissections[key] = Dissection(elements.unknowns, mask, elements.centres())
        matrices = self._matrices(precision)
        return VectorFactors(FrontalFactors(self._dissections[key], matrices, precision))


class VectorFactors:
    """LU factors, for vectors of ngsolve.

    Args:
        factors: For arrays.
    """

    def __init__(self, factors: FrontalFactors):
        self._factors = factors

    def solve(self, right: ngsolve.BaseVector, solution: ngsolve.BaseVector):
        """Solve A x = b for the free unknowns; the others become zero."""
        solution.FV().NumPy()[:] = self._factors.solve(right.FV().NumPy())

    def solve_transposed(self, right: ngsolve.BaseVector, solution: ngsolve.BaseVector):
        """Solve A' x = b, as adjoint problems need it."""
        solution.FV().NumPy()[:] = self._factors.solve(right.FV().NumPy(), transposed=True)
