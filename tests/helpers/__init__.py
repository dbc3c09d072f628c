"""What several test modules share, by subject."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, as in cutsim
