"""Packed codecs of the messages that a robot sends at control rate: Odometry, Imu, JointState.

Each is a header of texts, whose layout is cached by the texts' lengths, and a block of doubles.
"""

from __future__ import annotations

from functools import lru_cache
from struct import Struct

import numpy as np
from numpy.typing import NDArray

from twin.bridge.msgs import (
    Header,
    Imu,
    JointState,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Time,
    Twist,
    TwistWithCovariance,
    Vector3,
)

MAGIC = b"\x00\x01\x00\x00"
"""The encapsulation header of plain CDR, little endian."""
U32 = Struct("<I")
STAMP = Struct("<iI")
POSE = Struct("<7d")
_ODOMETRY_NUMBERS = Struct("<7d288s6d288s")
_IMU_NUMBERS = Struct("<4d72s3d72s3d72s")


@lru_cache(maxsize=256)
def _texts(*texts: str) -> bytes:
    """Return texts as CDR strings, padded for doubles to follow; they come after a stamp, so aligned to 8."""
    block = b""
    for text in texts:
        block += b"\0" * (-len(block) % 4) + _text(text)
    return block + b"\0" * (-len(block) % 8)


def _text(text: str) -> bytes:
    raw = text.encode() + b"\0"
    return U32.pack(len(raw)) + raw


def pack_header(header: Header) -> bytes:
    """Return a header as CDR, without the padding after it."""
    return STAMP.pack(header.stamp.sec, header.stamp.nanosec) + _text(header.frame_id)


def read_header(payload: bytes) -> tuple[Header, int]:
    """Read the header that a payload begins with; return it and where it ends."""
    frame, at = read_text(payload, 12)
    return Header(Time(*STAMP.unpack_from(payload, 4)), frame), at


def read_count(payload: bytes, at: int) -> tuple[int, int]:
    """Read how many elements a sequence at `at` has; return it and where they begin, if they need no padding.

    Raises:
        ValueError: more than the payload has bytes.
    """
    at += -at % 4
    (count,) = U32.unpack_from(payload, at)
    if count > len(payload):
        raise ValueError(f"{count} elements do not fit")
    return count, at + 4


def encode_odometry(message: Odometry) -> bytes:
    """Return an Odometry as CDR."""
    stamp, pose, twist = message.header.stamp, message.pose, message.twist
    p, q, v, w = pose.pose.position, pose.pose.orientation, twist.twist.linear, twist.twist.angular
    return (
        MAGIC
        + STAMP.pack(stamp.sec, stamp.nanosec)
        + _texts(message.header.frame_id, message.child_frame_id)
        + _ODOMETRY_NUMBERS.pack(
            p.x, p.y, p.z, q.x, q.y, q.z, q.w,
            _doubles(pose.covariance, 36),
            v.x, v.y, v.z, w.x, w.y, w.z,
            _doubles(twist.covariance, 36),
        )
    )  # fmt: skip


def decode_odometry(payload: bytes) -> tuple[Odometry, int]:
    """Return an Odometry from little-endian CDR, and where it ends."""
    stamp, (frame, child), at = _read_head(payload, 2, _ODOMETRY_NUMBERS.size)
    x, y, z, qx, qy, qz, qw, pose_covariance, *twist, twist_covariance = _ODOMETRY_NUMBERS.unpack_from(
        payload, at
    )
    vx, vy, vz, wx, wy, wz = twist
    odometry = Odometry(
        Header(stamp, frame),
        child,
        PoseWithCovariance(
            Pose(Point(x, y, z), Quaternion(qx, qy, qz, qw)), np.frombuffer(pose_covariance, np.float64)
        ),
        TwistWithCovariance(
            Twist(Vector3(vx, vy, vz), Vector3(wx, wy, wz)), np.frombuffer(twist_covariance, np.float64)
        ),
    )
    return odometry, at + _ODOMETRY_NUMBERS.size


def encode_imu(message: Imu) -> bytes:
    """Return an Imu as CDR."""
    stamp, q = message.header.stamp, message.orientation
    w, a = message.angular_velocity, message.linear_acceleration
    return (
        MAGIC
        + STAMP.pack(stamp.sec, stamp.nanosec)
        + _texts(message.header.frame_id)
        + _IMU_NUMBERS.pack(
            q.x, q.y, q.z, q.w,
            _doubles(message.orientation_covariance, 9),
            w.x, w.y, w.z,
            _doubles(message.angular_velocity_covariance, 9),
            a.x, a.y, a.z,
            _doubles(message.linear_acceleration_covariance, 9),
        )
    )  # fmt: skip


def decode_imu(payload: bytes) -> tuple[Imu, int]:
    """Return an Imu from little-endian CDR, and where it ends."""
    stamp, (frame,), at = _read_head(payload, 1, _IMU_NUMBERS.size)
    qx, qy, qz, qw, co, wx, wy, wz, cw, ax, ay, az, ca = _IMU_NUMBERS.unpack_from(payload, at)
    imu = Imu(
        Header(stamp, frame),
        Quaternion(qx, qy, qz, qw),
        np.frombuffer(co, np.float64),
        Vector3(wx, wy, wz),
        np.frombuffer(cw, np.float64),
        Vector3(ax, ay, az),
        np.frombuffer(ca, np.float64),
    )
    return imu, at + _IMU_NUMBERS.size


@lru_cache(maxsize=64)
def _names(frame: str, names: tuple[str, ...]) -> bytes:
    """Return a JointState from its frame to its names; it starts 8 bytes after the stamp's start."""
    block = _text(frame)
    block += b"\0" * (-len(block) % 4) + U32.pack(len(names))
    for name in names:
        block += b"\0" * (-len(block) % 4) + _text(name)
    return block


def encode_joint_state(message: JointState) -> bytes:
    """Return a JointState as CDR."""
    stamp = message.header.stamp
    block = STAMP.pack(stamp.sec, stamp.nanosec) + _names(message.header.frame_id, tuple(message.name))
    for values in (message.position, message.velocity, message.effort):
        block += b"\0" * (-len(block) % 4) + U32.pack(len(values))
        if len(values):
            block += b"\0" * (-len(block) % 8) + _doubles(values, len(values))
    return MAGIC + block


def decode_joint_state(payload: bytes) -> tuple[JointState, int]:
    """Return a JointState from little-endian CDR, and where it ends."""
    stamp = Time(*STAMP.unpack_from(payload, 4))
    # A robot's joints do not change: the names are read once for all payloads that begin alike.
    known = _joint_names.get(len(payload))
    if known is not None and payload.startswith(known[0], 12):
        prefix, frame, names = known
        arrays, end = _read_arrays(payload, 12 + len(prefix))
        return JointState(Header(stamp, frame), list(names), *arrays), end
    frame, names, at = _read_names(payload)
    if len(_joint_names) >= _MOST_LENGTHS:  # no robot's: somebody sends all kinds of things
        _joint_names.clear()
    _joint_names[len(payload)] = (payload[12:at], frame, names)
    arrays, end = _read_arrays(payload, at)
    return JointState(Header(stamp, frame), names, *arrays), end


_MOST_LENGTHS = 64
_joint_names: dict[int, tuple[bytes, str, list[str]]] = {}
"""By length of the payload: its bytes from frame to names, and what they mean."""


def _read_names(payload: bytes) -> tuple[str, list[str], int]:
    frame, at = read_text(payload, 12)
    count, at = read_count(payload, at)
    names = []
    for _ in range(count):
        name, at = read_text(payload, at)
        names.append(name)
    return frame, names, at


def _read_arrays(payload: bytes, at: int) -> tuple[list[NDArray[np.float64]], int]:
    arrays = []
    for _ in range(3):
        count, at = read_count(payload, at)
        if count:
            at += (4 - at) % 8
        if count * 8 > len(payload) - at:
            raise ValueError(f"{count} values do not fit")
        arrays.append(np.frombuffer(payload, np.float64, count, at))
        at += 8 * count
    return arrays, at


def _doubles(values: NDArray[np.float64], count: int) -> bytes:
    raw = np.ascontiguousarray(values, dtype=np.float64).tobytes()
    if len(raw) != 8 * count:
        raise ValueError(f"{len(raw) // 8} numbers where the message has {count}")
    return raw


def read_text(payload: bytes, at: int) -> tuple[str, int]:
    """Read a string at `at`; return it and where it ends."""
    at += -at % 4
    (length,) = U32.unpack_from(payload, at)
    end = at + 4 + length
    if length == 0 or end > len(payload) or payload[end - 1]:
        raise ValueError(f"a string of {length} bytes does not fit, or has no end")
    return payload[at + 4 : end - 1].decode(), end


def _read_head(payload: bytes, texts: int, after: int) -> tuple[Time, tuple[str, ...], int]:
    """Read stamp and texts, which `after` bytes follow; return them and where the doubles start."""
    stamp, at = Time(*STAMP.unpack_from(payload, 4)), len(payload) - after
    if 0 < at - 12 <= _LONGEST_KNOWN:  # a publisher's texts do not change: they are read once
        found, end = _known_texts(payload[12:at], texts)
        if end == at:
            return stamp, found, at
    return stamp, *_read_texts(payload[12:], texts)


_LONGEST_KNOWN = 256
"""No more bytes of texts are kept, whatever is sent."""


def _read_texts(block: bytes, texts: int) -> tuple[tuple[str, ...], int]:
    """Read texts that begin 12 bytes into a payload; return them and where in it the doubles start."""
    found, at = [], 0
    for _ in range(texts):
        text, at = read_text(block, at)
        found.append(text)
    return tuple(found), 12 + at + -at % 8


_known_texts = lru_cache(maxsize=256)(_read_texts)
