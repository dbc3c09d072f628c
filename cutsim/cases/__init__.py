"""Case files: one TOML file says all of a simulation.

A file is read and checked by `read_case`. Its keys are the parameters of the classes of cutsim; `schema` says which
tables there are. `__init__.pyi` lists the names that are imported from here; each is loaded when it is first used.
"""

import lazy_loader
import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
