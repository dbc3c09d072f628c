"""Heat: conduction in bodies, and heat that is generated and exchanged at contacts."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
