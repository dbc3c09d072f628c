"""Case: all of a simulation, as a case file says it."""

import tomlkit
from pydantic import PrivateAttr

from cutsim.cases.document import Document
from cutsim.cases.schema import CaseTables


class Case(CaseTables):
    """Case: all of a simulation, read and checked by `cutsim.cases.read_case`."""

    _document: Document = PrivateAttr(default_factory=Document)

    @property
    def document(self) -> Document:
        """What was read."""
        return self._document

    @property
    def text(self) -> str:
        """The case as one file: with what it extends, and with all changes."""
        tables = {key: value for key, value in self._document.tables.items() if key != "extends"}
        return tomlkit.dumps(tables)
