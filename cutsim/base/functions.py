"""Elementary functions of UFL expressions and of arrays, so that a law is written once for form and audit."""

import math
from typing import Any

import numpy as np
import ufl

Number = Any  # a UFL expression, a number or an array


def _symbolic(*values: Number) -> bool:
    return any(isinstance(value, ufl.core.expr.Expr) for value in values)


def exp(x: Number) -> Number:
    """Exponential function."""
    return ufl.exp(x) if _symbolic(x) else np.exp(x) if isinstance(x, np.ndarray) else math.exp(x)


def log(x: Number) -> Number:
    """Natural logarithm."""
    return ufl.ln(x) if _symbolic(x) else np.log(x) if isinstance(x, np.ndarray) else math.log(x)


def sqrt(x: Number) -> Number:
    """Square root."""
    return ufl.sqrt(x) if _symbolic(x) else np.sqrt(x) if isinstance(x, np.ndarray) else math.sqrt(x)


def if_less(a: Number, b: Number, then: Number, otherwise: Number) -> Number:
    """One number where a < b, another where not."""
    if _symbolic(a, b, then, otherwise):
        return ufl.conditional(ufl.lt(a, b), then, otherwise)
    return np.where(np.less(a, b), then, otherwise)


def larger(a: Number, b: Number) -> Number:
    """The larger of two numbers."""
    return if_less(a, b, b, a)


def positive_part(x: Number) -> Number:
    """Positive part ⟨x⟩ of a number."""
    return if_less(0.0, x, x, 0.0)
