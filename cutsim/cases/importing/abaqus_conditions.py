"""Prescribed displacements and loads of Abaqus."""

from collections.abc import Iterator, Mapping
from math import hypot
from types import MappingProxyType
from typing import Any

from cutsim.cases.importing.abaqus_file import AbaqusFile, Located, entry
from cutsim.cases.importing.abaqus_history import Amplitudes, History, Step
from cutsim.cases.importing.draft import Untranslatable
from cutsim.readers.abaqus_cards import Card, real, whole

#: Directions that a named condition holds.
_NAMED: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {"ENCASTRE": (1, 2, 3), "PINNED": (1, 2, 3), "XSYMM": (1,), "YSYMM": (2,), "ZSYMM": (3,)}
)
_AXES = "xyz"
_ROTATIONS = (4, 5, 6)
_ON_NODES = ("vertices", "points")
_BODY_FORCES = ("GRAV", "BX", "BY", "BZ")


class Conditions:
    """Conditions of a file through its steps.

    Args:
        file: The file.
        steps: Its steps, the first one a moment before them.
        dim: Dimension of the mesh.
    """

    def __init__(self, file: AbaqusFile, steps: list[Step], dim: int) -> None:
        self._file, self._steps, self._dim = file, steps, dim
        self._amplitudes = Amplitudes(file)
        self._supports: dict[tuple[str, Any, int], History] = {}
        self._loads: dict[tuple[Any, ...], History] = {}
        self._comments: dict[tuple[Any, ...], str] = {}

    def translate(self) -> None:
        """Translate all of them."""
        for located in self._file.take("BOUNDARY"):
            with self._file.attempt(located.card):
                self._boundary(located)
        for located in self._file.take("CLOAD", "DLOAD", "DSLOAD"):
            with self._file.attempt(located.card):
                self._load(located)
        self._write_supports()
        self._write_loads()

    # -- prescribed displacements ---------------------------------------------------------------------------------

    def _boundary(self, located: Located) -> None:
        card, step = located.card, self._steps[located.step]
        if (card.get("TYPE").upper() or "DISPLACEMENT") != "DISPLACEMENT" or "FIXED" in card.parameters:
            raise Untranslatable(f"with {', '.join(card.parameters)}", card.line)
        released = card.get("OP").upper() == "NEW" and located.step > 1
        amplitude, named = self._amplitudes.of(card, step), set()
        for line, entries in card.rows():
            with card.at(line):
                key, where = self._nodes(entries[0], located.part, line)
                for dof, value in _held(entries, line):
                    if dof in range(1, self._dim + 1):
                        named.add((key, where, dof))
                        self._comments.setdefault((key, where, dof), f"line {line}")
                        self._supports.setdefault((key, where, dof), History()).set(value, step, amplitude)
        if released and self._supports.keys() - named:
            raise Untranslatable("OP=NEW: what is held before is not released here", card.line)

    def _nodes(self, wanted: str, part: str, line: int) -> tuple[str, Any]:
        """Key and value of the case file for a node or a set of nodes; a node is given by its position."""
        if wanted.isdecimal():
            found = (self._file.mesh.numbers == int(wanted)).nonzero()[0]
            if len(found) != 1:
                raise ValueError(f"there is no node {wanted}, or more than one")
            return "points", tuple(self._file.mesh.points[found[0]][: self._dim].tolist())
        names = self._file.find(self._file.mesh.node_sets, wanted, part)
        if not names:
            raise ValueError(f"there is no set of nodes {wanted!r}")
        if len(names) > 1:
            raise Untranslatable(f"the set {wanted!r} is one of {len(names)} instances", line)
        quadratic = self._file.draft.tables.get("mesh", {}).get("degree", 1) > 1
        return "facets" if quadratic else "vertices", names[0]

    def _write_supports(self) -> None:
        for (key, where, dof), history in _together(self._supports):
            value = history.timed()
            amount = {} if value.vanishes else {"value": value.value(self._file.end)}
            values = {key: _places(key, where), "direction": _AXES[dof - 1], **amount}
            label = "nodes" if key == "points" else where[0]
            self._file.draft.add("supports", f"{label}_{_AXES[dof - 1]}", values, self._comments[key, where[0], dof])

    # -- loads ----------------------------------------------------------------------------------------------------

    def _load(self, located: Located) -> None:
        card, step = located.card, self._steps[located.step]
        amplitude, named = self._amplitudes.of(card, step), set()
        for line, entries in card.rows():
            with card.at(line):
                for key, value in self._of_row(card, located.part, line, entries):
                    named.add(key)
                    self._comments.setdefault(key, f"line {line}")
                    self._loads.setdefault(key, History()).set(value, step, amplitude)
        if card.get("OP").upper() == "NEW":
            for key, history in self._loads.items():
                if key[0] == card.keyword and key not in named:
                    history.set(0.0, step)

    def _of_row(self, card: Card, part: str, line: int, entries: list[str]) -> Iterator[tuple[tuple[Any, ...], float]]:
        """What loads a row says: a key, and the value."""
        if card.keyword == "CLOAD":
            yield self._on_nodes(part, line, entries)
        elif card.keyword == "DSLOAD":
            yield self._on_surface(card, part, line, entries)
        elif entry(entries, 1).upper() in _BODY_FORCES:
            yield self._on_bodies(entries, line)
        else:
            raise Untranslatable(
                f"{' '.join(entries[1:2])} on elements: give the faces as a *SURFACE with *DSLOAD", line
            )

    def _on_nodes(self, part: str, line: int, entries: list[str]) -> tuple[tuple[Any, ...], float]:
        key, where = self._nodes(entries[0], part, line)
        dof = whole(entry(entries, 1))
        if key == "facets" or dof not in range(1, self._dim + 1):
            raise Untranslatable(f"a force along {dof} on {entries[0]!r}", line)
        return ("CLOAD", key, where, tuple(float(i == dof - 1) for i in range(self._dim))), real(entry(entries, 2))

    def _on_surface(self, card: Card, part: str, line: int, entries: list[str]) -> tuple[tuple[Any, ...], float]:
        names = self._file.find(self._file.mesh.facet_sets, entries[0], part)
        if len(names) != 1:
            raise ValueError(f"there is no surface {entries[0]!r} of elements")
        kind, value = entry(entries, 1).upper(), real(entry(entries, 2))
        if kind == "P":
            return ("DSLOAD", "pressure", names[0], ()), value
        if kind not in ("TRVEC", "TRSHR"):
            raise Untranslatable(f"{kind} on {entries[0]!r}", line)
        vector = [real(text) for text in entries[3 : 3 + self._dim]]
        size = hypot(*vector)
        if kind == "TRSHR" or not size:
            raise Untranslatable(f"{kind} on {entries[0]!r}", line)
        if self._file.large and card.get("FOLLOWER").upper() != "NO":
            self._file.draft.difference(
                line, f"*{card.keyword}: the direction of {kind} does not turn with the surface"
            )
        return ("DSLOAD", "traction", names[0], tuple(c / size for c in vector)), value

    def _on_bodies(self, entries: list[str], line: int) -> tuple[tuple[Any, ...], float]:
        """Weight, or a force per volume along an axis."""
        bodies = self._file.draft.tables.get("bodies", {})
        sought = self._file.find(self._file.mesh.cell_sets, entries[0])
        names = tuple(name for name, body in bodies.items() if body["cells"] in sought)
        if entries[0] and not names:
            raise Untranslatable(f"{entries[1]} on {entries[0]!r}, which is no body", line)
        kind, value = entry(entries, 1).upper(), real(entry(entries, 2))
        if kind != "GRAV":
            return ("DLOAD", "body-force", names, tuple(float(c == kind[1]) for c in "XYZ"[: self._dim])), value
        vector = [real(text) for text in entries[3 : 3 + self._dim]]
        if not (size := hypot(*vector)):
            raise Untranslatable("GRAV without a direction in the plane of the mesh", line)
        return ("DLOAD", "weight", names, tuple(c / size for c in vector)), size * value

    def _write_loads(self) -> None:
        on_nodes = {key[1:]: history for key, history in self._loads.items() if key[1] in _ON_NODES}
        for (kind, where, direction), history in _together(on_nodes):
            values = {"kind": "force", kind: _places(kind, where), "direction": list(direction)}
            label = "nodes" if kind == "points" else where[0]
            self._add_load(f"{label}_force", values, history, self._comments["CLOAD", kind, where[0], direction])
        for key, history in self._loads.items():
            _, kind, where, direction = key
            if kind in _ON_NODES:
                continue
            values = {"kind": kind} | ({"direction": list(direction)} if direction else {})
            if isinstance(where, tuple):
                values |= {"bodies": list(where)} if where else {}
            else:
                values["facets"] = where
            values |= {"current_area": True} if kind == "traction" and self._file.large else {}
            label = "_".join(where) if isinstance(where, tuple) else where
            self._add_load(f"{label}_{kind}".strip("_"), values, history, self._comments[key])

    def _add_load(self, name: str, values: dict[str, Any], history: History, comment: str) -> None:
        self._file.draft.add("loads", name, values | {"value": history.timed().value(self._file.end)}, comment)


def _together(
    histories: Mapping[tuple[str, Any, Any], History],
) -> Iterator[tuple[tuple[str, list[Any], Any], History]]:
    """Conditions on nodes, those of single nodes that are the same at all times as one."""
    found: dict[tuple[Any, ...], tuple[tuple[str, list[Any], Any], History]] = {}
    for (key, where, what), history in histories.items():
        alike = (what, *history.times, *history.values) if key == "points" else where
        found.setdefault((key, what, alike), ((key, [], what), history))[0][1].append(where)
    yield from found.values()


def _places(key: str, where: list[Any]) -> Any:
    """Value of the case file for nodes: positions, or the name of a set."""
    return [list(point) for point in where] if key == "points" else where[0]


def _held(entries: list[str], line: int) -> Iterator[tuple[int, float]]:
    """Directions that a row of ``*BOUNDARY`` holds, and their displacement; rotations do nothing in a solid."""
    word = entries[1].upper() if len(entries) > 1 else ""
    if word in _NAMED:
        yield from ((dof, 0.0) for dof in _NAMED[word])
        return
    if not word.isdecimal():
        raise Untranslatable(f"condition {word!r}", line)
    first = int(word)
    last = whole(entries[2]) if len(entries) > 2 and entries[2] else first
    if last > max(_ROTATIONS):
        raise Untranslatable(f"degree of freedom {last}", line)
    value = real(entries[3]) if len(entries) > 3 else 0.0
    yield from ((dof, value) for dof in range(first, last + 1))
