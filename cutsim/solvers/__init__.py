"""Solvers: Newton's method, its tangent and its linear solvers."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
