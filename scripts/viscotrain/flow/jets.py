"""Values and first derivatives of expressions at many points (automatic differentiation).

A `Jet` is an array of values together with its derivatives by the quantities that it depends on,
propagated by the chain rule (A. Griewank & A. Walther, Evaluating Derivatives, SIAM 2008, ch. 3).
A `Linear` is a linear combination of test quantities whose coefficients are jets; it carries what
is integrated. `exp`, `sqrt`, `if_positive` and `grad` serve jets and coefficient
functions of ngsolve alike, so that an equation is written once for both. In products and quotients
the jet stands to the left of a coefficient function, which is then taken at the same points.

A quantity is named (component, 0 for its value or 1 and 2 for its derivatives).
"""

from collections.abc import Callable

import ngsolve
import numpy as np
from ngsolve import CoefficientFunction

Name = tuple[int, int]
Sample = Callable[[CoefficientFunction], np.ndarray]


class Jet:
    """Values and derivatives.

    Args:
        value: At the points, or one number for all of them.
        slopes: Derivative by each quantity, in the same form.
        sample: Values of a coefficient function at the points.
        gradient: Derivatives in space, of an unknown.
    """

    __slots__ = ("gradient", "sample", "slopes", "value")
    __array_ufunc__ = None  # arrays leave operations with jets to the jets

    def __init__(self, value, slopes: dict, sample: Sample, gradient: tuple = ()):
        self.value, self.slopes, self.sample, self.gradient = value, slopes, sample, gradient

    def _chain(self, value, slope) -> "Jet":
        """Function of this jet, with its value and derivative."""
        return Jet(value, {name: slope * own for name, own in self.slopes.items()}, self.sample)

    def __neg__(self):
        return self._chain(-self.value, -1.0)

    def __add__(self, other):
        if isinstance(other, Linear):
            return NotImplemented
        if not isinstance(other, Jet):
            return Jet(self.value + _plain(other, self.sample), self.slopes, self.sample)
        slopes = dict(self.slopes)
        for name, slope in other.slopes.items():
            slopes[name] = slopes[name] + slope if name in slopes else slope
        return Jet(self.value + other.value, slopes, self.sample)

    __radd__ = __add__

    def __sub__(self, other):
        return self + (-other)

    def __rsub__(self, other):
        return -self + other

    def __mul__(self, other):
        if isinstance(other, Linear):
            return NotImplemented
        if not isinstance(other, Jet):
            factor = _plain(other, self.sample)
            return self._chain(self.value * factor, factor)
        mine, its = self.value, other.value
        slopes = {name: slope * its for name, slope in self.slopes.items()}
        for name, slope in other.slopes.items():
            product = slope * mine
            slopes[name] = slopes[name] + product if name in slopes else product
        return Jet(mine * its, slopes, self.sample)

    __rmul__ = __mul__

    def _inverse(self) -> "Jet":
        inverse = 1 / self.value
        return self._chain(inverse, -inverse * inverse)

    def __truediv__(self, other):
        if isinstance(other, Jet):
            return self * other._inverse()
        return self * (1 / _plain(other, self.sample))

    def __rtruediv__(self, other):
        return self._inverse() * other

    def __pow__(self, exponent: int):
        if exponent != 2:
            return NotImplemented
        return self._chain(self.value * self.value, 2 * self.value)


class Linear:
    """Linear combination of test quantities.

    Args:
        terms: Coefficient of each: a jet, or values without derivatives.
        sample: Values of a coefficient function at the points.
        gradient: Derivatives in space, of a test function.
    """

    __slots__ = ("gradient", "sample", "terms")
    __array_ufunc__ = None

    def __init__(self, terms: dict, sample: Sample, gradient: tuple = ()):
        self.terms, self.sample, self.gradient = terms, sample, gradient

    def __neg__(self):
        return self * -1.0

    def __add__(self, other):
        terms = dict(self.terms)
        for name, term in other.terms.items():
            terms[name] = terms[name] + term if name in terms else term
        return Linear(terms, self.sample)

    def __sub__(self, other):
        return self + (-other)

    def __mul__(self, factor):
        factor = _plain(factor, self.sample)
        return Linear({name: factor * term for name, term in self.terms.items()}, self.sample)

    __rmul__ = __mul__

    def __truediv__(self, other):
        return self * (1 / _plain(other, self.sample))


def _plain(value, sample: Sample):
    """Values of a coefficient function; anything else as it is."""
    return sample(value) if isinstance(value, CoefficientFunction) else value


def grad(function):
    """Derivatives along the coordinates of an unknown or a test function."""
    return function.gradient if isinstance(function, Jet | Linear) else ngsolve.grad(function)


def exp(x):
    """Exponential."""
    if not isinstance(x, Jet):
        return ngsolve.exp(x)
    value = np.exp(x.value)
    return x._chain(value, value)


def sqrt(x):
    """Square root."""
    if not isinstance(x, Jet):
        return ngsolve.sqrt(x)
    value = np.sqrt(x.value)
    return x._chain(value, 0.5 / value)


def if_positive(condition, yes, no):
    """One or the other, by the sign of a jet or coefficient function."""
    if not isinstance(condition, Jet):
        return ngsolve.IfPos(condition, yes, no)
    chosen = condition.value > 0
    yes, no = (x if isinstance(x, Jet) else Jet(x, {}, condition.sample) for x in (yes, no))
    slopes = {
        name: np.where(chosen, yes.slopes.get(name, 0.0), no.slopes.get(name, 0.0))
        for name in {**yes.slopes, **no.slopes}
    }
    return Jet(np.where(chosen, yes.value, no.value), slopes, condition.sample)
