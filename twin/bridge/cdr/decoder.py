"""The function that decodes a type."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from struct import Struct
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from twin.bridge import types
from twin.bridge.cdr.layouts import Item, Layouts
from twin.bridge.cdr.maker import Maker
from twin.bridge.types.fields import Field

Order = Literal["<", ">"]
"""Little or big endian."""


@cache
def decoder(typename: str, order: Order) -> Callable[[bytes], tuple[Any, int]]:
    """Return a function that returns the message that a payload begins with, and where it ends.

    It raises whatever bytes that are no such message happen to raise. `order` is `<` or `>`.
    """
    return _Decoder(typename, order).function()


class _Decoder(Maker):
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


def _text_of_units(units: NDArray[np.uint32]) -> str:
    if units.size and int(units.max()) > 0xFFFF:
        raise ValueError(f"{int(units.max())} is no UTF-16 unit")
    return units.astype("<u2").tobytes().decode("utf-16-le")
