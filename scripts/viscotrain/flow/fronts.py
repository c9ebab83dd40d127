"""LU factorisation of a matrix that is a sum of matrices of elements, by dense fronts.

Multifrontal method (I. S. Duff & J. K. Reid, ACM Trans. Math. Softw. 9, 1983, 302) along a nested
dissection of the elements (A. George, SIAM J. Numer. Anal. 10, 1973, 345): the elements are halved
again and again; an unknown is eliminated in the smallest part that contains all its elements. With
the matrix of a part, the sum of those of its halves, in blocks of unknowns to eliminate (1) and to
keep (2),

    W = F11^-1 F12,    the part passes on    F22 - F21 W.

Unknowns inside of one element are eliminated first in the same way, for all elements at once. All
work is in products and LU factors of dense matrices, at ten times the rate of a sparse solver; no
matrix of the whole is stored, and there is no pattern to be analysed. Pivots are sought in F11
only. F11 can be singular where the matrix is not: a pressure has no entry of its own on the
diagonal, and in the corner of a part there may be no velocity to go with it. Then such unknowns are
eliminated one part later, in this matrix and all that follow.

The factors have the precision of the matrices. In single precision they take half the time and the
memory, which is good enough for an iteration that corrects their errors.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import get_lapack_funcs

from viscotrain.flow.dissection import Dissection, Part

SMALL = 40  # unknowns of a matrix that is inverted as a whole
LARGEST = 1e6  # entry of W with which pivots are large enough

Precision = type[np.float32] | type[np.float64]
Batches = Iterable[tuple[slice, NDArray]]


class SingularError(Exception):
    """A part of the matrix has no LU factors."""


class FrontalFactors:
    """LU factors of one matrix.

    Args:
        dissection: Of the elements.
        batches: Of which elements, and their matrices (elements, unknowns, unknowns).
        precision: Type of the matrices.

    Raises:
        SingularError: Some part has none.
    """

    def __init__(self, dissection: Dissection, batches: Batches, precision: Precision = np.float64):
        self._dissection, self._precision = dissection, precision
        self._factors: list = [None] * len(dissection.parts)
        outer = self._condense(batches)
        passed: list = [None] * len(dissection.parts)
        weak = self._factorise(outer, passed, LARGEST)
        while weak:
            kept = [dissection.unknowns[part.kept] for part in dissection.parts]
            if dissection.delay(weak, self._without_diagonal()):
                self._reorder(kept, passed)
                weak = self._factorise(outer, passed, LARGEST)
            elif self._factorise(outer, passed, np.inf):
                raise SingularError
            else:
                break

    def _without_diagonal(self) -> NDArray:
        """Mask of the unknowns whose own entry is zero, like that of a pressure."""
        numbers = self._dissection.outer_unknowns
        size = np.abs(self._diagonal[numbers >= 0])
        return np.bincount(numbers[numbers >= 0], size, self._dissection.size) == 0

    def _factorise(self, outer: NDArray, passed: list, largest: float) -> list[Part]:
        """Factorise the fronts that are not yet; returns the parts where the pivots are too small.

        Args:
            outer: Matrices of the elements.
            passed: What each part passes on, as far as it is needed; changed in place.
            largest: Entry of W with which pivots are large enough.
        """
        dissection, weak = self._dissection, []
        for n, part in enumerate(dissection.parts):
            if self._factors[n] is not None:
                continue
            if any(self._factors[half.place] is None for half in part.halves):
                continue
            found = self._eliminate(self._front(part, outer, passed), part.own.size, largest)
            if found is None:
                weak.append(part)
                continue
            self._factors[n], passed[n] = found
            for half in part.halves:
                passed[half.place] = None
        return weak

    def _front(self, part: Part, outer: NDArray, passed: list) -> NDArray:
        """The matrix of a part, of its elements or of what its halves pass on."""
        size = part.own.size + part.kept.size
        if part.halves:
            F = np.zeros((size, size), self._precision, order="F")
            for place, half in zip(part.places, part.halves, strict=True):
                _add(F, place, passed[half.place])
            return F
        members = outer[self._dissection.order[part.first : part.end]]
        mine = np.asarray(part.places)
        places = mine[:, :, None] + (size + 1) * mine[:, None, :]
        entries = np.bincount(places.ravel(), members.ravel(), (size + 1) ** 2)
        entries = entries.astype(self._precision, copy=False)
        return entries.reshape(size + 1, size + 1).T[:size, :size]

    @staticmethod
    def _eliminate(F: NDArray, own: int, largest: float) -> tuple[tuple, NDArray] | None:
        """Factors of a front and what is passed on; none if the pivots are too small."""
        if own == 0:
            return (), F
        getrf, getrs = get_lapack_funcs(("getrf", "getrs"), (F,))
        lu, pivots, failed = getrf(F[:own, :own])
        if failed:
            return None
        W, below = F[:own, own:], np.asfortranarray(F[own:, :own])
        if below.size:
            W, _ = getrs(lu, pivots, W)
            if np.abs(W).max() > largest:
                return None
        return (lu, pivots, W, below), F[own:, own:] - below @ W

    def _reorder(self, kept: list[NDArray], passed: list):
        """Bring what is known into the new order of the unknowns, after some were delayed.

        Args:
            kept: Unknowns that each part kept before, in their order.
            passed: What each part passes on.
        """
        for n, part in enumerate(self._dissection.parts):
            now = self._dissection.unknowns[part.kept]
            if self._factors[n] is None or np.array_equal(now, kept[n]):
                continue
            order = np.argsort(kept[n])[np.searchsorted(np.sort(kept[n]), now)]
            if self._factors[n]:
                lu, pivots, W, below = self._factors[n]
                self._factors[n] = lu, pivots, W[:, order], below[order]
            if passed[n] is not None:
                passed[n] = passed[n][np.ix_(order, order)]

    def _condense(self, batches: Batches) -> NDArray:
        """Eliminate inner unknowns of elements; returns the rest of the matrices."""
        dissection, precision = self._dissection, self._precision
        inner, outer = dissection.inner, dissection.outer
        m, n, count = (
            dissection.inner_count,
            dissection.outer_unknowns.shape[1],
            len(dissection.order),
        )
        result = np.empty((count, n, n), precision)
        self._diagonal = np.empty((count, n), precision)
        self._inverse = np.empty((count, m, m), precision)
        self._right = np.empty((count, m, n), precision)
        self._left = np.empty((count, n, m), precision)
        for members, matrices in batches:
            self._diagonal[members] = np.diagonal(matrices, axis1=1, axis2=2)[:, outer]
            coupling = matrices[:, inner][:, :, outer]
            try:
                inverse = _inverses(matrices[:, inner][:, :, inner])
            except np.linalg.LinAlgError as error:
                raise SingularError from error
            self._inverse[members] = inverse
            self._right[members] = inverse @ coupling
            self._left[members] = left = matrices[:, outer][:, :, inner] @ inverse
            np.matmul(left, coupling, out=result[members])
            np.subtract(matrices[:, outer][:, :, outer], result[members], out=result[members])
        return result

    @np.errstate(invalid="ignore", over="ignore")  # an iteration that diverges stops
    def solve(self, right: NDArray, transposed: bool = False) -> NDArray:
        """Solution for the free unknowns; the others are zero.

        Args:
            right: Right-hand side of all unknowns.
            transposed: Whether to solve with the transposed matrix.
        """
        dissection = self._dissection
        inverse, to_outer, from_outer = self._inverse, self._left, self._right
        if transposed:
            inverse, to_outer, from_outer = (
                np.swapaxes(each, 1, 2) for each in (inverse, from_outer, to_outer)
            )
        right = right.astype(self._precision)
        inner = right[dissection.inner_unknowns][:, :, None]
        b = np.append(right, self._precision(0))
        outer = dissection.outer_unknowns
        np.subtract.at(b, outer, (to_outer @ inner)[:, :, 0])
        x = b[dissection.unknowns]
        (self._sweep_transposed if transposed else self._sweep)(x)
        solution = np.zeros(right.size + 1, self._precision)
        solution[dissection.unknowns] = x
        found = inverse @ inner - from_outer @ solution[outer][:, :, None]
        solution[dissection.inner_unknowns] = found[:, :, 0]
        return solution[:-1]

    def _sweep(self, x: NDArray):
        """Solve in place, unknowns in the order of elimination."""
        pairs = [
            pair for pair in zip(self._dissection.parts, self._factors, strict=True) if pair[1]
        ]
        getrs = get_lapack_funcs("getrs", (x,))
        for part, (lu, pivots, _, below) in pairs:
            own = slice(part.own[0], part.own[-1] + 1)
            x[own], _ = getrs(lu, pivots, x[own])
            x[part.kept] -= below @ x[own]
        for part, (_, _, W, _) in reversed(pairs):
            x[part.own[0] : part.own[-1] + 1] -= W @ x[part.kept]

    def _sweep_transposed(self, x: NDArray):
        """The same with the transposed matrix."""
        pairs = [
            pair for pair in zip(self._dissection.parts, self._factors, strict=True) if pair[1]
        ]
        getrs = get_lapack_funcs("getrs", (x,))
        for part, (_, _, W, _) in pairs:
            x[part.kept] -= W.T @ x[part.own[0] : part.own[-1] + 1]
        for part, (lu, pivots, _, below) in reversed(pairs):
            own = slice(part.own[0], part.own[-1] + 1)
            x[own], _ = getrs(lu, pivots, x[own] - below.T @ x[part.kept], trans=1)


def _inverses(matrices: NDArray) -> NDArray:
    """Inverses of many matrices (n, m, m), by halves, so that most is in products.

    Raises:
        LinAlgError: One is singular, or a leading half of one.
    """
    m = matrices.shape[1]
    if m <= SMALL:
        return np.linalg.inv(matrices)
    a, b = slice(m // 2), slice(m // 2, m)
    A = _inverses(matrices[:, a, a])
    AB = A @ matrices[:, a, b]
    CA = matrices[:, b, a] @ A
    found = np.empty_like(matrices)
    found[:, b, b] = S = _inverses(matrices[:, b, b] - matrices[:, b, a] @ AB)
    found[:, a, b] = -AB @ S
    SCA = S @ CA
    found[:, b, a] = -SCA
    found[:, a, a] = A + AB @ SCA
    return found


def _add(F: NDArray, places: NDArray, matrix: NDArray):
    """Add a matrix to rows and columns, both ascending, of F: by runs of places without a gap."""
    ends = np.flatnonzero(np.diff(places) != 1) + 1
    firsts, ends = np.append(0, ends), np.append(ends, places.size)
    wide = np.zeros((F.shape[0], places.size), F.dtype, order="F")
    for first, end in zip(firsts, ends, strict=True):
        wide[places[first] : places[first] + end - first] = matrix[first:end]
    for first, end in zip(firsts, ends, strict=True):
        F[:, places[first] : places[first] + end - first] += wide[:, first:end]
