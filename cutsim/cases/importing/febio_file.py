"""A FEBio file, whatever its version, with a record of what has been read of it."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from cutsim.base.arrays import Array
from cutsim.cases.importing.curves import Curve, Timed, with_jumps
from cutsim.cases.importing.draft import MalformedFile, Untranslatable
from cutsim.readers.febio import read_model
from cutsim.readers.xml_tree import LinedElement

_INTERPOLATIONS: dict[str, Callable[[Array, Array], Curve]] = {
    "linear": Curve,
    "step": Curve.stepped,
    "smooth": Curve.through_parabolas,
    "smooth step": Curve.smooth_steps,
}
_EXTENSIONS: dict[str, Callable[[Curve, float], Curve]] = {
    "constant": lambda curve, end: curve,
    "extrapolate": Curve.extrapolated,
    "repeat": lambda curve, end: curve.repeated(end, offset=False),
    "repeat offset": lambda curve, end: curve.repeated(end, offset=True),
}


def children(element: LinedElement) -> Iterator[LinedElement]:
    """The children of an element."""
    for child in element:
        assert isinstance(child, LinedElement)
        yield child


class FebioFile:
    """A FEBio file of version 2.0 to 4.0.

    Args:
        path: The file.

    Attributes:
        path: As above.
        root: Its outermost element.
        end: Time at the end of the run, set by the translation of the steps [time].

    Raises:
        MalformedFile: It is no such file, with the line.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.end = path, 1.0
        self._read: set[LinedElement] = set()
        try:
            self.root = read_model(path)
        except ValueError as error:
            raise MalformedFile(f"{path.name}: {error}") from None
        self.read(self.root)

    def read(self, element: LinedElement) -> LinedElement:
        """Take note that an element, but not what is in it, is read."""
        self._read.add(element)
        return element

    def read_all(self, element: LinedElement) -> None:
        """Take note that all of an element is read."""
        self._read.add(element)
        for child in children(element):
            self.read_all(child)

    def leftovers(self) -> Iterator[LinedElement]:
        """The outermost elements that have not been read."""
        yield from self._unread(self.root)

    def _unread(self, element: LinedElement) -> Iterator[LinedElement]:
        for child in children(element):
            if child not in self._read:
                yield child
            else:
                yield from self._unread(child)

    def sections(self, tag: str) -> Iterator[LinedElement]:
        """Sections of the file with this tag, in the order of the file, also that of its only step."""
        steps = self.steps()
        for element in (*children(self.root), *(children(steps[0]) if len(steps) == 1 else ())):
            if element.tag == tag:
                yield self.read(element)

    def steps(self) -> list[LinedElement]:
        """The steps of the analysis, none if it has no such sections."""
        found: list[LinedElement] = []
        for element in children(self.root):
            if element.tag == "Step":
                self.read(element)
                found += [self.read(step) for step in children(element) if step.tag == "step"] or [element]
        return found

    def child(self, element: LinedElement, *tags: str) -> LinedElement | None:
        """The first child with one of some tags, which is then read."""
        found = next((child for child in children(element) if child.tag in tags), None)
        return None if found is None else self.read(found)

    def text(self, element: LinedElement, tag: str, default: str = "") -> str:
        """Text of a child, or of an attribute of this name."""
        child = self.child(element, tag)
        return element.get(tag, default) if child is None else (child.text or "").strip()

    def number(self, element: LinedElement, tag: str, default: float | None = None) -> float:
        """Number of a child, or of an attribute of this name.

        Raises:
            Untranslatable: It varies in time or space.
            MalformedFile: There is none and no default.
        """
        child = self.child(element, tag)
        if child is None and element.get(tag) is None:
            if default is None:
                raise MalformedFile(f"{self.place(element)}: <{element.tag}> has no {tag}")
            return default
        if child is not None and child.get("lc"):
            raise Untranslatable(f"{tag} varies in time", child.line)
        text = element.get(tag, "") if child is None else child.text or ""
        return self._numbers(child if child is not None else element, tag, text)[0]

    def whole(self, element: LinedElement, attribute: str) -> int:
        """A whole number that is an attribute.

        Raises:
            MalformedFile: It is none.
        """
        text = element.get(attribute, "")
        if not text.strip().isdecimal():
            raise MalformedFile(
                f"{self.place(element)}: <{element.tag}> has {attribute} = {text!r}, which is no number"
            )
        return int(text)

    def vector(self, element: LinedElement, tag: str | None = None, length: int = 3) -> tuple[float, ...]:
        """Numbers of an element, or of a child.

        Raises:
            MalformedFile: They are missing, or others than `length`.
        """
        holder = element if tag is None else self.child(element, tag)
        if holder is None:
            raise MalformedFile(f"{self.place(element)}: <{element.tag}> has no {tag}")
        numbers = self._numbers(holder, holder.tag, holder.text or "")
        if len(numbers) != length:
            raise MalformedFile(f"{self.place(holder)}: <{holder.tag}> has {len(numbers)} numbers in place of {length}")
        return numbers

    def timed(self, element: LinedElement) -> Timed:
        """Number of an element times its load curve, if it has one.

        Args:
            element: It has the number, and the number of the curve as attribute.

        Raises:
            Untranslatable: It varies in space, or the curve has no counterpart.
        """
        self.read(element)
        number = self._numbers(element, element.tag, element.text)[0] if (element.text or "").strip() else 1.0
        return Timed(number, self.curve(element))

    def timed_child(self, element: LinedElement, tag: str) -> Timed:
        """The same for a child.

        Raises:
            MalformedFile: There is none.
        """
        found = self.child(element, tag)
        if found is None:
            raise MalformedFile(f"{self.place(element)}: <{element.tag}> has no {tag}")
        return self.timed(found)

    def curve(self, element: LinedElement) -> Curve | None:
        """The load curve of an element, if it has one.

        Raises:
            MalformedFile: There is none of its number.
            Untranslatable: It has no counterpart.
        """
        number = element.get("lc")
        if number is None:
            return None
        for data in self.sections("LoadData"):
            for entry in children(data):
                if entry.tag in ("loadcurve", "load_controller") and entry.get("id") == number:
                    return self._curve(entry)
        raise MalformedFile(f"{self.place(element)}: <{element.tag}>: there is no load curve {number}")

    def place(self, element: LinedElement) -> str:
        """File and line of an element."""
        return f"{element.file or self.path.name}:{element.line}"

    def _curve(self, entry: LinedElement) -> Curve:
        self.read(entry)
        old = entry.tag == "loadcurve"
        if not old and entry.get("type", "loadcurve") != "loadcurve":
            raise Untranslatable(f"load controller of type {entry.get('type')!r}", entry.line)
        kind = entry.get("type", "linear") if old else self.text(entry, "interpolate", "linear")
        extend = self.text(entry, "extend", "constant")
        if kind.lower() not in _INTERPOLATIONS or extend.lower() not in _EXTENSIONS:
            raise Untranslatable(f"load curve {entry.get('id')} is {kind!r}, extended {extend!r}", entry.line)
        self.read_all(entry)
        holder = self.child(entry, "points")
        points = [
            self.vector(p, length=2)
            for p in children(entry if holder is None else holder)
            if p.tag in ("pt", "point", "loadpoint")
        ]
        times, values = np.array(points, dtype=float).reshape(-1, 2).T
        if not len(times) or (np.diff(times) < 0).any():
            raise MalformedFile(f"{self.place(entry)}: load curve {entry.get('id')} needs points with increasing times")
        curve = _INTERPOLATIONS[kind.lower()](with_jumps(times), values)
        return _EXTENSIONS[extend.lower()](curve, self.end)

    def _numbers(self, element: LinedElement, what: str, text: str | None) -> tuple[float, ...]:
        kind = element.get("type")
        if kind not in (None, "const", "vector", "linear", "nonlinear"):
            raise Untranslatable(f"{what} of type {kind!r} varies in space", element.line)
        try:
            return tuple(float(number) for number in (text or "").split(","))
        except ValueError:
            raise MalformedFile(f"{self.place(element)}: {what} = {(text or '').strip()!r} is no number") from None
