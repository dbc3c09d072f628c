"""Versions of the libraries that compute, each found by loading it."""


def petsc_version() -> str:
    """Version of PETSc."""
    from petsc4py import PETSc

    return ".".join(map(str, PETSc.Sys.getVersion()))


def mpi_version() -> str:
    """Name and version of the MPI library, as far as its first line says them."""
    from mpi4py import MPI

    return MPI.Get_library_version().splitlines()[0].strip("\0 ")[:60]
