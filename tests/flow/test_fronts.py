"""LU factors by fronts against those of the whole matrix."""

import numpy as np
import pytest

from viscotrain.flow.fronts import Dissection, FrontalFactors, SingularError

SIDE = 9  # elements


@pytest.fixture
def elements():
    """Squares with an unknown in each corner, one inside, one that all share, and one that none is.

    Two corners of the first element are one unknown.
    """
    corner = np.arange((SIDE + 1) ** 2).reshape(SIDE + 1, SIDE + 1)
    corners = [corner[:-1, :-1], corner[1:, :-1], corner[:-1, 1:], corner[1:, 1:]]
    count = SIDE**2
    unknowns = np.stack([c.ravel() for c in corners], axis=1)
    unknowns[0, 1] = unknowns[0, 0]
    shared = np.full((count, 1), corner.size)
    none = np.full((count, 1), -2)
    inside = corner.size + 1 + np.arange(count)[:, None]
    unknowns = np.concatenate([unknowns, shared, none, inside], axis=1)
    matrices = np.random.default_rng(3).standard_normal((count, 7, 7)) + 4 * np.eye(7)
    centres = np.stack([k.ravel() for k in np.indices((SIDE, SIDE))], axis=1).astype(float)
    return unknowns, matrices, centres


@pytest.fixture
def free(elements):
    mask = np.ones(elements[0].max() + 1, bool)
    mask[[1, 10, 40, 41]] = False
    return mask


def whole(unknowns, matrices, size):
    total = np.zeros((size, size))
    for numbers, matrix in zip(unknowns, matrices, strict=True):
        there = numbers >= 0
        np.add.at(total, np.ix_(numbers[there], numbers[there]), matrix[np.ix_(there, there)])
    return total


def batches(matrices):
    yield slice(0, 30), matrices[:30]
    yield slice(30, len(matrices)), matrices[30:]


@pytest.mark.parametrize("transposed", [False, True])
def test_solution(elements, free, transposed):
    unknowns, matrices, centres = elements
    factors = FrontalFactors(Dissection(unknowns, free, centres), batches(matrices))
    right = np.random.default_rng(4).standard_normal(free.size)
    total = whole(unknowns, matrices, free.size)[np.ix_(free, free)]
    expected = np.zeros(free.size)
    expected[free] = np.linalg.solve(total.T if transposed else total, right[free])
    found = factors.solve(right, transposed=transposed)
    assert np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()


def test_singular_matrix(elements, free):
    unknowns, matrices, centres = elements
    with pytest.raises(SingularError):
        FrontalFactors(Dissection(unknowns, free, centres), batches(0 * matrices))


def test_every_unknown_is_eliminated_once(elements, free):
    unknowns, _, centres = elements
    dissection = Dissection(unknowns, free, centres)
    eliminated = np.concatenate([dissection.unknowns, dissection.inner_unknowns.ravel()])
    wanted = np.intersect1d(unknowns, np.flatnonzero(free))
    assert np.array_equal(np.sort(eliminated), wanted)


def test_pressure_without_a_velocity_to_go_with_it():
    """In a chain, an end without diagonal that its part alone cannot eliminate."""
    count = 40
    unknowns = np.stack([np.arange(count), np.arange(count) + 1], axis=1)
    matrices = np.tile(np.array([[2.0, -1.0], [-1.0, 2.0]]), (count, 1, 1))
    matrices[0, 0, 0] = 0.0
    matrices[6, 1, 1] = matrices[7, 0, 0] = 0.0
    free = np.ones(count + 1, bool)
    centres = np.stack([np.arange(count), np.zeros(count)], axis=1).astype(float)
    right = np.random.default_rng(5).standard_normal(count + 1)
    found = FrontalFactors(Dissection(unknowns, free, centres), [(slice(0, count), matrices)])
    expected = np.linalg.solve(whole(unknowns, matrices, count + 1), right)
    assert np.abs(found.solve(right) - expected).max() < 1e-11 * np.abs(expected).max()
