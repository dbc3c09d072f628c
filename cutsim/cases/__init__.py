"""Case files: one TOML file says all of a simulation.

A file is read and checked by `read_case`. Its keys are the parameters of the classes of cutsim; `schema` says which
tables there are.
"""

import mpi4py.MPI  # noqa: F401  # before dolfinx, whose wheel needs the library that this loads

from cutsim.cases.built_in import built_in_cases
from cutsim.cases.case import Case
from cutsim.cases.document import CaseError
from cutsim.cases.reading import check_groups, read_case

__all__ = ["Case", "CaseError", "built_in_cases", "check_groups", "read_case"]
