"""Case files: one TOML file says all of a simulation.

A file is read and checked by `read_case`. Its keys are the parameters of the classes of cutsim; `schema` says which
tables there are.
"""

from cutsim.cases.case import Case
from cutsim.cases.document import CaseError
from cutsim.cases.reading import check_groups, read_case

__all__ = ["Case", "CaseError", "check_groups", "read_case"]
