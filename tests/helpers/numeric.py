"""Values of UFL expressions of the position at many points at once, without compiling them."""

import operator

import numpy as np
import ufl
from ufl import classes
from ufl.algorithms import expand_derivatives
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering

_ARITHMETIC = {
    classes.Sum: operator.add, classes.Product: operator.mul, classes.Division: operator.truediv,
    classes.Power: operator.pow, classes.Abs: np.abs, classes.MaxValue: np.maximum, classes.MinValue: np.minimum,
    classes.EQ: operator.eq, classes.LT: operator.lt, classes.GT: operator.gt, classes.LE: operator.le,
    classes.GE: operator.ge, classes.Conditional: np.where,
}  # fmt: skip


class Numeric:
    """Evaluation at points, shape (n, dimension); each part of an expression is evaluated once."""

    def __init__(self, points):
        self.points, self._known = np.asarray(points, dtype=float), {}

    def __call__(self, expression):
        """Values of a scalar, shape (n,), or of a vector, shape (n, components)."""
        lowered = expand_derivatives(apply_algebra_lowering(expression))
        with np.errstate(all="ignore"):  # what a condition does not choose may be anything
            parts = [self._at(lowered, component, {}) for component in np.ndindex(expression.ufl_shape)]
        shape = (len(self.points), *expression.ufl_shape)
        return np.stack([np.broadcast_to(p, len(self.points)) for p in parts], axis=-1).reshape(shape)

    def _at(self, e, component, indices):
        free = tuple(indices[i] for i in e.ufl_free_indices)
        key = (id(e), component, free)
        if key not in self._known:
            self._known[key] = self._value(e, component, indices), e  # e stays alive, and its number its own
        return self._known[key][0]

    def _value(self, e, component, indices):
        if type(e) in _ARITHMETIC:
            return _ARITHMETIC[type(e)](
                *(self._at(part, component if part.ufl_shape else (), indices) for part in e.ufl_operands)
            )
        if isinstance(e, classes.SpatialCoordinate):
            return self.points[:, component[0]]
        if isinstance(e, classes.ScalarValue):
            return float(e)
        if isinstance(e, classes.Zero):
            return 0.0
        if isinstance(e, classes.Identity):
            return float(component[0] == component[1])
        if isinstance(e, classes.MathFunction):
            return getattr(np, e._name)(self._at(e.ufl_operands[0], (), indices))
        if isinstance(e, classes.Variable | classes.Real):
            return self._at(e.ufl_operands[0], component, indices)
        if isinstance(e, classes.ListTensor):
            return self._at(e.ufl_operands[component[0]], component[1:], indices)
        first, numbers = e.ufl_operands
        if isinstance(e, classes.Indexed):
            return self._at(first, tuple(_number(i, indices) for i in numbers), indices)
        if isinstance(e, classes.IndexSum):
            return sum(self._at(first, component, indices | {numbers[0].count(): i}) for i in range(e.dimension()))
        assert isinstance(e, classes.ComponentTensor), type(e)
        given = {i.count(): value for i, value in zip(numbers, component, strict=True)}
        return self._at(first, (), indices | given)


def _number(index, indices):
    return indices[index.count()] if isinstance(index, ufl.core.multiindex.Index) else int(index)
