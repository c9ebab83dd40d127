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
"""

from collections.abc import Iterable
from copy import deepcopy
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

LEAF = 6  # elements of a part that is not halved
BALANCE = 0.3  # each half has so many of the elements, at least
DIRECTIONS = ((1.0, 0.0), (0.0, 1.0), (0.7, 0.7), (0.7, -0.7))  # in which parts are cut
SEED = 0  # of random numbers by which sets of elements are told apart

LARGEST = 1e6  # entry of W with which pivots are large enough
KEPT = 4  # dissections, of the latest meshes

Batches = Iterable[tuple[slice, NDArray]]


_trees: dict[
    bytes, tuple
] = {}  # order of the elements, and parts with their halves, by their centres


class SingularError(Exception):
    """A part of the matrix has no LU factors."""


@dataclass
class _Part:
    """A part of the elements in the order of the dissection.

    Attributes:
        first, end: Its elements.
        halves: Two parts, or none.
        unknowns: That are eliminated here.
        own: Their numbers in the order of elimination.
        kept: Unknowns that are passed on.
        places: Among the unknowns of this part: of those of each element, with the place behind the
            last one if it is none; or of those that the halves keep.
    """

    first: int
    end: int
    halves: list["_Part"]
    unknowns: NDArray = field(init=False)
    own: NDArray = field(init=False)
    kept: NDArray = field(init=False)
    places: list[NDArray] | NDArray = field(init=False)


class Dissection:
    """The order of elimination; serves all matrices of the same elements.

    Args:
        unknowns: (elements, unknowns) of each element; negative if it is none.
        free: Mask of the unknowns to solve for.
        centres: (elements, 2) of the elements.
    """

    def __init__(self, unknowns: NDArray, free: NDArray, centres: NDArray):
        self.size = free.size
        solved = (unknowns >= 0) & free[unknowns]
        count = np.bincount(unknowns[solved], minlength=free.size)
        inner = (solved & (count[unknowns] == 1)).all(axis=0)
        self.inner = _range(np.flatnonzero(inner))
        self.outer = _range(np.flatnonzero(solved.any(axis=0) & ~inner))
        self.inner_count = int(inner.sum())
        self.inner_unknowns = unknowns[:, self.inner]
        self.outer_unknowns = np.where(solved, unknowns, -1)[:, self.outer]
        key = centres.tobytes()  # the dissection of one order is good for all
        if key not in _trees:
            self._sets, self._sizes = self._sets_of_elements()
            self.order = np.arange(len(unknowns))
            tree = self._dissect(0, len(unknowns), centres)
            while len(_trees) >= KEPT:
                del _trees[next(iter(_trees))]
            _trees[key] = self.order, tree
        self.order, tree = _trees[key]
        root = deepcopy(tree)
        self._numbers = self.outer_unknowns[self.order]
        self._first, self._last = self._span(self._numbers)
        self.parts: list[_Part] = []  # halves before the whole
        self._eliminate(root, np.flatnonzero(self._last >= 0))
        self._number()

    def _span(self, numbers: NDArray) -> tuple[NDArray, NDArray]:
        """First and last element of each unknown; of none, the last one is -1."""
        elements = np.broadcast_to(np.arange(len(numbers))[:, None], numbers.shape)
        there = numbers >= 0
        first, last = np.full(self.size, len(numbers)), np.full(self.size, -1)
        last[numbers[there]] = elements[there]  # the last assignment counts
        first[numbers[there][::-1]] = elements[there][::-1]
        return first, last

    def _sets_of_elements(self) -> tuple[NDArray, NDArray]:
        """Unknowns of the same elements are one set: sets of each element, and their sizes."""
        numbers = self.outer_unknowns
        there = numbers >= 0
        key = np.random.default_rng(SEED).random(len(numbers))
        keys = np.broadcast_to(key[:, None], numbers.shape)[there]
        sums = np.bincount(numbers[there], keys, self.size).round(9)
        _, sets = np.unique(sums, return_inverse=True)
        sizes = np.bincount(sets)
        own = np.sort(np.where(there, sets[numbers], -1), axis=1)
        own[:, 1:][own[:, 1:] == own[:, :-1]] = -1
        own = np.sort(own, axis=1)
        return own[:, -int((own >= 0).sum(axis=1).max()) :], sizes

    def _dissect(self, first: int, end: int, centres: NDArray) -> _Part:
        """Halve the elements, and put them in order."""
        count = end - first
        if count <= LEAF:
            return _Part(first, end, [])
        elements = self.order[first:end]
        sets, own = np.unique(self._sets[elements], return_inverse=True)
        own, sizes = own.reshape(count, -1), np.where(sets >= 0, self._sizes[sets], 0)
        least, best = max(1, int(BALANCE * count)), (np.inf, 0, elements)
        rank = np.repeat(np.arange(count), own.shape[1])
        for direction in DIRECTIONS:
            order = np.argsort(centres[elements] @ direction, kind="stable")
            numbers = own[order].ravel()
            low, high = np.empty(sets.size, int), np.empty(sets.size, int)
            high[numbers] = rank
            low[numbers[::-1]] = rank[::-1]
            cut = np.bincount(low + 1, sizes, count + 1) - np.bincount(high + 1, sizes, count + 1)
            cut = np.cumsum(cut)[least : count - least + 1]  # unknowns on both sides
            k = int(np.argmin(cut))
            if cut[k] < best[0]:
                best = cut[k], least + k, elements[order]
        _, k, self.order[first:end] = best
        halves = [
            self._dissect(first, first + k, centres),
            self._dissect(first + k, end, centres),
        ]
        return _Part(first, end, halves)

    def _eliminate(self, part: _Part, candidates: NDArray):
        """Find what is eliminated in each part, of the unknowns that have all elements in it."""
        rest = candidates
        for half in part.halves:
            inside = (self._first[rest] >= half.first) & (self._last[rest] < half.end)
            self._eliminate(half, rest[inside])
            rest = rest[~inside]
        part.unknowns = rest[np.lexsort((self._last[rest], self._first[rest]))]
        self.parts.append(part)

    def _number(self):
        """Number the unknowns as they are eliminated, and find places of the halves."""
        self.unknowns = np.concatenate([part.unknowns for part in self.parts])
        number = np.full(self.size + 1, -1)
        number[self.unknowns] = np.arange(self.unknowns.size)
        numbers = number[self._numbers]
        start = 0
        for part in self.parts:
            own = np.arange(start, start + part.unknowns.size)
            start += own.size
            if part.halves:
                every = np.unique(np.concatenate([half.kept for half in part.halves]))
            else:
                every = np.unique(numbers[part.first : part.end])
            part.own, part.kept = own, every[every >= start]
            both = np.concatenate([own, part.kept])
            if part.halves:
                part.places = [np.searchsorted(both, half.kept) for half in part.halves]
            else:
                mine = numbers[part.first : part.end]
                part.places = np.where(mine >= 0, np.searchsorted(both, mine), both.size)

    def delay(self, weak: list[_Part], late: NDArray) -> bool:
        """Eliminate some unknowns of parts one part later; returns whether there were any.

        Args:
            weak: The parts.
            late: Mask of the unknowns.
        """
        found = False
        for part in self.parts:
            for half in part.halves:
                moved = late[half.unknowns]
                if any(half is one for one in weak) and moved.any():
                    part.unknowns = np.concatenate([half.unknowns[moved], part.unknowns])
                    half.unknowns = half.unknowns[~moved]
                    found = True
        self._number()
        return found


class FrontalFactors:
    """LU factors of one matrix.

    Args:
        dissection: Of the elements.
        batches: Of which elements, and their matrices (elements, unknowns, unknowns).

    Raises:
        SingularError: Some part has none.
    """

    def __init__(self, dissection: Dissection, batches: Batches):
        self._dissection = dissection
        outer = self._condense(batches)
        weak = self._factorise(outer, LARGEST)
        while weak:
            if dissection.delay(weak, self._without_diagonal()):
                weak = self._factorise(outer, LARGEST)
            elif self._factorise(outer, np.inf):
                raise SingularError
            else:
                break

    def _without_diagonal(self) -> NDArray:
        """Mask of the unknowns whose own entry is zero, like that of a pressure."""
        numbers = self._dissection.outer_unknowns
        size = np.abs(self._diagonal[numbers >= 0])
        return np.bincount(numbers[numbers >= 0], size, self._dissection.size) == 0

    def _factorise(self, outer: NDArray, largest: float) -> list[_Part]:
        """Factorise all fronts; returns the parts where the pivots are too small."""
        dissection = self._dissection
        self._factors: list = []
        weak: list[_Part] = []
        passed: dict[int, NDArray | None] = {}
        for part in dissection.parts:
            own, size = part.own.size, part.own.size + part.kept.size
            if part.halves:
                found = [passed.pop(half.first) for half in part.halves]
                matrices = [matrix for matrix in found if matrix is not None]
                if len(matrices) < len(found):
                    passed[part.first] = None
                    continue
                F = np.zeros((size, size), order="F")
                for place, matrix in zip(part.places, matrices, strict=True):
                    _add(F, place, matrix)
            else:
                members = outer[dissection.order[part.first : part.end]]
                mine = np.asarray(part.places)
                places = mine[:, :, None] + (size + 1) * mine[:, None, :]
                entries: NDArray = np.bincount(places.ravel(), members.ravel(), (size + 1) ** 2)
                F = entries.reshape(size + 1, size + 1).T[:size, :size]
            passed[part.first] = self._eliminate(F, own, largest)
            if passed[part.first] is None:
                weak.append(part)
        return weak

    def _eliminate(self, F: NDArray, own: int, largest: float) -> NDArray | None:
        """Factorise a front; returns what is passed on, none if the pivots are too small."""
        if own == 0:
            self._factors.append(None)
            return F
        lu, pivots, failed = lapack.dgetrf(F[:own, :own])
        if failed:
            return None
        W, below = F[:own, own:], np.asfortranarray(F[own:, :own])
        if below.size:
            W, _ = lapack.dgetrs(lu, pivots, W)
            if np.abs(W).max() > largest:
                return None
        self._factors.append((lu, pivots, W, below))
        return F[own:, own:] - below @ W

    def _condense(self, batches: Batches) -> NDArray:
        """Eliminate inner unknowns of elements; returns the rest of the matrices."""
        dissection = self._dissection
        inner, outer = dissection.inner, dissection.outer
        m, n, count = (
            dissection.inner_count,
            dissection.outer_unknowns.shape[1],
            len(dissection.order),
        )
        result, self._diagonal = np.empty((count, n, n)), np.empty((count, n))
        self._inverse = np.empty((count, m, m))
        self._right, self._left = np.empty((count, m, n)), np.empty((count, n, m))
        for members, matrices in batches:
            self._diagonal[members] = np.diagonal(matrices, axis1=1, axis2=2)[:, outer]
            coupling = matrices[:, inner][:, :, outer]
            try:
                inverse = np.linalg.inv(matrices[:, inner][:, :, inner])
            except np.linalg.LinAlgError as error:
                raise SingularError from error
            self._inverse[members] = inverse
            self._right[members] = inverse @ coupling
            self._left[members] = left = matrices[:, outer][:, :, inner] @ inverse
            np.matmul(left, coupling, out=result[members])
            np.subtract(matrices[:, outer][:, :, outer], result[members], out=result[members])
        return result

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
        inner = right[dissection.inner_unknowns][:, :, None]
        b = np.append(right, 0.0)
        outer = dissection.outer_unknowns
        np.subtract.at(b, outer, (to_outer @ inner)[:, :, 0])
        x = b[dissection.unknowns]
        (self._sweep_transposed if transposed else self._sweep)(x)
        solution = np.zeros(right.size + 1)
        solution[dissection.unknowns] = x
        found = inverse @ inner - from_outer @ solution[outer][:, :, None]
        solution[dissection.inner_unknowns] = found[:, :, 0]
        return solution[:-1]

    def _sweep(self, x: NDArray):
        """Solve in place, unknowns in the order of elimination."""
        pairs = [
            pair for pair in zip(self._dissection.parts, self._factors, strict=True) if pair[1]
        ]
        for part, (lu, pivots, _, below) in pairs:
            own = slice(part.own[0], part.own[-1] + 1)
            x[own], _ = lapack.dgetrs(lu, pivots, x[own])
            x[part.kept] -= below @ x[own]
        for part, (_, _, W, _) in reversed(pairs):
            x[part.own[0] : part.own[-1] + 1] -= W @ x[part.kept]

    def _sweep_transposed(self, x: NDArray):
        """The same with the transposed matrix."""
        pairs = [
            pair for pair in zip(self._dissection.parts, self._factors, strict=True) if pair[1]
        ]
        for part, (_, _, W, _) in pairs:
            x[part.kept] -= W.T @ x[part.own[0] : part.own[-1] + 1]
        for part, (lu, pivots, _, below) in reversed(pairs):
            own = slice(part.own[0], part.own[-1] + 1)
            x[own], _ = lapack.dgetrs(lu, pivots, x[own] - below.T @ x[part.kept], trans=1)


def _range(numbers: NDArray) -> NDArray | slice:
    """As a slice, which takes no copy, if they have no gap."""
    if numbers.size and numbers[-1] - numbers[0] == numbers.size - 1:
        return slice(int(numbers[0]), int(numbers[-1]) + 1)
    return numbers


def _add(F: NDArray, places: NDArray, matrix: NDArray):
    """Add a matrix to rows and columns, both ascending, of F: by runs of places without a gap."""
    ends = np.flatnonzero(np.diff(places) != 1) + 1
    firsts, ends = np.append(0, ends), np.append(ends, places.size)
    wide = np.zeros((F.shape[0], places.size), order="F")
    for first, end in zip(firsts, ends, strict=True):
        wide[places[first] : places[first] + end - first] = matrix[first:end]
    for first, end in zip(firsts, ends, strict=True):
        F[:, places[first] : places[first] + end - first] += wide[:, first:end]
