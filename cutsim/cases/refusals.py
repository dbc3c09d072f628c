"""What is found to be wrong with a case while it is put together, said as what is wrong in its file."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from cutsim.base.checks import Refused
from cutsim.cases.document import CaseError, Document
from cutsim.cases.keys import Keys
from cutsim.cases.messages import refusal


def refused(document: Document, keys: Keys, words: str, value: Any = None) -> CaseError:
    """Error that names file, line and key of what is wrong.

    Args:
        document: The text of the case.
        keys: The key.
        words: What is allowed.
        value: The value that is not.
    """
    return CaseError([document.problem(keys, words, value)])


@contextmanager
def refusing(document: Document, *keys: str | int, elsewhere: Mapping[str, Keys] | None = None) -> Iterator[None]:
    """Say of what a constructor refuses within where the file has it.

    Args:
        document: The text of the case.
        keys: Key of the table from which the arguments come.
        elsewhere: Keys of other tables, of which arguments are made, by the names of these arguments.

    Raises:
        CaseError: In place of a ValueError.
    """
    try:
        yield
    except CaseError:
        raise
    except Refused as error:
        argument, _, rest = error.name.partition(".")
        if rest and elsewhere and argument in elsewhere:
            keys, error = elsewhere[argument], Refused(rest, error.value, error.allowed)
        raise CaseError([refusal(error, keys, document.at(keys), document)]) from error
    except ValueError as error:
        raise refused(document, keys, str(error)) from error
