"""The function that encodes a type."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from struct import Struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.bridge import types
from twin.bridge.cdr.layouts import Item, Layouts
from twin.bridge.cdr.maker import MAGIC, Maker
from twin.bridge.types.fields import Field

_U32 = Struct("<I")


@cache
def encoder(typename: str) -> Callable[[Any], bytes]:
    """Return a function that returns a message as CDR, little endian.

    It raises whatever a value that does not fit happens to raise.
    """
    return _Encoder(typename).function()


class _Encoder(Maker):
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
        if field.base == "byte":  # signed or not
            raw = self._variable(f"raw({many}, None)")
        else:
            known = self._new(dtype)
            raw = self._variable(f"{many}.tobytes() if {many}.dtype is {known} else raw({many}, {known})")
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
