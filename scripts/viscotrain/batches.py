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
put together: matrices of elements are what is factorised (`fronts`).
"""

from collections.abc import Callable, Sequence

import ngsolve
import numpy as np
import scipy.sparse
from ngsolve import TRIG, VOL, CoefficientFunction, NumberSpace
from numpy.typing import NDArray

from viscotrain.fronts import Dissection, FrontalFactors
from viscotrain.jets import Jet, Linear

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
        self._made: _Elements | None = None
        self._places_of_rest: tuple | None = None
        self._matrices: NDArray | None = None
        self._dissections: dict[str, Dissection] = {}

    @property
    def _elements(self) -> "_Elements":
        """Made when first used: forms are made for counting unknowns, too."""
        if self._made is None:
            self._made = _Elements(self.space)
        return self._made

    def Apply(self, state: ngsolve.BaseVector, residual: ngsolve.BaseVector):
        """Residual at a state."""
        self._rest.Apply(state, residual)
        values, elements = residual.FV().NumPy(), self._elements
        for i, fluxes in self._terms(state, slopes=False).items():
            unknowns = elements.unknowns[i]
            exists = unknowns >= 0
            shares = elements.tested(i, fluxes)[exists]
            values += np.bincount(unknowns[exists], shares, values.size)

    def AssembleLinearization(self, state: ngsolve.BaseVector):
        """Make the matrices of the elements at a state; each is used once, by `factorise`."""
        elements = self._elements
        matrices = np.zeros((elements.count, elements.columns[-1], elements.columns[-1]))
        with np.errstate(invalid="ignore", over="ignore"):  # an iteration that diverges stops
            for i, fluxes in self._terms(state, slopes=True).items():
                blocks: dict[int, dict] = {}
                for t, flux in enumerate(fluxes):
                    for (j, s), slope in flux.slopes.items() if isinstance(flux, Jet) else ():
                        blocks.setdefault(j, {})[t, s] = slope
                for j, slopes in blocks.items():
                    elements.add_block(matrices, i, j, slopes)
        self._add_rest(state, matrices)
        self._matrices = matrices

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

    def _add_rest(self, state: ngsolve.BaseVector, matrices: NDArray):
        """Add the matrix of the rest, each entry to an element that has both unknowns."""
        self._rest.AssembleLinearization(state)
        values, columns, firsts = (np.asarray(part) for part in self._rest.mat.CSR())
        if self._places_of_rest is None:
            rows = np.repeat(np.arange(len(firsts) - 1), np.diff(firsts.astype(np.int64)))
            used = np.flatnonzero(values)
            places = self._elements.places(rows[used], columns[used].astype(np.int64))
            self._places_of_rest = used, places
        used, places = self._places_of_rest
        matrices[places] += values[used]  # no place twice

    def matrix(self) -> scipy.sparse.csr_matrix:
        """The latest linearisation as one matrix."""
        numbers = np.concatenate(self._elements.unknowns, axis=1)
        rows, columns = np.broadcast_arrays(numbers[:, :, None], numbers[:, None, :])
        there = (rows >= 0) & (columns >= 0)
        entries = self._matrices[there], (rows[there], columns[there])
        return scipy.sparse.csr_matrix(entries, (self.space.ndof, self.space.ndof))

    def factorise(self, free: ngsolve.BitArray) -> "VectorFactors":
        """LU factors of the latest linearisation, which is used up.

        Args:
            free: Unknowns to solve for.

        Raises:
            fronts.SingularError: There are none.
        """
        key = str(free)
        if key not in self._dissections:
            unknowns = np.concatenate(self._elements.unknowns, axis=1)
            mask = np.fromiter(free, bool, len(free))
            self._dissections[key] = Dissection(unknowns, mask, self._elements.centres())
        matrices, self._matrices = self._matrices, None
        return VectorFactors(FrontalFactors(self._dissections[key], matrices))


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


class _Elements:
    """Points, shape functions and unknowns of all elements, in an order of their kinds.

    Attributes:
        count: Of the elements.
        unknowns: By component (elements, unknowns), numbers in the vector; negative if it is none.
        columns: Where the unknowns of each component begin among those of an element, and the end.
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
        self.columns = np.concatenate([[0], np.cumsum(sizes)])
        starts = [c for c, sort in zip(self.columns, sorts, strict=False) if sort is not None]
        senses = [np.argsort(numbers[:, c : c + 3], axis=1, kind="stable") for c in starts]
        _, kinds = np.unique(np.concatenate(senses, axis=1), axis=0, return_inverse=True)
        kinds = kinds.ravel()
        self._order = np.argsort(kinds, kind="stable")
        ends = np.cumsum(np.bincount(kinds))
        self._kinds = [slice(a, b) for a, b in zip(np.append(0, ends), ends, strict=False)]
        self.unknowns = np.split(numbers[self._order], self.columns[1:-1], axis=1)
        examples = [ids[self._order[kind.start]] for kind in self._kinds]
        scalar = dict(zip(sorts, space.components, strict=True))  # one of each sort
        scalar.pop(None, None)
        self._members = {s: [i for i, own in enumerate(sorts) if own == s] for s in scalar}
        self._shapes = {sort: self._of_kinds(own, examples) for sort, own in scalar.items()}
        self._numbers = [i for i, sort in enumerate(sorts) if sort is None]
        self._sorts = sorts
        self._kernels: dict[tuple, NDArray] = {}
        self._samples: dict[int, tuple] = {}
        self._inverse = None

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
        if self._inverse is not None and self._mesh.deformation is None and not self._deformed:
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
            found[i] = own(float(vector[self.unknowns[i][0, 0]]), (i, 0))
        for sort, members in self._members.items():
            coefficients = np.stack([vector[np.maximum(self.unknowns[i], -1)] for i in members])
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
        (xx, xy), (yx, yy) = self._inverse
        fluxes = [value, xx * z + xy * r, yx * z + yy * r]
        if self._sorts[i] is None:
            return (value * self._measure).sum(axis=1, keepdims=True)
        result = np.zeros((self.count, self.columns[i + 1] - self.columns[i]))
        for t, flux in enumerate(fluxes):
            weighted = flux * self._measure
            for kind, shapes in zip(self._kinds, self._shapes[self._sorts[i]], strict=True):
                result[kind] += weighted[kind] @ shapes[t].T
        return result

    def add_block(self, matrices: NDArray, i: int, j: int, slopes: dict):
        """Add integrals of slopes, by test and trial quantity, with pairs of shape functions."""
        slopes = self._referred(slopes)
        used = tuple(sorted(slopes))
        points = len(self._weights)
        stacked = np.empty((self.count, len(used), points))
        for k, name in enumerate(used):
            np.multiply(slopes[name], self._measure, out=stacked[:, k])
        stacked = stacked.reshape(self.count, -1)
        rows, columns = (slice(self.columns[k], self.columns[k + 1]) for k in (i, j))
        for number, kind in enumerate(self._kinds):
            product = stacked[kind] @ self._kernel(number, i, j, used)
            block = matrices[kind, rows, columns]
            block += product.reshape(block.shape)

    def _referred(self, slopes: dict) -> dict:
        """With derivatives in the coordinates of the reference triangle."""
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
        return slopes

    def _kernel(self, kind: int, i: int, j: int, used: tuple) -> NDArray:
        """Products of shape functions, (used pairs of quantities times points, unknowns)."""
        key = kind, self._sorts[i], self._sorts[j], used
        if key not in self._kernels:
            one = np.ones((1, 1, len(self._weights)))
            left, right = (
                one if sort is None else self._shapes[sort][kind]
                for sort in (self._sorts[i], self._sorts[j])
            )
            product = [left[t].T[:, :, None] * right[s].T[:, None, :] for t, s in used]
            self._kernels[key] = np.stack(product).reshape(len(used) * len(self._weights), -1)
        return self._kernels[key]

    def places(self, rows: NDArray, columns: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """An element with both unknowns, and their places in it."""
        numbers = np.concatenate(self.unknowns, axis=1)
        found = []
        for row, column in zip(rows, columns, strict=True):
            element = np.flatnonzero(
                (numbers == row).any(axis=1) & (numbers == column).any(axis=1)
            )[0]
            local = [int(np.flatnonzero(numbers[element] == n)[0]) for n in (row, column)]
            found.append((element, *local))
        return tuple(np.array(found, dtype=np.int64).reshape(-1, 3).T)
