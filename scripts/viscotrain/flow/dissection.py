"""Nested dissection: in which order the unknowns of elements are eliminated.

The elements are halved again and again (A. George, SIAM J. Numer. Anal. 10, 1973, 345); an unknown
is eliminated in the smallest part that contains all its elements. Unknowns inside of one element
are set apart. `fronts` makes the factors.
"""

from copy import deepcopy
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

LEAF = 6  # elements of a part that is not halved
BALANCE = 0.3  # each half has so many of the elements, at least
DIRECTIONS = ((1.0, 0.0), (0.0, 1.0), (0.7, 0.7), (0.7, -0.7))  # in which parts are cut
SEED = 0  # of random numbers by which sets of elements are told apart
KEPT = 4  # dissections, of the latest meshes

# Order of the elements, and parts with their halves, by the centres of the elements.
_trees: dict[bytes, tuple] = {}


@dataclass
class Part:
    """A part of the elements in the order of the dissection.

    Attributes:
        first, end: Its elements.
        halves: Two parts, or none.
        unknowns: That are eliminated here.
        own: Their numbers in the order of elimination.
        kept: Unknowns that are passed on.
        place: Of the part in the order of elimination.
        places: Among the unknowns of this part: of those of each element, with the place behind the
            last one if it is none; or of those that the halves keep.
    """

    first: int
    end: int
    halves: list["Part"]
    unknowns: NDArray = field(init=False)
    own: NDArray = field(init=False)
    kept: NDArray = field(init=False)
    place: int = field(init=False)
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
        self.parts: list[Part] = []  # halves before the whole
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

    def _dissect(self, first: int, end: int, centres: NDArray) -> Part:
        """Halve the elements, and put them in order."""
        count = end - first
        if count <= LEAF:
            return Part(first, end, [])
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
        return Part(first, end, halves)

    def _eliminate(self, part: Part, candidates: NDArray):
        """Find what is eliminated in each part, of the unknowns that have all elements in it."""
        rest = candidates
        for half in part.halves:
            inside = (self._first[rest] >= half.first) & (self._last[rest] < half.end)
            self._eliminate(half, rest[inside])
            rest = rest[~inside]
        part.unknowns = rest[np.lexsort((self._last[rest], self._first[rest]))]
        part.place = len(self.parts)
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

    def delay(self, weak: list[Part], late: NDArray) -> bool:
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


def _range(numbers: NDArray) -> NDArray | slice:
    """As a slice, which takes no copy, if they have no gap."""
    if numbers.size and numbers[-1] - numbers[0] == numbers.size - 1:
        return slice(int(numbers[0]), int(numbers[-1]) + 1)
    return numbers
