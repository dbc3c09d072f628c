"""Scope of the values of a case file: its units, its other values, and the names of its parts."""

from collections.abc import Collection, Iterable, Mapping
from functools import cached_property
from typing import Any

from cutsim.base.units import Units
from cutsim.cases import geometries
from cutsim.cases.geometries import Outline
from cutsim.cases.keys import nearest
from cutsim.cases.numbers import Numbers


class Scope(Numbers):
    """What the values of a case file may refer to; pydantic hands it to all that validates them.

    Args:
        tables: The tables of the file in their full form.
        units: The units of plain numbers.
        groups: Names of the groups of the mesh, if it has been read.

    Attributes:
        valid: Value of each table that is valid by itself.
        known: For each table the class that says which keys it may have, by the identity of what the file gives.
    """

    def __init__(self, tables: Mapping[str, Any], units: Units, groups: Collection[str] | None = None) -> None:
        super().__init__(tables, units)
        self._groups = groups
        self.valid: dict[str, Any] = {}
        self.known: dict[int, Any] = {}

    def names(self, kind: str) -> Collection[str] | None:
        """Names that are known.

        Args:
            kind: What they name: "geometries", "parameters of the geometry", "groups" of the mesh, "surfaces" that a
                tool can touch, or a table such as "cracks".

        Returns:
            The names; None if they are known only once the mesh is read.
        """
        if kind == "geometries":
            return geometries.names()
        if kind == "parameters of the geometry":
            return None if self.outline is None else self.outline.parameters
        if kind == "groups":
            groups = self._groups if self._groups is not None or self.outline is None else self.outline.groups
            return None if groups is None else [*groups, *self._entries("groups")]
        if kind == "bodies":
            return self._entries(kind) or ["body"]
        if kind == "surfaces":
            groups, cracks = self.names("groups"), self._entries("cracks")
            return None if groups is None else [*groups, *(f"{crack}{side}" for crack in cracks for side in "+-")]
        return self._bodies() if kind == "bodies" else self._entries(kind)

    def _bodies(self) -> list[str]:
        """Names of bodies and layers; a case that has none of them has one body."""
        layers = self._tables.get("layers")
        named = [entry for entry in layers if isinstance(entry, Mapping)] if isinstance(layers, list) else []
        return [*self._entries("bodies"), *(str(entry.get("name", "")) for entry in named)] or ["body"]

    def _entries(self, table: str) -> list[str]:
        entries = self._tables.get(table)
        return list(entries) if isinstance(entries, Mapping) else []

    @cached_property
    def outline(self) -> Outline | None:
        """What is known of the mesh before it is made; None if it comes from a file."""
        mesh, layers = self._tables.get("mesh"), self._tables.get("layers")
        name = mesh.get("geometry") if isinstance(mesh, Mapping) else None
        if name == geometries.LAMINATE:
            entries = [entry for entry in layers if isinstance(entry, Mapping)] if isinstance(layers, list) else []
            return geometries.laminate_outline(tuple(str(entry.get("name", "")) for entry in entries))
        return geometries.outline(name) if isinstance(name, str) and name in geometries.names() else None

    def unknown(self, kind: str, name: str, known: Iterable[str]) -> str:
        """What to say of a name that is not known."""
        return f"must be one of the {kind} {', '.join(known) or '(there are none)'}{nearest(name, known)}"
