"""LZF, the compression of PCD files, as Marc Lehmann's liblzf defines it.

A control byte below 32 is followed by so many bytes and one more, as they are. Any other is a copy of what
was written before: its upper three bits, which 7 extends by a byte, are the length minus 2; its lower five
bits and the next byte are the distance minus 1.
"""

from __future__ import annotations

_LONGEST_LITERAL, _LONGEST_COPY, _FARTHEST = 32, 264, 8192
MOST_GROWTH = _LONGEST_COPY // 3
"""A compressed byte becomes so many bytes, at most."""


def compress(data: bytes) -> bytes:
    """Return data as LZF, where that is longer too."""
    out, seen = bytearray(), dict[bytes, int]()
    literal = at = 0
    end = len(data)
    while at < end - 2:
        key = data[at : at + 3]
        before = seen.get(key, -1)
        seen[key] = at
        if before < 0 or at - before > _FARTHEST:
            at += 1
            continue
        _put_literal(out, data[literal:at])
        length, most = 3, min(_LONGEST_COPY, end - at)
        while length < most and data[before + length] == data[at + length]:
            length += 1
        distance = at - before - 1
        if length < 9:
            out.append((length - 2) << 5 | distance >> 8)
        else:
            out += bytes((7 << 5 | distance >> 8, length - 9))
        out.append(distance & 255)
        at += length
        literal = at
    _put_literal(out, data[literal:])
    return bytes(out)


def _put_literal(out: bytearray, literal: bytes) -> None:
    for start in range(0, len(literal), _LONGEST_LITERAL):
        part = literal[start : start + _LONGEST_LITERAL]
        out.append(len(part) - 1)
        out += part


def decompress(data: bytes, size: int) -> bytes:
    """Return what was compressed; `size` is its length [bytes].

    Raises:
        ValueError: The data are no LZF, or not of so many bytes; tells the byte.
    """
    out = bytearray()
    at, end = 0, len(data)
    try:
        while at < end and len(out) <= size:
            control = data[at]
            at += 1
            if control < _LONGEST_LITERAL:
                out += data[at : at + control + 1]
                at += control + 1
                if at > end:
                    raise IndexError
                continue
            length = control >> 5
            if length == 7:
                length += data[at]
                at += 1
            length += 2
            start = len(out) - ((control & 31) << 8) - data[at] - 1
            at += 1
            if start < 0:
                raise ValueError(f"byte {at - 1} of the compressed data copies from before their beginning")
            copied = out[start : start + length]
            while len(copied) < length:  # it overlaps what it makes
                copied += copied[: length - len(copied)]
            out += copied
    except IndexError:
        raise ValueError(f"the compressed data end at byte {end}, in the middle of a step") from None
    if len(out) != size:
        more = " or more" if len(out) > size else ""
        raise ValueError(f"the compressed data become {len(out)}{more} bytes instead of {size}")
    return bytes(out)
