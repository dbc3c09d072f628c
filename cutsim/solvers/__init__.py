"""Solvers: Newton's method, its tangent and its linear solvers."""
