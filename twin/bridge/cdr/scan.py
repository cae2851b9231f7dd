"""Packed codec of LaserScan, which several nodes of a robot decode at the lidar's rate."""

from __future__ import annotations

from struct import Struct

import numpy as np
from numpy.typing import NDArray

from twin.bridge.cdr.packed import read_text
from twin.bridge.msgs import Header, LaserScan, Time

_HEAD = Struct("<4siII")
_NUMBERS = Struct("<7f")
_U32 = Struct("<I")


def encode_scan(message: LaserScan) -> bytes:
    """Return a LaserScan as CDR."""
    stamp, frame = message.header.stamp, message.header.frame_id.encode() + b"\0"
    numbers = _NUMBERS.pack(
        message.angle_min,
        message.angle_max,
        message.angle_increment,
        message.time_increment,
        message.scan_time,
        message.range_min,
        message.range_max,
    )
    head = _HEAD.pack(b"\x00\x01\x00\x00", stamp.sec, stamp.nanosec, len(frame)) + frame
    padding = b"\0" * (-len(head) % 4)
    return head + padding + numbers + _floats(message.ranges) + _floats(message.intensities)


def decode_scan(payload: bytes) -> tuple[LaserScan, int]:
    """Return a LaserScan from little-endian CDR, and where it ends."""
    _, sec, nanosec, _ = _HEAD.unpack_from(payload)
    frame, at = read_text(payload, 12)
    at += -at % 4
    start, end, increment, between, duration, nearest, farthest = _NUMBERS.unpack_from(payload, at)
    ranges, at = _read_floats(payload, at + _NUMBERS.size)
    intensities, at = _read_floats(payload, at)
    scan = LaserScan(
        Header(Time(sec, nanosec), frame),
        start,
        end,
        increment,
        between,
        duration,
        nearest,
        farthest,
        ranges,
        intensities,
    )
    return scan, at


def _floats(values: NDArray[np.float32]) -> bytes:
    if values.dtype != np.float32:
        raise ValueError(f"an array of {values.dtype} where the message has float32")
    return _U32.pack(len(values)) + values.tobytes()


def _read_floats(payload: bytes, at: int) -> tuple[NDArray[np.float32], int]:
    """Read a sequence of numbers at `at`; return it and where it ends."""
    (count,) = _U32.unpack_from(payload, at)
    at += 4
    if count * 4 > len(payload) - at:
        raise ValueError(f"{count} values do not fit")
    return np.frombuffer(payload, np.float32, count, at), at + 4 * count
