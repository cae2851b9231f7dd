"""Where a recording's last whole message ends: a full disk, or a copy that was broken off, cuts one."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO

_START = 12
"""Bytes before the first message: who wrote it, and how."""
_HEADER = struct.Struct("<QQ")
"""Of a message: its kind, and how many bytes follow (re_log_encoding, `MessageHeader`)."""
_END = 0
"""Kind of the last message of a recording that has an index."""


def whole_bytes(path: Path, most: int | None = None) -> int:
    """Return how many bytes of a recording are whole messages; 0 if there is none.

    Args:
        path: Of the recording.
        most: Messages that end beyond so many bytes are not counted.

    Raises:
        OSError: It cannot be read.
    """
    size = path.stat().st_size
    most = size if most is None else most
    end = 0
    with path.open("rb") as file:
        place = _START
        while len(header := _seen(file, place)) == _HEADER.size:
            kind, length = _HEADER.unpack(header)
            place += _HEADER.size + length
            if place > most:
                break
            end = place
            if kind == _END:
                return size  # an index of chunks follows, which is no message
    return end


def is_cut(path: Path) -> bool:
    """Tell whether a recording ends within a message.

    Raises:
        OSError: It cannot be read.
    """
    return whole_bytes(path) < path.stat().st_size


def cut_off(path: Path, spare: int) -> None:
    """Cut a recording that nobody writes any more after a whole message; one without any goes.

    Args:
        path: Of the recording.
        spare: So many bytes at its end are given back, at least: what a run has yet to write needs room.

    Raises:
        OSError: It cannot be cut.
    """
    end = whole_bytes(path, path.stat().st_size - spare)
    if end:
        with path.open("rb+") as file:
            file.truncate(end)
    else:
        path.unlink()


def _seen(file: BinaryIO, place: int) -> bytes:
    file.seek(place)
    return file.read(_HEADER.size)
