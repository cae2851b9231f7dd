"""Messages to CDR bytes and back: rosbags' codec in general, packed structs for the hot types.

A fast path gives the same bytes as the general one (tested); the general one reads big endian. What follows
a message is ignored, as in ROS 2: its own serializer returns a buffer of an estimated size.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, lru_cache
from itertools import chain
from operator import attrgetter
from struct import Struct, pack, unpack_from
from typing import Any, Generic, TypeVar

from rosbags.interfaces import Nodetype

from twin.bridge import types
from twin.bridge.cdr import packed
from twin.bridge.cdr.general import read_cdr
from twin.bridge.cdr.packed import MAGIC, POSE, STAMP, U32, pack_header, read_count, read_header, read_text
from twin.bridge.cdr.path import decode_path, encode_path
from twin.bridge.cdr.scan import decode_scan, encode_scan
from twin.bridge.cdr.wide import decode_wide, encode_wide, is_wide
from twin.bridge.messages.from_values import checked
from twin.bridge.msgs import (
    Clock,
    Header,
    Imu,
    JointState,
    LaserScan,
    Odometry,
    Path,
    Point,
    Pose,
    PoseArray,
    Quaternion,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Twist,
    Vector3,
)
from twin.bridge.types.fields import array_types

M = TypeVar("M")
_Read = Callable[[bytes], tuple[M, int]]
_Functions = tuple[Callable[[M], bytes], _Read[M]]

_TWIST = Struct("<4s6d")
_CLOCK = Struct("<4siI")


class Codec(Generic[M]):
    """How one message type travels; what that needs is made for the first message."""

    def __init__(self, msg_type: type[M] | str, functions: Callable[[type[M]], _Functions[M]]) -> None:
        self._given = msg_type
        self.msgtype: str = msg_type if isinstance(msg_type, str) else msg_type.__msgtype__  # type: ignore[attr-defined]
        """package/msg/Name."""
        self._functions = functions

    @cached_property
    def cls(self) -> type[M]:
        """The messages' class."""
        return types.get(self._given) if isinstance(self._given, str) else self._given

    @cached_property
    def encode(self) -> Callable[[M], bytes]:
        """Takes a message; raises BridgeError, naming the field, if one has a value that it cannot hold."""
        return _explained(self._functions(self.cls)[0])

    @cached_property
    def read(self) -> _Read[M]:
        """Returns the message and where in the payload it ends.

        Raises on bytes that do not begin with such a message; which exception is not specified. Takes no more
        memory than some times the payload, whatever lengths the payload tells.
        """
        return self._functions(self.cls)[1]

    def decode(self, payload: bytes) -> M:
        """Return the message; raises what `read` does."""
        return self.read(payload)[0]


def codec(msg_type: type[M] | str) -> Codec[M]:
    """Return the codec of a message class; by its full name the class is not made before it is needed."""
    return Codec(msg_type, _fastest)


def general_codec(cls: type[M]) -> Codec[M]:
    """Return rosbags' codec of a message class."""
    return Codec(cls, _general)


def _fastest(cls: type[M]) -> _Functions[M]:
    return _FAST.get(cls.__msgtype__) or _of_only_a_path(cls) or _general(cls)  # type: ignore[attr-defined]


def _general(cls: type[M]) -> _Functions[M]:
    msgtype: str = cls.__msgtype__  # type: ignore[attr-defined]
    if is_wide(msgtype):
        return encode_wide, lambda payload: decode_wide(payload, msgtype)
    serialize = types.store.serialize_cdr
    arrays = array_types(msgtype)

    def encode(message: M) -> bytes:
        for read, dtype in arrays:  # rosbags would send the bytes of another type of numbers as they are
            if read(message).dtype != dtype:
                message = checked(message)
                break
        return bytes(serialize(message, msgtype, little_endian=True))

    return encode, lambda payload: read_cdr(types.store, payload, msgtype)


def _explained(encode: Callable[[M], bytes]) -> Callable[[M], bytes]:
    """Return `encode` that repairs what it can, such as a list of numbers, and names the field otherwise."""

    def explained(message: M) -> bytes:
        try:
            return encode(message)
        except Exception:
            return encode(checked(message))

    return explained


def _encode_twist(message: Twist) -> bytes:
    v, w = message.linear, message.angular
    return _TWIST.pack(MAGIC, v.x, v.y, v.z, w.x, w.y, w.z)


def _decode_twist(payload: bytes) -> tuple[Twist, int]:
    _, vx, vy, vz, wx, wy, wz = _TWIST.unpack_from(payload)
    return Twist(Vector3(vx, vy, vz), Vector3(wx, wy, wz)), _TWIST.size


def _encode_clock(message: Clock) -> bytes:
    return _CLOCK.pack(MAGIC, message.clock.sec, message.clock.nanosec)


def _decode_clock(payload: bytes) -> tuple[Clock, int]:
    _, sec, nanosec = _CLOCK.unpack_from(payload)
    return Clock(Time(sec, nanosec)), _CLOCK.size


@lru_cache(maxsize=4096)
def _transform_struct(phase: int, frame_id: str, child_frame_id: str) -> tuple[Struct, bytes, bytes]:
    """Return the layout of a TransformStamped at `phase` bytes (mod 8) into the payload, and its texts."""
    frame, child = frame_id.encode() + b"\0", child_frame_id.encode() + b"\0"
    before = -phase % 4
    end = phase + before + 8 + 4 + len(frame)
    middle = -end % 4
    end += middle + 4 + len(child)
    after = -end % 8
    return Struct(f"<{before}xiII{len(frame)}s{middle}xI{len(child)}s{after}x7d"), frame, child


def _encode_tf(message: TFMessage) -> bytes:
    chunks = [MAGIC + U32.pack(len(message.transforms))]
    at = 4
    for item in message.transforms:
        head, t, q = item.header, item.transform.translation, item.transform.rotation
        layout, frame, child = _transform_struct(at % 8, head.frame_id, item.child_frame_id)
        time = head.stamp
        chunks.append(
            layout.pack(
                time.sec, time.nanosec, len(frame), frame, len(child), child,
                t.x, t.y, t.z, q.x, q.y, q.z, q.w,
            )
        )  # fmt: skip
        at += layout.size
    return b"".join(chunks)


def _decode_tf(payload: bytes) -> tuple[TFMessage, int]:
    count, at = read_count(payload, 4)
    transforms = []
    for _ in range(count):
        at += -at % 4
        stamp = Time(*STAMP.unpack_from(payload, at))
        frame, at = read_text(payload, at + 8)
        child, at = read_text(payload, at)
        at += (4 - at) % 8  # the header's 4 bytes do not count for alignment
        x, y, z, qx, qy, qz, qw = POSE.unpack_from(payload, at)
        at += POSE.size
        transform = Transform(Vector3(x, y, z), Quaternion(qx, qy, qz, qw))
        transforms.append(TransformStamped(Header(stamp, frame), child, transform))
    return TFMessage(transforms), at


def _encode_poses(message: PoseArray) -> bytes:
    head, n = pack_header(message.header), len(message.poses)
    head += b"\0" * (-len(head) % 4) + U32.pack(n)
    head += b"\0" * (-len(head) % 8 if n else 0)
    values = [(p.position, p.orientation) for p in message.poses]
    numbers = chain.from_iterable((t.x, t.y, t.z, q.x, q.y, q.z, q.w) for t, q in values)
    return MAGIC + head + pack(f"<{7 * n}d", *numbers)


def _decode_poses(payload: bytes) -> tuple[PoseArray, int]:
    header, at = read_header(payload)
    n, at = read_count(payload, at)
    if n:
        at += (4 - at) % 8
    if n * POSE.size > len(payload) - at:
        raise ValueError(f"{n} poses do not fit")
    values = unpack_from(f"<{7 * n}d", payload, at)
    poses = [
        Pose(Point(x, y, z), Quaternion(qx, qy, qz, qw))
        for x, y, z, qx, qy, qz, qw in zip(*[iter(values)] * 7, strict=True)
    ]
    return PoseArray(header, poses), at + n * POSE.size


def _little_endian(cls: type[M], read: _Read[M]) -> _Read[M]:
    """Return a decoder that leaves big-endian payloads to the general codec."""

    def either(payload: bytes) -> tuple[M, int]:
        return read(payload) if payload[:4] == MAGIC else general_codec(cls).read(payload)

    return either


def _of_only_a_path(cls: Any) -> _Functions[Any] | None:
    """Return the codec of a message that has a path and nothing else, as requests to check one: its bytes."""
    definition = types.store.fielddefs.get(cls.__msgtype__)
    match definition and definition[1]:
        case [(name, (Nodetype.NAME, Path.__msgtype__))]:
            field = attrgetter(name)

            def read(payload: bytes) -> tuple[Any, int]:
                path, end = decode_path(payload)
                return cls(path), end

            return lambda message: encode_path(field(message)), _little_endian(cls, read)
    return None


_FAST: dict[str, _Functions[Any]] = {
    Twist.__msgtype__: (_encode_twist, _little_endian(Twist, _decode_twist)),
    Clock.__msgtype__: (_encode_clock, _little_endian(Clock, _decode_clock)),
    TFMessage.__msgtype__: (_encode_tf, _little_endian(TFMessage, _decode_tf)),
    PoseArray.__msgtype__: (_encode_poses, _little_endian(PoseArray, _decode_poses)),
    Odometry.__msgtype__: (packed.encode_odometry, _little_endian(Odometry, packed.decode_odometry)),
    LaserScan.__msgtype__: (encode_scan, _little_endian(LaserScan, decode_scan)),
    Imu.__msgtype__: (packed.encode_imu, _little_endian(Imu, packed.decode_imu)),
    Path.__msgtype__: (encode_path, _little_endian(Path, decode_path)),
    JointState.__msgtype__: (
        packed.encode_joint_state,
        _little_endian(JointState, packed.decode_joint_state),
    ),
}
