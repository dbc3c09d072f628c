"""Interface laws between two faces, for closing and opening, and the crack to which they apply."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
