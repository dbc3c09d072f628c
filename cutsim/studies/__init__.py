"""Studies: ready-made problems, such as an insertion, and the evaluation of their results."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
