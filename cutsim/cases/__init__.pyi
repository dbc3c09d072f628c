from .built_in import built_in_cases as built_in_cases
from .case import Case as Case
from .document import CaseError as CaseError
from .json_schema import case_schema as case_schema
from .reading import check_groups as check_groups
from .reading import read_case as read_case
from .running import RunOutcome as RunOutcome
from .running import run_case as run_case
