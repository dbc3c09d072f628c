"""Mesh files of gmsh, Abaqus, FEBio and of all formats that meshio reads, as arrays that make one mesh."""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads
