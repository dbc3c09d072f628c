"""XML files whose elements know their line."""

from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat


class LinedElement(ElementTree.Element):
    """Element of an XML file.

    Attributes:
        line: Line of its tag.
        file: The file, if it is not the one that was asked for.
    """

    __slots__ = ("file", "line")
    file: str
    line: int

    @property
    def place(self) -> str:
        """Where it stands, in words for messages."""
        return f"{self.file}: line {self.line}" if self.file else f"line {self.line}"


def read_xml(path: Path | str, file: str = "") -> LinedElement:
    """Read an XML file.

    Args:
        path: The file.
        file: What messages call it; nothing for the one that was asked for.

    Raises:
        ValueError: It is not well-formed, with the line.
        OSError: It cannot be read.
    """
    parser = expat.ParserCreate()
    builder = ElementTree.TreeBuilder(element_factory=LinedElement)

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = builder.start(tag, attributes)
        element.line, element.file = parser.CurrentLineNumber, file  # type: ignore[attr-defined]

    parser.StartElementHandler = start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.buffer_text = True
    try:
        parser.Parse(Path(path).read_bytes(), True)
        root = builder.close()
    except (expat.ExpatError, LookupError, UnicodeError, ValueError, AssertionError) as error:
        where = f"{file}: line" if file else "line"
        raise ValueError(f"{where} {parser.CurrentLineNumber}: this is no well-formed XML ({error})") from None
    assert isinstance(root, LinedElement)
    return root
