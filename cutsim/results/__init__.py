"""Results of a run: progress, history, fields, figures."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
