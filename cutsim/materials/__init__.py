"""Materials: strain energies of solids, each a frozen dataclass of its parameters."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
