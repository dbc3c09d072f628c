"""Bodies: strain energy, inertia, loads and supports."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
