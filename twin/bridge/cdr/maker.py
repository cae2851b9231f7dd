"""Functions that encode and decode one type, made of its fields: as few structs as there are, and no calls.

CDR of ROS 2: numbers are aligned to their size, counted from the end of the encapsulation; a text is its
length with its terminating zero, and its bytes; a wstring is the number of its UTF-16 units and each of them
as an uint32, without a terminator (rosidl_typesupport_fastrtps_cpp, serialization_helpers.hpp).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from itertools import count
from typing import Any

from twin.bridge.cdr.layouts import CODES, Item
from twin.bridge.types.fields import Field, fields_of
from twin.bridge.types.literals import STRINGS
from twin.bridge.types.text import PADDING

MAGIC = b"\x00\x01\x00\x00"
"""The encapsulation header of plain CDR, little endian."""
_PADDING = Field(
    name=PADDING, attribute=PADDING, base="uint8", message="", string_bound=0, many="", size=0
)  # of an empty message


class Maker(ABC):
    """Writes a function's code; what is between two places of unknown length is one run."""

    def __init__(self, typename: str, known: dict[str, Any]) -> None:
        self._typename = typename
        self._known = known
        self._lines: list[str] = []
        self._indent = 1
        self._run: list[Item] = []
        self._numbers = count()

    def _made(self, head: str) -> Any:
        source = "\n".join([f"def {head}:", *self._lines])
        exec(compile(source, f"<CDR of {self._typename}>", "exec"), self._known)
        return self._known[head.partition("(")[0]]

    def _line(self, text: str) -> None:
        self._lines.append("    " * self._indent + text)

    def _new(self, thing: Any = None) -> str:
        """Return a new name, of a thing that the function knows or of a variable."""
        name = f"v{next(self._numbers)}"
        if thing is not None:
            self._known[name] = thing
        return name

    def _fields(self, typename: str, of: str) -> list[str]:
        fields = fields_of(typename) or (_PADDING,)
        return [self._field(field, f"{of}.{field.attribute}") for field in fields]

    def _field(self, field: Field, value: str) -> str:
        if field.many:
            if field.message:
                return self._messages(field, value)
            return self._texts(field, value) if field.base in STRINGS else self._array(field, value)
        if field.message:
            return self._message(field, value)
        if field.base in STRINGS:
            return self._text(field, value)
        return self._number(CODES[field.base], value)

    @abstractmethod
    def _message(self, field: Field, value: str) -> str: ...
    @abstractmethod
    def _messages(self, field: Field, value: str) -> str: ...
    @abstractmethod
    def _number(self, code: str, value: str) -> str: ...
    @abstractmethod
    def _text(self, field: Field, value: str) -> str: ...
    @abstractmethod
    def _texts(self, field: Field, value: str) -> str: ...
    @abstractmethod
    def _array(self, field: Field, value: str) -> str: ...
