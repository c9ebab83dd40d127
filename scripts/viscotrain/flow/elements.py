"""Elements of a space in batches: points, shape functions and unknowns of all at once.

In coordinates of the reference triangle shape functions and their derivatives are the same for all
elements of a kind, that is, with the same sense of their edges.
"""

from collections.abc import Iterator, Sequence

import ngsolve
import numpy as np
from ngsolve import TRIG, VOL, CoefficientFunction, NumberSpace
from numpy.typing import NDArray

from viscotrain.flow.jets import Jet, Linear

BATCH = 32  # elements whose matrices are made together: they fit into the cache


class Elements:
    """Points, shape functions and unknowns of all elements, in an order of their kinds.

    Attributes:
        count: Of the elements.
        of_components: By component (elements, unknowns), numbers in the vector; negative if it is
            none.
        unknowns: The same of all components, (elements, unknowns), those inside of elements last.
    """

    def __init__(self, space: ngsolve.FESpace):
        self._mesh = space.mesh
        order = max(component.globalorder for component in space.components)
        self._rule = ngsolve.IntegrationRule(TRIG, 2 * order)
        self._points = space.mesh.MapToAllElements(self._rule, VOL)
        self._weights = np.array(self._rule.weights)
        ids = list(space.mesh.Elements(VOL))
        self.count = len(ids)
        numbers = np.array([space.GetDofNrs(element) for element in ids])
        sorts = [
            None if isinstance(component, NumberSpace) else (type(component), component.globalorder)
            for component in space.components
        ]
        sizes = [1 if s is None else (s[1] + 1) * (s[1] + 2) // 2 for s in sorts]
        columns = np.concatenate([[0], np.cumsum(sizes)])
        starts = [c for c, sort in zip(columns, sorts, strict=False) if sort is not None]
        senses = [np.argsort(numbers[:, c : c + 3], axis=1, kind="stable") for c in starts]
        _, kinds = np.unique(np.concatenate(senses, axis=1), axis=0, return_inverse=True)
        kinds = kinds.ravel()
        self._order = np.argsort(kinds, kind="stable")
        ends = np.cumsum(np.bincount(kinds))
        self._kinds = [slice(a, b) for a, b in zip(np.append(0, ends), ends, strict=False)]
        numbers = numbers[self._order]
        self.of_components = np.split(numbers, columns[1:-1], axis=1)
        inner = [0 if s is None else (s[1] - 1) * (s[1] - 2) // 2 for s in sorts]
        self._pieces, order = _inner_last(sizes, inner)
        self.unknowns = numbers[:, order]
        examples = [ids[self._order[kind.start]] for kind in self._kinds]
        scalar = dict(zip(sorts, space.components, strict=True))  # one of each sort
        scalar.pop(None, None)
        self._members = {s: [i for i, own in enumerate(sorts) if own == s] for s in scalar}
        self._shapes = {sort: self._of_kinds(own, examples) for sort, own in scalar.items()}
        self._tables = {  # (quantities times points, unknowns)
            sort: [np.swapaxes(one, 1, 2).reshape(-1, one.shape[1]) for one in kinds]
            for sort, kinds in self._shapes.items()
        }
        self._numbers = [i for i, sort in enumerate(sorts) if sort is None]
        self._sorts = sorts
        self._kernels: dict[tuple, NDArray] = {}
        self._samples: dict[int, tuple] = {}
        self._inverse: list[list[NDArray]] = []  # of the Jacobian matrix, by row and column
        self._deformed = False

    def _of_kinds(self, space: ngsolve.FESpace, examples: Sequence) -> list[NDArray]:
        """Shape functions on the reference triangle, (quantities, unknowns, points) by kind."""
        found = []
        for element in examples:
            fe = space.GetFE(element)
            shapes = [
                np.vstack([np.array(fe.CalcShape(x, y)), fe.CalcDShape(x, y).NumPy().T])
                for x, y, *_ in self._rule.points
            ]
            found.append(np.ascontiguousarray(np.transpose(shapes, (1, 2, 0))))
        return found

    def centres(self) -> NDArray:
        """(elements, 2) in the plane of the mesh."""
        x, y = self.sample(ngsolve.x), self.sample(ngsolve.y)
        return np.stack([x.mean(axis=1), y.mean(axis=1)], axis=1)

    def update(self):
        """Take the mesh as it is now: it may have been deformed."""
        if self._inverse and self._mesh.deformation is None and not self._deformed:
            return
        self._samples.clear()
        self._deformed = self._mesh.deformation is not None
        values = self._values(ngsolve.specialcf.JacobianMatrix(2))
        xx, xy, yx, yy = (np.ascontiguousarray(values[..., k]) for k in range(4))
        determinant = xx * yy - xy * yx
        self._inverse = [
            [yy / determinant, -xy / determinant],
            [-yx / determinant, xx / determinant],
        ]
        self._measure = np.abs(determinant) * self._weights

    def _values(self, function: CoefficientFunction) -> NDArray:
        values = function(self._points).reshape(self.count, len(self._weights), -1)
        return values[self._order]

    def sample(self, function: CoefficientFunction) -> NDArray:
        """Values (elements, points) of a function of the place alone; kept with the mesh."""
        key = id(function)
        if key not in self._samples:
            values = np.ascontiguousarray(self._values(function)[:, :, 0])
            self._samples[key] = function, values  # with the function, whose id is not used again
        return self._samples[key][1]

    def quantities(self, state: ngsolve.BaseVector, slopes: bool = False) -> list[Jet]:
        """All components at the points, with derivatives in space, and by themselves if wanted."""
        vector = np.append(state.FV().NumPy(), 0.0)  # the last one is for unknowns that are none
        found: list = [None] * len(self._sorts)

        def own(value, name) -> Jet:
            return Jet(value, {name: 1.0} if slopes else {}, self.sample)

        for i in self._numbers:
            found[i] = own(float(vector[self.of_components[i][0, 0]]), (i, 0))
        for sort, members in self._members.items():
            coefficients = np.stack(
                [vector[np.maximum(self.of_components[i], -1)] for i in members]
            )
            values = np.empty((3, len(members), self.count, len(self._weights)))
            for kind, shapes in zip(self._kinds, self._shapes[sort], strict=True):
                values[:, :, kind] = coefficients[None, :, kind] @ shapes[:, None]
            (xx, xy), (yx, yy) = self._inverse
            for i, value, x, y in zip(members, *values, strict=True):
                found[i] = own(value, (i, 0))
                found[i].gradient = own(xx * x + yx * y, (i, 1)), own(xy * x + yy * y, (i, 2))
        return found

    def test_quantities(self) -> list[Linear]:
        """The test functions of all components."""
        return [
            Linear(
                {(i, 0): 1.0},
                self.sample,
                tuple(Linear({(i, k): 1.0}, self.sample) for k in (1, 2)),
            )
            for i in range(len(self._sorts))
        ]

    def tested(self, i: int, fluxes: list) -> NDArray:
        """Integrals (elements, unknowns) of fluxes with the shape functions of a component."""
        value, z, r = (flux.value if isinstance(flux, Jet) else flux for flux in fluxes)
        if self._sorts[i] is None:
            return (value * self._measure).sum(axis=1, keepdims=True)
        weighted = np.empty((self.count, 3, len(self._weights)))
        (xx, xy), (yx, yy) = self._inverse
        for t, flux in enumerate([value, xx * z + xy * r, yx * z + yy * r]):
            np.multiply(flux, self._measure, out=weighted[:, t])
        flat = weighted.reshape(self.count, -1)
        result = np.empty(self.of_components[i].shape)
        for kind, shapes in zip(self._kinds, self._tables[self._sorts[i]], strict=True):
            np.matmul(flat[kind], shapes, out=result[kind])
        return result

    def batches(self) -> Iterator[tuple[int, slice]]:
        """Number of a kind and elements of it, not too many."""
        for number, kind in enumerate(self._kinds):
            for first in range(kind.start, kind.stop, BATCH):
                yield number, slice(first, min(first + BATCH, kind.stop))

    def add_block(
        self,
        matrices: NDArray,
        kind: int,
        members: slice,
        components: tuple[int, int],
        names: tuple,
        slopes: NDArray,
    ):
        """Write integrals of slopes with pairs of shape functions into matrices of elements."""
        i, j = components
        flat = slopes.reshape(len(slopes), -1).astype(matrices.dtype, copy=False)
        product = flat @ self._kernel(kind, i, j, names, matrices.dtype)
        product = product.reshape(len(slopes), -1, self.of_components[j].shape[1])
        for row, to_row in self._pieces[i]:
            for column, to_column in self._pieces[j]:
                matrices[:, to_row, to_column] = product[:, row, column]

    def referred(self, slopes: dict) -> tuple[tuple, NDArray]:
        """Slopes by test and trial quantity, in coordinates of the reference triangle.

        Returns:
            Names of the pairs, and values (elements, pairs, points) times weights.
        """
        for side in (0, 1):
            found: dict = {}
            for name, slope in slopes.items():
                if name[side] == 0:
                    found[name] = slope
                    continue
                for k in (1, 2):
                    new = (k, name[1]) if side == 0 else (name[0], k)
                    term = slope * self._inverse[k - 1][name[side] - 1]
                    found[new] = found[new] + term if new in found else term
            slopes = found
        values = np.empty((self.count, len(slopes), len(self._weights)))
        for k, slope in enumerate(slopes.values()):
            np.multiply(slope, self._measure, out=values[:, k])
        return tuple(slopes), values

    def _kernel(self, kind: int, i: int, j: int, used: tuple, precision: np.dtype) -> NDArray:
        """Products of shape functions, (used pairs of quantities times points, unknowns)."""
        key = kind, self._sorts[i], self._sorts[j], used, precision
        if key not in self._kernels:
            one = np.ones((1, 1, len(self._weights)))
            left, right = (
                one if sort is None else self._shapes[sort][kind]
                for sort in (self._sorts[i], self._sorts[j])
            )
            product = [left[t].T[:, :, None] * right[s].T[:, None, :] for t, s in used]
            table = np.stack(product).reshape(len(used) * len(self._weights), -1)
            self._kernels[key] = table.astype(precision)
        return self._kernels[key]

    def places(self, rows: NDArray, columns: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """An element with both unknowns, and their places in it."""
        found = []
        for row, column in zip(rows, columns, strict=True):
            first, second = self.unknowns == row, self.unknowns == column
            element = int(np.argmax(first.any(axis=1) & second.any(axis=1)))
            found.append((element, np.argmax(first[element]), np.argmax(second[element])))
        elements, here, there = np.array(found, dtype=np.int64).reshape(-1, 3).T
        return elements, here, there


def _inner_last(sizes: Sequence[int], inner: Sequence[int]) -> tuple[list, NDArray]:
    """Unknowns of an element, those of all components that are inside of it behind the others.

    Args:
        sizes: Number of unknowns by component.
        inner: How many are inside, the last ones of each component.

    Returns:
        By component slices of its unknowns and where they go; of all unknowns which one goes there.
    """
    ends, place = np.cumsum(sizes), 0
    pieces: list[list] = [[] for _ in sizes]
    order = []
    for last in (False, True):
        for k, (size, count, end) in enumerate(zip(sizes, inner, ends, strict=True)):
            own = slice(size - count, size) if last else slice(0, size - count)
            length = own.stop - own.start
            if length:
                pieces[k].append((own, slice(place, place + length)))
                order.append(np.arange(own.start, own.stop) + end - size)
                place += length
    return pieces, np.concatenate(order)
