"""Structs for runs of fields, whose padding depends on where the run begins and on how long its texts are."""

from __future__ import annotations

from struct import Struct
from typing import NamedTuple

from twin.bridge.types.literals import INTEGERS

CODES = {"bool": "?", "byte": "b", "char": "B", "float32": "f", "float64": "d"} | {
    base: {"8": "b", "16": "h", "32": "i", "64": "q"}[base.partition("int")[2]]
    for base in INTEGERS
    if base.startswith("int")
}
CODES |= {f"u{base}": code.upper() for base, code in CODES.items() if base.startswith("int")}
"""Base type -> code of a struct."""
_MOST = 1024
"""So many structs are kept of a run; with other lengths they are made again."""


class Item(NamedTuple):
    """One value of a run."""

    code: str
    """Of a struct; `s` for bytes."""
    align: int
    size: int | None
    """Bytes; None if it is told when there is a message."""


class Layouts(dict[tuple[int, ...], Struct]):
    """The structs of a run, by where it begins (mod 8) and the sizes of its items that have no fixed one."""

    def __init__(self, order: str, items: tuple[Item, ...], *, head: str = "", origin: int = 0) -> None:
        """Describe a run.

        Args:
            order: `<` or `>`.
            items: What is in it.
            head: What comes before it and does not count for alignment.
            origin: Position from which alignment counts.
        """
        super().__init__()
        self._order, self._items, self._head, self._origin = order, items, head, origin

    def __missing__(self, key: tuple[int, ...]) -> Struct:
        if len(self) >= _MOST:
            self.clear()
        at, *sizes = key
        layout = self._order + self._head
        for code, align, fixed in self._items:
            size = sizes.pop(0) if fixed is None else fixed
            before = (self._origin - at) % align if size else 0  # an empty sequence is not aligned
            layout += f"{before}x{size}s" if code == "s" else f"{before}x{code}"
            at += before + size
        found = self[key] = Struct(layout)
        return found
