"""Functions that encode and decode one type, made of its fields: as few structs as there are, and no calls.

CDR of ROS 2: numbers are aligned to their size, counted from the end of the encapsulation; a text is its
length with its terminating zero, and its bytes; a wstring is the number of its UTF-16 units and each of them
as an uint32, without a terminator (rosidl_typesupport_fastrtps_cpp, serialization_helpers.hpp).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from itertools import count
from struct import Struct
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from twin.bridge import types
from twin.bridge.cdr.layouts import CODES, Item, Layouts
from twin.bridge.types.bounds import STRINGS
from twin.bridge.types.fields import Field, fields_of
from twin.bridge.types.text import PADDING

MAGIC = b"\x00\x01\x00\x00"
"""The encapsulation header of plain CDR, little endian."""
Order = Literal["<", ">"]
"""Little or big endian."""
_U32 = Struct("<I")
_PADDING = Field(
    name=PADDING, attribute=PADDING, base="uint8", message="", string_bound=0, many="", size=0
)  # of an empty message


@cache
def encoder(typename: str) -> Callable[[Any], bytes]:
    """Return a function that returns a message as CDR, little endian.

    It raises whatever a value that does not fit happens to raise.
    """
    return _Encoder(typename).function()


@cache
def decoder(typename: str, order: Order) -> Callable[[bytes], tuple[Any, int]]:
    """Return a function that returns the message that a payload begins with, and where it ends.

    It raises whatever bytes that are no such message happen to raise. `order` is `<` or `>`.
    """
    return _Decoder(typename, order).function()


class _Maker(ABC):
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


class _Encoder(_Maker):
    """A run is all between loops: the struct depends on the lengths of its texts and sequences."""

    def __init__(self, typename: str) -> None:
        super().__init__(typename, {"MAGIC": MAGIC, "raw": _raw, "texts": _texts, "units": _units})
        self._values: list[str] = []
        self._sizes: list[str] = []
        self._begun = False

    def function(self) -> Callable[[Any], bytes]:
        self._fields(self._typename, "message")
        if self._begun:
            self._flush()
            self._line("return b''.join(parts)")
        else:
            self._line(f"return {self._layout('0', '4s')}.pack({', '.join(['MAGIC', *self._values])})")
        made: Callable[[Any], bytes] = self._made("encode(message)")
        return made

    def _layout(self, at: str, head: str = "") -> str:
        """Return the expression of the run's struct."""
        layouts = Layouts("<", tuple(self._run), head=head)
        if at == "0" and not self._sizes:
            return self._new(layouts[(0,)])
        return f"{self._new(layouts)}[{', '.join([at, *self._sizes])},]"

    def _flush(self) -> None:
        if not self._begun:
            self._line(f"layout = {self._layout('0', '4s')}")
            self._line(f"parts = [layout.pack({', '.join(['MAGIC', *self._values])})]")
            self._line("at = layout.size - 4")
            self._begun = True
        elif self._run:
            self._line(f"layout = {self._layout('at & 7')}")
            self._line(f"parts.append(layout.pack({', '.join(self._values)}))")
            self._line("at += layout.size")
        self._run, self._values, self._sizes = [], [], []

    def _variable(self, value: str) -> str:
        name = self._new()
        self._line(f"{name} = {value}")
        return name

    def _message(self, field: Field, value: str) -> str:
        self._fields(field.message, self._variable(value))
        return ""

    def _messages(self, field: Field, value: str) -> str:
        many, item = self._variable(value), self._new()
        self._count(field, f"len({many})")
        self._flush()
        self._line(f"for {item} in {many}:")
        self._indent += 1
        self._fields(field.message, item)
        self._flush()
        self._indent -= 1
        return ""

    def _number(self, code: str, value: str) -> str:
        size = Struct(f"<{code}").size
        self._run.append(Item(code, size, size))
        self._values.append(value)
        return ""

    def _text(self, field: Field, value: str) -> str:
        if field.base == "wstring":
            wide = self._variable(f"units({value})")
            self._number("I", f"len({wide}) // 4")
            self._bytes(wide, 4, f"len({wide})")
        else:
            text = self._variable(f"{value}.encode()")
            size = self._variable(f"len({text}) + 1")
            self._number("I", size)
            self._bytes(text, 1, size)  # a struct ends it with a zero
        return ""

    def _texts(self, field: Field, value: str) -> str:
        many = self._variable(f"tuple({value})")
        self._count(field, f"len({many})")
        raw = self._variable(f"texts({many}, {field.base == 'wstring'})")
        self._bytes(raw, 4, f"len({raw})")
        return ""

    def _array(self, field: Field, value: str) -> str:
        many, dtype = self._variable(value), types.dtype_of(field.base)
        self._count(field, f"{many}.size")
        # Those of bytes may be signed or not.
        raw = self._variable(f"raw({many}, {self._new(dtype) if field.base != 'byte' else None})")
        self._bytes(raw, dtype.itemsize, f"len({raw})")
        return ""

    def _count(self, field: Field, count: str) -> None:
        if field.many == "array":
            self._line(f"if {count} != {field.size}: raise ValueError('{field.size} elements')")
        else:
            self._number("I", count)

    def _bytes(self, value: str, align: int, size: str) -> None:
        self._run.append(Item("s", align, None))
        self._values.append(value)
        self._sizes.append(size)


class _Decoder(_Maker):
    """A run ends where a length has to be known; methods return the expression of what was read."""

    def __init__(self, typename: str, order: Order) -> None:
        known = {"text_of_units": _text_of_units, "array": np.frombuffer, "U": np.dtype(f"{order}u4")}
        super().__init__(typename, known)
        self._order = order
        self._names: list[str] = []
        self._begun = False

    def function(self) -> Callable[[bytes], tuple[Any, int]]:
        message = self._construct(self._typename)
        self._flush()
        self._line(f"return {message}, at")
        made: Callable[[bytes], tuple[Any, int]] = self._made("decode(payload)")
        return made

    def _construct(self, typename: str) -> str:
        return f"{self._new(types.get(typename))}({', '.join(self._fields(typename, ''))})"

    def _flush(self) -> None:
        layouts, values = Layouts(self._order, tuple(self._run), origin=4), ", ".join(self._names)
        if not self._begun:
            first = layouts[4,]
            if self._run:
                self._line(f"{values}, = {self._new(first)}.unpack_from(payload, 4)")
            self._line(f"at = {4 + first.size}")
            self._begun = True
        elif self._run:
            self._line(f"layout = {self._new(layouts)}[at & 7,]")
            self._line(f"{values}, = layout.unpack_from(payload, at)")
            self._line("at += layout.size")
        self._run, self._names = [], []

    def _item(self, item: Item) -> str:
        self._run.append(item)
        self._names.append(self._new())
        return self._names[-1]

    def _message(self, field: Field, value: str) -> str:
        return self._construct(field.message)

    def _messages(self, field: Field, value: str) -> str:
        return self._loop(field, lambda: self._construct(field.message))

    def _number(self, code: str, value: str) -> str:
        size = Struct(f"<{code}").size
        return self._item(Item(code, size, size))

    def _text(self, field: Field, value: str) -> str:
        count, text = self._number("I", ""), self._new()
        self._flush()
        if field.base == "wstring":
            self._line(f"{text} = text_of_units(array(payload, U, {count}, at))")
            self._line(f"at += 4 * {count}")
            return text
        self._line(f"end = at + {count}")
        self._line(f"if not {count} or payload[end - 1]: raise ValueError('a text without an end')")
        self._line(f"{text} = payload[at:end - 1].decode()")
        self._line("at = end")
        return text

    def _texts(self, field: Field, value: str) -> str:
        return self._loop(field, lambda: self._text(field, ""))

    def _loop(self, field: Field, item: Callable[[], str]) -> str:
        count = str(field.size) if field.many == "array" else self._number("I", "")
        self._flush()
        many = self._new()
        # Every item has a byte at least: a length that cannot be ends with the payload.
        self._line(f"{many} = []")
        self._line(f"for _ in range({count}):")
        self._indent += 1
        made = item()
        self._flush()
        self._line(f"{many}.append({made})")
        self._indent -= 1
        return many

    def _array(self, field: Field, value: str) -> str:
        native = types.dtype_of(field.base)
        sent = native.newbyteorder(self._order)
        dtype, ordered = self._new(native), ""
        if sent != native:
            dtype, ordered = self._new(sent), f".astype({dtype})"
        if field.many == "array":
            raw = self._item(Item("s", native.itemsize, field.size * native.itemsize))
            return f"array({raw}, {dtype}){ordered}"
        count, many = self._number("I", ""), self._new()
        self._flush()
        if native.itemsize > 4:
            self._line(f"if {count}: at += (4 - at) % {native.itemsize}")
        self._line(f"{many} = array(payload, {dtype}, {count}, at){ordered}")
        self._line(f"at += {count} * {native.itemsize}")
        return many


def _raw(values: NDArray[Any], dtype: np.dtype[Any] | None) -> bytes:
    if values.itemsize != 1 if dtype is None else values.dtype != dtype:
        raise TypeError(f"an array of {values.dtype}")
    return values.tobytes()


@lru_cache(maxsize=256)
def _texts(texts: Sequence[str], wide: bool) -> bytes:
    """Return texts one after the other, the first one aligned: a robot's joints do not change."""
    block = b""
    for text in texts:
        raw = _units(text) if wide else text.encode() + b"\0"
        block += bytes(-len(block) % 4) + _U32.pack(len(raw) // 4 if wide else len(raw)) + raw
    return block


def _units(text: str) -> bytes:
    return np.frombuffer(text.encode("utf-16-le"), "<u2").astype("<u4").tobytes()


def _text_of_units(units: NDArray[np.uint32]) -> str:
    if units.size and int(units.max()) > 0xFFFF:
        raise ValueError(f"{int(units.max())} is no UTF-16 unit")
    return units.astype("<u2").tobytes().decode("utf-16-le")
