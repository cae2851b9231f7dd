"""Packed codec of Path: many poses that mostly share one header."""

from __future__ import annotations

from functools import lru_cache
from struct import Struct

from twin.bridge.cdr.packed import MAGIC, POSE, STAMP, U32, pack_header, read_count, read_header, read_text
from twin.bridge.msgs import Header, Path, Point, Pose, PoseStamped, Quaternion, Time


@lru_cache(maxsize=256)
def _pose_struct(phase: int, frame: str) -> tuple[Struct, bytes]:
    """Return the layout of a PoseStamped that begins at `phase` (mod 8), and its frame's bytes."""
    raw = frame.encode() + b"\0"
    before = -phase % 4
    end = phase + before + 12 + len(raw)
    return Struct(f"<{before}xiII{len(raw)}s{-end % 8}x7d"), raw


def encode_path(message: Path) -> bytes:
    """Return a Path as CDR."""
    head = pack_header(message.header)
    head += b"\0" * (-len(head) % 4) + U32.pack(len(message.poses))
    chunks, at = [MAGIC, head], len(head)
    for item in message.poses:
        header, p, q = item.header, item.pose.position, item.pose.orientation
        layout, raw = _pose_struct(at % 8, header.frame_id)
        time = header.stamp
        chunks.append(layout.pack(time.sec, time.nanosec, len(raw), raw, p.x, p.y, p.z, q.x, q.y, q.z, q.w))
        at += layout.size
    return b"".join(chunks)


def decode_path(payload: bytes) -> tuple[Path, int]:
    """Return a Path from little-endian CDR, and where it ends."""
    header, at = read_header(payload)
    count, at = read_count(payload, at)
    poses = []
    for _ in range(count):
        at += -at % 4
        stamp = Time(*STAMP.unpack_from(payload, at))
        frame, at = read_text(payload, at + 8)
        at += (4 - at) % 8  # the encapsulation's 4 bytes do not count for alignment
        x, y, z, qx, qy, qz, qw = POSE.unpack_from(payload, at)
        at += POSE.size
        pose = Pose(Point(x, y, z), Quaternion(qx, qy, qz, qw))
        poses.append(PoseStamped(Header(stamp, frame), pose))
    return Path(header, poses), at
