"""Case: all of a simulation, as a case file says it."""

import tomlkit
from mpi4py import MPI
from pydantic import PrivateAttr

from cutsim.cases.building import Simulation, build
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
        return tomlkit.dumps(self._document.tables)

    def build(self, comm: MPI.Comm) -> Simulation:
        """Put the case together: mesh it and compile its forms. Collective.

        Args:
            comm: Communicator of the run.

        Raises:
            CaseError: On all ranks: a group is missing in the mesh, or parts do not fit.
        """
        return build(self, self._document, comm)
