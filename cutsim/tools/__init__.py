"""Rigid tools: shapes, paths, and their contact with a body."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
