"""Analysis: mechanics and heat as sums of terms, the energy audit, and the loop over steps."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
