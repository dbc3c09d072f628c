"""Meshes, the cracked function space, and the fields on it with their trial and committed values."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
