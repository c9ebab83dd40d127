"""Residual and linearisation of costly integrals, for all elements at once.

Ngsolve linearises an integrand by evaluating it once per pair of a trial and a test quantity, which
for the constitutive equations took half of the time of a solution. Here the integrand F, linear in
the test quantities t (values and derivatives of test functions), is differentiated by symbols,

    residual   R_a  = sum_q w |J| sum_t  dF/dt     B_ta(q),
    matrix     K_ab = sum_q w |J| sum_ts d2F/dt ds B_ta(q) B_sb(q),

with s the trial quantities, B the shape functions and their derivatives, q the points and w the
weights of the rule that ngsolve uses. All dF/dt together, and all d2F/dt ds, are one compiled
function. In coordinates of the reference triangle B is the same for all elements of a kind, that
is, with the same sense of their edges; so the sums are one product of matrices for each pair of
components and each kind. The results are those of ngsolve up to round-off.
"""

from collections.abc import Sequence
from functools import cached_property

import ngsolve
import numpy as np
from ngsolve import TRIG, VOL, CoefficientFunction, NumberSpace, dx, grad

PROBE = (0.23, 0.31)  # where shape functions tell one kind of element from another
SEED = 0  # of the random state at which derivatives that are zero everywhere are found
INTERVAL = 7  # of the points at which they are looked at


class BatchedForm:
    """A nonlinear form, with the interface of `ngsolve.BilinearForm` as far as it is used.

    Args:
        space: Product of scalar spaces on triangles, each in H1 or one number.
        functions: Trial and test functions, as `space.TnT()` returned them.
        integrands: Linear in the test functions, to be integrated over the domain.
        rest: Integrals over boundaries, in a form on the same space.
    """

    def __init__(
        self,
        space: ngsolve.FESpace,
        functions: tuple[Sequence, Sequence],
        integrands: Sequence[CoefficientFunction],
        rest: ngsolve.BilinearForm,
    ):
        self.space = space
        self._functions, self._integrands, self._rest = functions, integrands, rest
        self._places_of_rest = np.empty(0, dtype=np.int64)

    @cached_property
    def mat(self) -> ngsolve.BaseMatrix:
        """The latest linearisation; it has entries for all pairs of unknowns of an element."""
        pattern = ngsolve.BilinearForm(self.space)
        trial, test = self._functions
        pattern += ngsolve.Parameter(0.0) * trial[0] * test[0] * dx
        return pattern.Assemble().mat

    @cached_property
    def _batches(self) -> "_Batches":
        """Made when first used: forms are made for counting unknowns, too."""
        return _Batches(self.space, self._functions, self._integrands)

    def Apply(self, state: ngsolve.BaseVector, residual: ngsolve.BaseVector):
        """Residual at a state."""
        self._rest.Apply(state, residual)
        self._batches.add_residual(state, residual.FV().NumPy())

    def AssembleLinearization(self, state: ngsolve.BaseVector):
        """Make `mat` at a state."""
        entries = np.asarray(self.mat.CSR()[0])
        entries[:] = 0.0
        self._rest.AssembleLinearization(state)
        values, columns, firsts = (np.asarray(part) for part in self._rest.mat.CSR())
        if self._places_of_rest.size != values.size:
            rows = np.repeat(np.arange(len(firsts) - 1), np.diff(firsts.astype(np.int64)))
            places = _Places(self.mat)
            self._places_of_rest = places.of(rows, columns)
            self._batches.find_places(places)
        entries[self._places_of_rest] = values
        self._batches.add_matrix(state, entries)


class _Batches:
    """The integrals over the domain; arguments as of `BatchedForm`."""

    def __init__(self, space, functions, integrands):
        self._state = ngsolve.GridFunction(space)
        self._elements = _Elements(space)
        fluxes, slopes = self._derivatives(space, functions, integrands)
        self._state.vec.FV().NumPy()[:] = np.random.default_rng(SEED).uniform(0.1, 0.5, space.ndof)
        names, self._fluxes = self._without_zeros(fluxes)
        self._rows: dict[int, list] = {}  # by component: its quantities, and which output
        for output, (component, quantity) in enumerate(names):
            self._rows.setdefault(component, []).append((quantity, output))
        names, self._slopes = self._without_zeros(slopes)
        self._blocks: dict[tuple[int, int], list] = {}  # the same by pair of components
        for output, ((i, t), (j, s)) in enumerate(names):
            self._blocks.setdefault((i, j), []).append((t, s, output))
        self._kernels: dict[tuple, np.ndarray] = {}
        self._places: dict[tuple, tuple] = {}

    def _derivatives(self, space, functions, integrands):
        """First and second derivatives with their names; contributions of integrands stand alone.

        A quantity is named (component, 0 for its value or 1 and 2 for its derivatives), a second
        derivative by those of the test and of the trial quantity.
        """
        one = CoefficientFunction(1.0)
        named = self._variables(space, functions)
        values = {
            part: variables[0][1]
            if len(variables) == 1
            else CoefficientFunction(tuple(v for _, v in variables))
            for part, variables in named.items()
        }
        fluxes, slopes = [], []
        for integrand in integrands:
            integral = integrand * dx
            trial, test = (integral.GetProxies(is_trial) for is_trial in (True, False))
            unknowns, weights = (
                [pair for part in p for pair in named[part]] for p in (trial, test)
            )
            F = integrand.Replace({part: values[part] for part in (*trial, *test)})
            fluxes += [(t, F.Diff(weight, one)) for t, weight in weights]
            for s, unknown in unknowns:
                slope = F.Diff(unknown, one)  # before that to t: shared by all t
                slopes += [((t, s), slope.Diff(weight, one)) for t, weight in weights]
        return fluxes, slopes

    def _variables(self, space, functions) -> dict:
        """(name, variable to differentiate by) of all quantities, by function and gradient."""
        named = {}
        for i, component in enumerate(space.components):
            value, one = self._state.components[i], CoefficientFunction(1.0)
            trial, test = (side[i] for side in functions)
            named[trial], named[test] = [((i, 0), value.Freeze())], [((i, 0), one.Freeze())]
            if not isinstance(component, NumberSpace):
                slope = grad(value)
                named[grad(trial)] = [((i, 1 + k), slope[k].Freeze()) for k in range(2)]
                named[grad(test)] = [
                    ((i, 1 + k), CoefficientFunction(1.0).Freeze()) for k in range(2)
                ]
        return named

    def _without_zeros(self, functions):
        """Names and values, as one compiled function, of those that are not zero everywhere."""
        everything = CoefficientFunction(tuple(function for _, function in functions)).Compile()
        size = np.abs(self._elements.some(everything, INTERVAL)).max(axis=0)
        used = [pair for pair, largest in zip(functions, size, strict=True) if largest > 0]
        together = CoefficientFunction(tuple(function for _, function in used)).Compile()
        return [name for name, _ in used], together

    def add_residual(self, state: ngsolve.BaseVector, residual: np.ndarray):
        """Add the integrals at a state."""
        self._state.vec.data = state
        elements = self._elements
        inverse, measure = elements.geometry()
        values = elements.sampled(self._fluxes)
        for component, quantities in self._rows.items():
            flux = np.zeros((*measure.shape, elements.quantities(component), 1))
            for quantity, output in quantities:
                flux[..., quantity, 0] += values[..., output] * measure
            flux[..., 1:, :] = inverse @ flux[..., 1:, :]
            unknowns = elements.unknowns[component]
            for kind, members in enumerate(elements.kinds):
                shapes = elements.shapes[kind][component]
                product = flux[members].reshape(len(members), -1) @ np.vstack(shapes)
                exists = unknowns[members] >= 0
                np.add.at(residual, unknowns[members][exists], product[exists])

    def add_matrix(self, state: ngsolve.BaseVector, entries: np.ndarray):
        """Add the linearisation at a state to the entries of the matrix."""
        self._state.vec.data = state
        elements = self._elements
        inverse, measure = elements.geometry()
        transposed = np.swapaxes(inverse, -1, -2)
        values = elements.sampled(self._slopes)
        for (i, j), quantities in self._blocks.items():
            slope = np.zeros((*measure.shape, elements.quantities(i), elements.quantities(j)))
            for t, s, output in quantities:
                slope[..., t, s] += values[..., output] * measure
            if any(t > 0 for t, _, _ in quantities):
                slope[..., 1:, :] = inverse @ slope[..., 1:, :]
            if any(s > 0 for _, s, _ in quantities):
                slope[..., 1:] = slope[..., 1:] @ transposed
            for kind, members in enumerate(elements.kinds):
                product = slope[members].reshape(len(members), -1) @ self._kernel(kind, i, j)
                exists, places = self._places[kind, i, j]
                np.add.at(entries, places, product.ravel()[exists])

    def _kernel(self, kind: int, i: int, j: int) -> np.ndarray:
        """Products of shape functions, (points times quantities, pairs of unknowns)."""
        left, right = (self._elements.shapes[kind][component] for component in (i, j))
        key = kind, id(left), id(right)
        if key not in self._kernels:
            product = np.einsum("qta,qsb->qtsab", left, right)
            self._kernels[key] = product.reshape(-1, left.shape[-1] * right.shape[-1])
        return self._kernels[key]

    def find_places(self, places: "_Places"):
        """By kind and block: which entries of element matrices count, and where they belong.

        Searched for only once for all components that are numbered alike: their entries stand in
        the same order, behind the first one of the component in the row.
        """
        unknowns = self._elements.unknowns
        alike = self._elements.numbered_alike()
        starts = [int(numbers[numbers >= 0].min()) for numbers in unknowns]
        relative: dict[tuple, tuple] = {}
        for i, j in self._blocks:
            for kind, members in enumerate(self._elements.kinds):
                row, column = unknowns[i][members][:, :, None], unknowns[j][members][:, None, :]
                key = kind, alike[i], alike[j]
                if key not in relative:
                    exists = np.flatnonzero((row >= 0) & (column >= 0))
                    rows, columns = (
                        part.ravel()[exists] for part in np.broadcast_arrays(row, column)
                    )
                    behind = places.of(rows, columns) - places.first_in(starts[j])[rows]
                    relative[key] = exists, rows - starts[i], behind
                exists, rows, behind = relative[key]
                first = places.first_in(starts[j])[rows + starts[i]]
                self._places[kind, i, j] = exists, first + behind


class _Places:
    """Positions of entries in the values of a matrix."""

    def __init__(self, matrix: ngsolve.BaseMatrix):
        _, columns, firsts = (np.asarray(part) for part in matrix.CSR())
        self._size = len(firsts) - 1
        rows = np.arange(self._size, dtype=np.int64)
        self._keys = np.repeat(rows * self._size, np.diff(firsts.astype(np.int64))) + columns
        self._firsts: dict[int, np.ndarray] = {}

    def of(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Of entries that are there."""
        return np.searchsorted(self._keys, rows * self._size + columns)

    def first_in(self, column: int) -> np.ndarray:
        """Of the first entry of each row that is not before a column."""
        if column not in self._firsts:
            self._firsts[column] = self.of(np.arange(self._size, dtype=np.int64), column)
        return self._firsts[column]


class _Elements:
    """Points, shape functions and unknowns of all elements.

    Attributes:
        kinds: Numbers of the elements of each kind.
        shapes: By kind and component (points, quantities, unknowns), on the reference triangle.
        unknowns: By component (elements, unknowns), numbers in the vector; negative if it is none.
    """

    def __init__(self, space: ngsolve.FESpace):
        order = max(component.globalorder for component in space.components)
        self._rule = ngsolve.IntegrationRule(TRIG, 2 * order)
        self._points = space.mesh.MapToAllElements(self._rule, VOL)
        self._weights = np.array(self._rule.weights)
        self._components = [
            None if isinstance(component, NumberSpace) else (type(component), component.globalorder)
            for component in space.components
        ]
        scalar = dict(zip(self._components, space.components, strict=True))  # one of each sort
        scalar.pop(None, None)
        by_order = sorted(scalar.items(), key=lambda item: item[0][1])
        probed = {sort: s for (sort, _), s in by_order}  # a higher order contains the lower
        ids = list(space.mesh.Elements(VOL))
        kinds: dict[bytes, list] = {}
        for number, element in enumerate(ids):
            probes = [np.array(s.GetFE(element).CalcShape(*PROBE)) for s in probed.values()]
            kinds.setdefault(np.concatenate(probes).round(9).tobytes(), []).append(number)
        self.kinds = [np.array(members) for members in kinds.values()]
        self.shapes = [self._shapes(scalar, ids[members[0]]) for members in self.kinds]
        numbers = np.array([space.GetDofNrs(element) for element in ids])
        ends = np.cumsum([shapes.shape[-1] for shapes in self.shapes[0]])
        self.unknowns = np.split(numbers, ends[:-1], axis=1)

    def _shapes(self, scalar: dict, element: ngsolve.ElementId) -> list[np.ndarray]:
        """Of each component, on one element."""
        found = {None: np.ones((len(self._weights), 1, 1))}
        for key, space in scalar.items():
            fe = space.GetFE(element)
            found[key] = np.array(
                [
                    np.vstack([np.array(fe.CalcShape(x, y)), fe.CalcDShape(x, y).NumPy().T])
                    for x, y, *_ in self._rule.points
                ]
            )
        return [found[key] for key in self._components]

    def numbered_alike(self) -> list[int]:
        """Of each component the first one with the same numbers but for a constant."""
        patterns: dict[bytes, int] = {}
        found = []
        for i, numbers in enumerate(self.unknowns):
            exists = numbers >= 0
            pattern = np.where(exists, numbers - numbers[exists].min(), -1).tobytes()
            found.append(patterns.setdefault(pattern, i))
        return found

    def quantities(self, component: int) -> int:
        """Value and derivatives, or the value alone of a number."""
        return 1 if self._components[component] is None else 3

    def sampled(self, function: CoefficientFunction) -> np.ndarray:
        """Values (elements, points, dimension) of a function."""
        return function(self._points).reshape(-1, len(self._weights), function.dim)

    def some(self, function: CoefficientFunction, interval: int) -> np.ndarray:
        """Values (points, dimension) at some points, in all regions of the mesh."""
        return function(self._points[::interval])

    def geometry(self) -> tuple[np.ndarray, np.ndarray]:
        """Inverse Jacobian (elements, points, 2, 2), weight times determinant (elements, points).

        On the mesh as it is now: it may have been deformed.
        """
        jacobian = self.sampled(ngsolve.specialcf.JacobianMatrix(2))
        jacobian = jacobian.reshape(*jacobian.shape[:2], 2, 2)
        return np.linalg.inv(jacobian), np.abs(np.linalg.det(jacobian)) * self._weights
