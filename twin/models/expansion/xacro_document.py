"""Reading the files of one xacro expansion such that every element remembers its file and line."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from xml.dom import expatbuilder
from xml.dom.minidom import Document, Element, Node
from xml.parsers import expat

from twin.models.expansion.sandbox import Refused
from twin.models.urdf.xml_text import MAX_ATTRIBUTES, MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS

PLACE = "place"
"""Key of the user data of an element: its file and line."""
MAX_FILES = 1000


class Sources:
    """Parses files, and counts what the whole expansion takes."""

    def __init__(self) -> None:
        self._files = 0
        self._elements = 0

    def parse(self, file: str) -> Document:
        """Return the document of a file.

        Raises:
            OSError: It cannot be read.
            Refused: Not well-formed, too large, too deep, or with a DOCTYPE.
        """
        self._files += 1
        if self._files > MAX_FILES:
            raise Refused(f"more than {MAX_FILES} files are included", code="too-large")
        with open(file, "rb") as stream:
            text = stream.read(MAX_BYTES + 1)
        if len(text) > MAX_BYTES:
            raise Refused(f"more than {MAX_BYTES} bytes", code="too-large", file=file)
        try:
            return _Builder(file, self).parseString(text)
        except expat.ExpatError as error:
            message = f"not well-formed XML: {expat.ErrorString(error.code)}"
            raise Refused(message, code="bad-xml", file=file, line=error.lineno) from None

    def count(self) -> None:
        """Take note of one more element.

        Raises:
            Refused: That is too many.
        """
        self._elements += 1
        if self._elements > MAX_ELEMENTS:
            raise Refused(f"the file expands to more than {MAX_ELEMENTS} elements", code="too-large")

    def handle(self, operation: int, key: str, data: Any, src: Node, dst: Node) -> None:
        """Give a copy of an element the place of the original (this is DOM's UserDataHandler)."""
        self.count()
        dst.setUserData(key, data, self)


def place(element: object) -> tuple[str, int] | None:
    """Return file and line of an element."""
    return element.getUserData(PLACE) if isinstance(element, Element) else None


def elements(top: Element) -> Iterator[Element]:
    """Yield an element and all below it, in the order of their start tags."""
    waiting = [top]
    while waiting:
        element = waiting.pop()
        yield element
        waiting += [node for node in reversed(element.childNodes) if isinstance(node, Element)]


class _Builder(expatbuilder.ExpatBuilderNS):
    """minidom's own builder, which lets go of the lines."""

    def __init__(self, file: str, sources: Sources) -> None:
        super().__init__()
        self._file = file
        self._sources = sources
        self._depth = 0

    def start_doctype_decl_handler(self, *_: object) -> None:
        raise self._fault("the file has a DOCTYPE; remove it, a robot needs none", code="doctype")

    def start_element_handler(self, name: str, attributes: list[Any]) -> None:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise self._fault(f"more than {MAX_DEPTH} elements inside of each other", code="too-large")
        if len(attributes) > 2 * MAX_ATTRIBUTES:
            raise self._fault(f"more than {MAX_ATTRIBUTES} attributes in one element", code="too-large")
        super().start_element_handler(name, attributes)
        self._sources.count()
        self.curNode.setUserData(PLACE, (self._file, self.getParser().CurrentLineNumber), self._sources)

    def end_element_handler(self, name: str) -> None:
        self._depth -= 1
        super().end_element_handler(name)

    def _fault(self, message: str, *, code: str) -> Refused:
        return Refused(message, code=code, file=self._file, line=self.getParser().CurrentLineNumber)
