"""PETSc options under one prefix, so that the options of one solver never affect another."""

import atexit
from collections.abc import Mapping
from typing import Any

from petsc4py import PETSc

from cutsim.base.checks import require


class Options:
    """Options with one prefix in PETSc's database, where they stay until `clear` or the end of the program.

    They stay for the lifetime of the solver because PETSc reads some of them late, when a preconditioner is built.

    Args:
        prefix: The prefix, not empty.
        options: Options by name without prefix; None is a flag without value.

    Raises:
        ValueError: The prefix is empty.
    """

    def __init__(self, prefix: str, options: Mapping[str, Any]) -> None:
        require("petsc_options_prefix", prefix, bool(prefix), "a non-empty string such as 'cut_'")
        self.prefix = prefix
        self._database = PETSc.Options(prefix)
        self._own: set[str] = set()
        for name, value in options.items():
            self.set(name, value)

    def __contains__(self, name: str) -> bool:
        return bool(self._database.hasName(name))

    def get(self, name: str) -> str:
        """Value of an option that is set."""
        return str(self._database.getString(name))

    def set(self, name: str, value: Any) -> None:
        """Set an option, overwriting it."""
        self._database.setValue(name, value)
        self._own.add(name)
        _ever_set.add(self.prefix + name)

    def default(self, options: Mapping[str, Any], part: str = "") -> None:
        """Set options that are not set yet.

        Args:
            options: Options by name.
            part: What to put before each name.
        """
        for name, value in options.items():
            if part + name not in self:
                self.set(part + name, value)

    def clear(self) -> None:
        """Remove what was set here from the database."""
        for name in self._own:
            self._database.delValue(name)
        self._own.clear()


_ever_set: set[str] = set()


@atexit.register
def _clear_all() -> None:
    """Leave nothing to PETSc, which lists at its end, after this, the options that no solver has read."""
    database = PETSc.Options()
    for name in _ever_set:
        database.delValue(name)
