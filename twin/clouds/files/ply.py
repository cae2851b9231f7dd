"""PLY (Turk 1994): the vertices of a file as a cloud; faces and other elements after them are passed over.

Colours are PLY's `red`, `green`, `blue` there, and PCL's `rgb` here.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from twin.clouds.colours import COLOURS, channels, packed_colour
from twin.clouds.files.encodings import Encoding, Source, shown, text_of
from twin.clouds.points import Points, packed, scalar_fields
from twin.errors import CloudError, nearest

_NAMES = {
    "i1": ("char", "int8"),
    "u1": ("uchar", "uint8"),
    "i2": ("short", "int16"),
    "u2": ("ushort", "uint16"),
    "i4": ("int", "int32"),
    "u4": ("uint", "uint32"),
    "f4": ("float", "float32"),
    "f8": ("double", "float64"),
}
_TYPES = {name: code for code, names in _NAMES.items() for name in names}
_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_PARTS = ("red", "green", "blue")
_MOST = 2**40


def parse_ply(content: bytes, path: Path) -> Points:
    """Return the vertices of a file's content; `path` is for messages.

    Raises:
        CloudError: It is no PLY file, keeps not what its header promises, or has lists before the vertices.
    """
    source = Source(content, path)
    if not content.startswith(b"ply"):
        raise source.fault("is not 'ply', which every PLY file begins with", 1)
    lines, start = source.header("end_header")
    encoding, elements = _declared(source, lines)
    line = len(lines) + 1
    for name, count, dtype, fault in elements:
        if fault is not None:
            raise fault
        if encoding == "ascii":
            points = source.rows(start, line, count, dtype)
        else:
            points = source.binary(start, count, dtype)
        if name == "vertex":
            return _with_packed_colours(packed(points))
        if encoding == "ascii":
            ends = source.content[start:].splitlines(keepends=True)[:count]
            start, line = start + sum(map(len, ends)), line + count
        else:
            start += count * dtype.itemsize
    raise source.fault("the header has no 'element vertex'")


_Element = tuple[str, int, np.dtype[Any], CloudError | None]


def _declared(source: Source, lines: list[str]) -> tuple[str, list[_Element]]:
    """Return the encoding and the elements: name, count, structure, and why that cannot be read."""
    encoding = ""
    elements: list[tuple[str, int, list[tuple[str, str]], list[CloudError]]] = []
    for number, line in enumerate(lines[1:-1], 2):
        match line.split():
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", kind, "1.0"] if kind in _ORDERS:
                encoding = kind
            case ["format", *words]:
                valid = ", ".join(f"{each} 1.0" for each in _ORDERS)
                raise source.fault(f"the format is '{shown(' '.join(words))}'; valid are {valid}", number)
            case ["element", name, count]:
                most = source.whole(count, f"the number of '{shown(name)}'", number, 0, _MOST)
                elements.append((name, most, [], []))
            case ["property", "list", *_] if elements:
                name = elements[-1][0]
                elements[-1][3].append(
                    source.fault(
                        f"'{shown(name)}' has a list; up to the vertices, only numbers can be read",
                        number,
                    )
                )
            case ["property", kind, name] if elements:
                if kind not in _TYPES:
                    raise source.fault(f"'{shown(kind)}' is no type; {nearest(kind, list(_TYPES))}", number)
                if name in dict(elements[-1][2]):
                    raise source.fault(f"there are two properties '{shown(name)}'", number)
                elements[-1][2].append((name, _TYPES[kind]))
            case _:
                raise source.fault(f"'{shown(line)}' is no line of a PLY header", number)
    if not encoding:
        raise source.fault("the header has no line 'format'", len(lines))
    order = _ORDERS[encoding]
    return encoding, [
        (name, count, np.dtype([(field, order + kind) for field, kind in fields]), next(iter(faults), None))
        for name, count, fields, faults in elements
    ]


def ply_of(points: Points, encoding: Encoding) -> bytes:
    """Return a cloud as a file's content; rows of an organised one follow each other.

    Raises:
        CloudError: PLY has no such encoding, or no type for a field.
    """
    if encoding == "binary_compressed":
        raise CloudError("PLY has no encoding 'binary_compressed'; valid are ascii and binary")
    plain = _with_parted_colours(packed(points).reshape(-1))
    kinds = scalar_fields(plain.dtype)
    for name, kind in kinds:
        if kind.shape or kind.str[1:] not in _NAMES:
            raise CloudError(
                f"PLY has no type for the field {name!r} of {kind}; valid are numbers of up to 4 bytes, "
                "and doubles"
            )
    lines = (
        "ply",
        f"format {'ascii' if encoding == 'ascii' else 'binary_little_endian'} 1.0",
        f"element vertex {len(plain)}",
        *(f"property {_NAMES[kind.str[1:]][0]} {name}" for name, kind in kinds),
        "end_header",
    )
    header = "".join(f"{line}\n" for line in lines).encode()
    return header + (text_of(plain) if encoding == "ascii" else plain.tobytes())


def _with_packed_colours(points: Points) -> Points:
    """Return a cloud with `rgb` instead of its three parts, if these are bytes."""
    fields = scalar_fields(points.dtype)
    if any(points.dtype.fields.get(part, (None,))[0] != np.uint8 for part in _PARTS):  # type: ignore[union-attr]
        return points
    kinds = [field for field in fields if field[0] not in _PARTS]
    made = np.empty(points.shape, [*kinds, ("rgb", "<f4")])
    for name, _ in kinds:
        made[name] = points[name]
    made["rgb"] = packed_colour(np.stack([points[part] for part in _PARTS], axis=-1)).view(np.float32)
    return made


def _with_parted_colours(points: Points) -> Points:
    fields = scalar_fields(points.dtype)
    colour = next((name for name, kind in fields if name in COLOURS and kind.str in ("<f4", "<u4")), None)
    if colour is None:
        return points
    kinds = [field for field in fields if field[0] != colour]
    made = np.empty(points.shape, [*kinds, *((part, "u1") for part in _PARTS)])
    for name, _ in kinds:
        made[name] = points[name]
    for part, values in zip(_PARTS, channels(points[colour]).T, strict=False):
        made[part] = values
    return made
