"""Pairs of outer surfaces with different meshes that find each other, under the law of an interface."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
