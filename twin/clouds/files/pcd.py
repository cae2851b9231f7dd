"""PCD 0.7, the Point Cloud Library's format: a header of text, then numbers as text or bytes.

VIEWPOINT, where the sensor was, is passed over in reading and written as the origin; so are the paddings `_`.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

from twin.clouds.colours import COLOURS
from twin.clouds.files.encodings import MOST_BYTES, Encoding, Source, shown, text_of
from twin.clouds.files.lzf import MOST_GROWTH, compress, decompress
from twin.clouds.points import Points, packed, scalar_fields
from twin.errors import nearest

_KINDS = {"I": "i", "U": "u", "F": "f"}
_SIZES = {"I": (1, 2, 4, 8), "U": (1, 2, 4, 8), "F": (4, 8)}
_PADDING = "_"
_KEYS = ("FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA", "VERSION")
_OLD_KEYS = {"COLUMNS": "FIELDS"}
_LENGTHS = struct.Struct("<II")
"""Of compressed and of plain data, before the compressed ones."""
_MOST, _MOST_FIELDS, _MOST_COUNT = 2**40, 256, 4096


class _Header:
    """Lines of a header by their key."""

    def __init__(self, source: Source) -> None:
        self.source = source
        lines, self.end = source.header("DATA")
        self.count = len(lines)
        self._found: dict[str, tuple[list[str], int]] = {}
        for number, line in enumerate(lines, 1):
            key, *words = line.split() or ["#"]
            if key.startswith("#"):
                continue
            key = _OLD_KEYS.get(key, key)
            if key not in _KEYS:
                raise source.fault(
                    f"'{shown(key)}' is no line of a PCD header; {nearest(key, _KEYS)}", number
                )
            self._found[key] = words, number

    def words(self, key: str, expected: int | None = None, default: str = "") -> tuple[list[str], int]:
        """Return what follows a key, and its line."""
        if key not in self._found and default:
            return [default] * (expected or 1), self.count
        if key not in self._found:
            raise self.source.fault(f"the header has no line {key}", self.count)
        words, line = self._found[key]
        if expected is not None and len(words) != expected:
            what = "value" if expected == 1 else "values, one for each of FIELDS"
            raise self.source.fault(f"{key} has {len(words)}; valid is {expected} {what}", line)
        return words, line

    def number(self, key: str, default: str = "") -> int:
        (word,), line = self.words(key, 1, default)
        return self.source.whole(word, key, line, 0, _MOST)

    def dtype(self) -> np.dtype[Any]:
        """Return the fields of a point, with paddings as what they are."""
        names, line = self.words("FIELDS")
        if not 0 < len(names) <= _MOST_FIELDS:
            raise self.source.fault(f"FIELDS names {len(names)}; valid is 1 to {_MOST_FIELDS}", line)
        sizes, size_line = self.words("SIZE", len(names))
        types, type_line = self.words("TYPE", len(names))
        counts, count_line = self.words("COUNT", len(names), "1")
        fields: list[tuple[Any, ...]] = []
        seen: set[str] = set()
        for i, (name, letter) in enumerate(zip(names, types, strict=True)):
            if letter not in _KINDS:
                raise self.source.fault(
                    f"TYPE of '{shown(name)}' is '{shown(letter)}'; valid are I, U, F", type_line
                )
            if sizes[i] not in map(str, _SIZES[letter]):
                valid = ", ".join(map(str, _SIZES[letter]))
                raise self.source.fault(
                    f"SIZE of '{shown(name)}' is '{shown(sizes[i])}'; valid for {letter} are {valid}",
                    size_line,
                )
            count = self.source.whole(counts[i], f"COUNT of '{shown(name)}'", count_line, 1, _MOST_COUNT)
            if name in seen and name != _PADDING:
                raise self.source.fault(f"FIELDS has '{shown(name)}' twice", line)
            seen.add(name)
            unique = f"{_PADDING}{i}{_PADDING}" if name == _PADDING else name
            kind = f"<{_KINDS[letter]}{sizes[i]}"
            fields.append((unique, kind) if count == 1 else (unique, kind, (count,)))
        return np.dtype(fields)

    def is_padding(self, index: int) -> bool:
        """Whether a field is none."""
        return self.words("FIELDS")[0][index] == _PADDING


def parse_pcd(content: bytes, path: Path) -> Points:
    """Return the cloud of a file's content; `path` is for messages.

    Raises:
        CloudError: It is no PCD file, or keeps not what its header promises.
    """
    source = Source(content, path)
    header = _Header(source)
    dtype = header.dtype()
    width, height = header.number("WIDTH"), header.number("HEIGHT", "1")
    count = header.number("POINTS", str(width * height))
    if width * height != count:
        _, line = header.words("POINTS")
        raise source.fault(
            f"POINTS is {count}; WIDTH {width} times HEIGHT {height} is {width * height}", line
        )
    (encoding,), line = header.words("DATA", 1)
    if encoding == "ascii":
        points = source.rows(header.end, header.count + 1, count, dtype)
    elif encoding == "binary":
        points = source.binary(header.end, count, dtype)
    elif encoding == "binary_compressed":
        points = _decompressed(source, header.end, count, dtype)
    else:
        raise source.fault(f"DATA is '{shown(encoding)}'; valid are ascii, binary, binary_compressed", line)
    kept = [name for i, name in enumerate(dtype.names or ()) if not header.is_padding(i)]
    return packed(points[kept]).reshape((height, width) if height > 1 and width else count)


def _decompressed(source: Source, start: int, count: int, dtype: np.dtype[Any]) -> Points:
    """Return points that were stored field by field."""
    if len(source.content) < start + _LENGTHS.size:
        raise source.fault(f"ends at byte {len(source.content)}, before the lengths of its compressed data")
    length, size = _LENGTHS.unpack_from(source.content, start)
    first = start + _LENGTHS.size
    data = source.content[first : first + length]
    if len(data) < length:
        raise source.fault(
            f"ends at byte {len(source.content)}; the compressed data end at byte {first + length}"
        )
    if size != count * dtype.itemsize:
        raise source.fault(
            f"the number at byte {start + 4} is {size}; {count} points of {dtype.itemsize} bytes "
            f"are {count * dtype.itemsize} bytes"
        )
    if size > min(MOST_BYTES, MOST_GROWTH * length):
        raise source.fault(
            f"the number at byte {start + 4} is {size}; {length} compressed bytes become at most "
            f"{min(MOST_BYTES, MOST_GROWTH * length)}"
        )
    try:
        plain = decompress(data, size)
    except ValueError as fault:
        raise source.fault(f"{fault}, counted from byte {first}") from None
    points = np.empty(count, dtype)
    at = 0
    for name in dtype.names or ():
        kind = dtype[name]
        values = np.frombuffer(plain, kind.base, count * int(np.prod(kind.shape, dtype=int)), at)
        points[name] = values.reshape((count, *kind.shape))
        at += values.nbytes
    return points


def pcd_of(points: Points, encoding: Encoding) -> bytes:
    """Return a cloud as a file's content.

    As text, colours are whole numbers, as PCL writes them: a float would not keep all their bits.

    Raises:
        CloudError: The cloud has a field that is no number.
    """
    plain = packed(points)
    if encoding == "ascii":
        plain = _with_whole_colours(plain)
    fields = scalar_fields(plain.dtype)
    letters = {kind: letter for letter, kind in _KINDS.items()}
    height, width = plain.shape if plain.ndim == 2 else (1, len(plain))
    lines = (
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        f"FIELDS {' '.join(name for name, _ in fields)}",
        f"SIZE {' '.join(str(kind.base.itemsize) for _, kind in fields)}",
        f"TYPE {' '.join(letters[kind.base.kind] for _, kind in fields)}",
        f"COUNT {' '.join(str(int(np.prod(kind.shape, dtype=int))) for _, kind in fields)}",
        f"WIDTH {width}",
        f"HEIGHT {height}",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {plain.size}",
        f"DATA {encoding}",
    )
    header = "".join(f"{line}\n" for line in lines).encode()
    if encoding == "ascii":
        return header + text_of(plain)
    if encoding == "binary":
        return header + plain.tobytes()
    by_field = b"".join(np.ascontiguousarray(plain[name]).tobytes() for name, _ in fields)
    data = compress(by_field)
    return header + _LENGTHS.pack(len(data), len(by_field)) + data


def _with_whole_colours(points: Points) -> Points:
    kinds = [
        (name, np.dtype("<u4") if name in COLOURS and kind == np.float32 else kind)
        for name, kind in scalar_fields(points.dtype)
    ]
    return points.view(np.dtype(kinds))
