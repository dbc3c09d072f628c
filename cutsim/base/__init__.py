"""Foundations: compiled forms, kinematics, checks, units, and the terms of the virtual work."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
