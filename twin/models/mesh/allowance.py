"""What one COLLADA file may ask for: without a bound, one of a megabyte can take hours and all memory."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

MOST_PIECES = 20_000
"""Nodes, transforms, instances and lists of triangles, as often as the scene goes through them."""
MOST_NUMBERS = 16_000_000
"""360 000 triangles with normals and colours have less."""
_CHUNK = 1 << 20


class Allowance:
    """Counts what is taken of both."""

    def __init__(self) -> None:
        self._pieces = MOST_PIECES
        self._numbers = MOST_NUMBERS

    def take_piece(self) -> None:
        """Take note of one more piece.

        Raises:
            ValueError: That is too many.
        """
        self._pieces -= 1
        if self._pieces < 0:
            raise ValueError(f"has a scene of more than {MOST_PIECES} nodes, transforms and instances in all")

    def numbers(self, text: str | None, kind: type[np.number[Any]]) -> NDArray[Any]:
        """Return the numbers of a text, shape (n,), of a type such as `np.float64`.

        Raises:
            ValueError: There is something else, or there are too many.
        """
        data = (text or "").encode()
        count = _words(data)
        self._numbers -= count
        if self._numbers < 0:
            raise ValueError(f"has more than {MOST_NUMBERS} numbers")
        if not count:
            return np.zeros(0, kind)
        values = np.fromstring(data, kind, sep=" ")  # unlike split(), this takes no memory for words
        if len(values) != count:
            raise ValueError("has something else among its numbers")
        return values


def _words(data: bytes) -> int:
    if len(data) < _CHUNK:
        return len(data.split())
    count, was_blank = 0, True
    for start in range(0, len(data), _CHUNK):
        blank = np.frombuffer(data, np.uint8, min(_CHUNK, len(data) - start), start) <= ord(" ")
        count += int(np.count_nonzero(blank[:-1] & ~blank[1:])) + int(was_blank and not blank[0])
        was_blank = bool(blank[-1])
    return count
