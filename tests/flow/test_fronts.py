"""LU factors by fronts against those of the whole matrix."""

import numpy as np
import pytest

from viscotrain.flow.dissection import Dissection
from viscotrain.flow.fronts import SMALL, FrontalFactors, SingularError, _inverses

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


# ------------------------------------------------------------------------------ inverses by halves

SIZES = [1, 2, SMALL - 1, SMALL, SMALL + 1, 2 * SMALL - 1, 2 * SMALL + 1, 4 * SMALL + 3]


def unsymmetric(size, count=5):
    """Matrices whose leading blocks are as well conditioned as they are."""
    noise = np.random.default_rng(size).standard_normal((count, size, size))
    return noise / np.sqrt(size) + 3 * np.eye(size)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(("precision", "error"), [(np.float32, 1e-6), (np.float64, 1e-14)])
def test_inverses_of_many_matrices(size, precision, error):
    """Round-off: 6e-8 and 1e-16, times some halvings and a condition of about ten."""
    matrices = unsymmetric(size).astype(precision)
    before = matrices.copy()
    found = _inverses(matrices)
    expected = np.linalg.inv(matrices.astype(float))
    assert found.dtype == precision and found.shape == matrices.shape
    assert np.array_equal(matrices, before)
    assert np.abs(found - expected).max() < error


def inside_of_elements(matrices):
    """Elements in a row, each with an unknown that it shares with all, and all others inside."""
    count, size, _ = matrices.shape
    inside = 1 + np.arange(count * (size - 1)).reshape(count, size - 1)
    unknowns = np.concatenate([np.zeros((count, 1), int), inside], axis=1)
    centres = np.stack([np.arange(count), np.zeros(count)], axis=1).astype(float)
    free = np.ones(unknowns.max() + 1, bool)
    return unknowns, Dissection(unknowns, free, centres), [(slice(0, count), matrices)]


@pytest.mark.parametrize("transposed", [False, True])
def test_solution_with_many_unknowns_inside(transposed):
    matrices = unsymmetric(2 * SMALL + 4)
    unknowns, *given = inside_of_elements(matrices)
    total = whole(unknowns, matrices, unknowns.max() + 1)
    right = np.random.default_rng(4).standard_normal(len(total))
    found = FrontalFactors(*given).solve(right, transposed=transposed)
    expected = np.linalg.solve(total.T if transposed else total, right)
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_a_leading_half_without_an_inverse_is_no_factor(precision):
    """The matrix has an inverse, which halves cannot find: no wrong one is given."""
    matrices = unsymmetric(2 * SMALL + 1).astype(precision)
    matrices[1, 1 : SMALL + 1, 1 : SMALL + 1] = 0.0
    assert np.linalg.cond(matrices[1].astype(float)) < 1e5
    with pytest.raises(SingularError):
        FrontalFactors(*inside_of_elements(matrices)[1:], precision)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize("where", [0, 3, SMALL + 5, 2 * SMALL])
def test_what_is_not_finite_is_not_hidden(precision, where):
    """Neither in the inverse nor in a solution, by which an iteration stops."""
    matrices = unsymmetric(2 * SMALL + 1).astype(precision)
    matrices[1, where, where] = np.nan
    given = inside_of_elements(matrices)[1:]
    assert not np.isfinite(_inverses(matrices)[1]).any()
    assert np.isfinite(_inverses(matrices)[[0, 2]]).all()
    assert is_noticed(given, precision)


def is_noticed(given, precision):
    """Whether there are no factors, or none that solve anything."""
    try:
        factors = FrontalFactors(*given, precision)
    except SingularError:
        return True
    return not np.isfinite(factors.solve(np.ones(given[0].size))).any()
