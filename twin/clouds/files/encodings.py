"""What files of points share: a header that promises something, and a body of rows that has to keep it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from twin.clouds.points import Points, packed, scalar_fields
from twin.errors import CloudError, Problem, shortened

Encoding = Literal["ascii", "binary", "binary_compressed"]
MOST_BYTES = 1 << 30
"""Of a cloud in memory."""
_LONGEST_HEADER = 1 << 16


@dataclass(frozen=True)
class Source:
    """Content of a file that faults are told of."""

    content: bytes
    path: Path

    def fault(self, message: str, line: int | None = None) -> CloudError:
        """Return a fault in the file, or in a line of it."""
        return CloudError(Problem(message, self.path, line))

    def header(self, last: str) -> tuple[list[str], int]:
        """Return the lines of a header up to the one that begins with `last`, and the byte after them.

        Raises:
            CloudError: There is no such line near the beginning.
        """
        start, lines = 0, list[str]()
        while (end := self.content.find(b"\n", start, _LONGEST_HEADER)) >= 0:
            lines.append(self.content[start:end].decode("utf-8", "replace").strip())
            start = end + 1
            if lines[-1].split(maxsplit=1)[:1] == [last]:
                return lines, start
        raise self.fault(
            f"no line '{last}' ends the header; is the file whole, and of the kind its ending says?"
        )

    def whole(self, word: str, what: str, line: int, least: int, most: int) -> int:
        """Return a number of the header.

        Raises:
            CloudError: It is something else.
        """
        if not (word.isascii() and word.isdigit() and len(word) <= 20 and least <= int(word) <= most):
            raise self.fault(f"{what} is '{word[:30]}'; valid is a whole number from {least} to {most}", line)
        return int(word)

    def binary(self, start: int, count: int, dtype: np.dtype[Any]) -> Points:
        """Return rows of a structure that begin at a byte.

        Raises:
            CloudError: There are fewer.
        """
        have = (len(self.content) - start) // max(dtype.itemsize, 1)
        if have < count:
            raise self.fault(
                f"ends at byte {len(self.content)}, after {have} points of {dtype.itemsize} bytes; "
                f"the header promises {count}"
            )
        return np.frombuffer(self.content, dtype, count, start)

    def rows(self, start: int, first_line: int, count: int, dtype: np.dtype[Any]) -> Points:
        """Return rows of text, a point each, that begin at a byte and a line; empty lines are passed over.

        Raises:
            CloudError: There are fewer, or one holds anything else than its numbers.
        """
        lines = self.content[start:].decode("utf-8", "replace").split("\n")
        at = [i for i, line in enumerate(lines) if line and not line.isspace()][:count]
        if len(at) < count:
            raise self.fault(
                f"has {len(at)} points; the header promises {count}", first_line + len(lines) - 2
            )
        kinds = [kind for name in dtype.names or () for kind in [dtype[name].base] * _numbers(dtype[name])]
        flat = np.dtype([(f"f{i}", kind) for i, kind in enumerate(kinds)])
        texts = [lines[i] for i in at]
        try:
            table = _table(texts, flat)
        except (ValueError, OverflowError):
            i = _first_fault(texts, flat)
            names = shortened(dtype.names or ())
            raise self.fault(
                f"is '{shown(texts[i])}'; valid are numbers for {names}", first_line + at[i]
            ) from None
        return table.view(dtype) if dtype.itemsize == flat.itemsize else _regrouped(table, dtype)


def shown(text: str) -> str:
    """Return the beginning of a text of a file."""
    return text if len(text) <= 60 else f"{text[:60]}..."


def _numbers(kind: np.dtype[Any]) -> int:
    return int(np.prod(kind.shape, dtype=np.int64))


def _table(lines: list[str], dtype: np.dtype[Any]) -> Points:
    if not lines:
        return np.zeros(0, dtype)
    return np.atleast_1d(np.loadtxt(lines, dtype, comments=None))


def _first_fault(lines: list[str], dtype: np.dtype[Any]) -> int:
    """Return the index of the first line that is no row: by halves, as one by one would take long."""
    low, high = 0, len(lines)
    while high - low > 1:
        middle = (low + high) // 2
        try:
            _table(lines[low:middle], dtype)
        except (ValueError, OverflowError):
            high = middle
        else:
            low = middle
    return low


def _regrouped(table: Points, dtype: np.dtype[Any]) -> Points:
    """Return the rows in a structure with padding."""
    made = np.zeros(len(table), dtype)
    flat = table.view(np.dtype([(name, dtype[name]) for name in dtype.names or ()]))
    for name in dtype.names or ():
        made[name] = flat[name]
    return made


def text_of(points: Points) -> bytes:
    """Return a line for each point, with as few digits as lead back to the same numbers."""
    flat = packed(points).reshape(-1)
    columns: list[NDArray[np.str_]] = []
    for name, kind in scalar_fields(flat.dtype):
        columns += [values.astype(np.str_) for values in flat[name].reshape(len(flat), _numbers(kind)).T]
    lines: Iterable[tuple[str, ...]] = zip(*columns, strict=True)
    return "".join(f"{' '.join(line)}\n" for line in lines).encode()
