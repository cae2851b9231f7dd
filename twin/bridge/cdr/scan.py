"""Packed codec of LaserScan, which several nodes of a robot decode at the lidar's rate."""

from __future__ import annotations

from struct import Struct

import numpy as np
from numpy.typing import NDArray

from twin.bridge.cdr.packed import MAGIC, U32, pack_header, read_count, read_header
from twin.bridge.msgs import LaserScan

_NUMBERS = Struct("<7f")


def encode_scan(message: LaserScan) -> bytes:
    """Return a LaserScan as CDR."""
    numbers = _NUMBERS.pack(
        message.angle_min,
        message.angle_max,
        message.angle_increment,
        message.time_increment,
        message.scan_time,
        message.range_min,
        message.range_max,
    )
    head = MAGIC + pack_header(message.header)
    padding = b"\0" * (-len(head) % 4)
    return head + padding + numbers + _floats(message.ranges) + _floats(message.intensities)


def decode_scan(payload: bytes) -> tuple[LaserScan, int]:
    """Return a LaserScan from little-endian CDR, and where it ends."""
    header, at = read_header(payload)
    at += -at % 4
    numbers = _NUMBERS.unpack_from(payload, at)
    ranges, at = _read_floats(payload, at + _NUMBERS.size)
    intensities, at = _read_floats(payload, at)
    return LaserScan(header, *numbers, ranges, intensities), at  # type: ignore[call-arg]


def _floats(values: NDArray[np.float32]) -> bytes:
    if values.dtype != np.float32:
        raise ValueError(f"an array of {values.dtype} where the message has float32")
    return U32.pack(len(values)) + values.tobytes()


def _read_floats(payload: bytes, at: int) -> tuple[NDArray[np.float32], int]:
    """Read a sequence of numbers at `at`; return it and where it ends."""
    count, at = read_count(payload, at)
    if count * 4 > len(payload) - at:
        raise ValueError(f"{count} values do not fit")
    return np.frombuffer(payload, np.float32, count, at), at + 4 * count
