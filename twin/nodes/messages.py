"""Planar poses, paths and clouds as ROS messages, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.bridge.msgs import Header, Path, Point, Pose, PoseStamped, Quaternion, stamp
from twin.geometry import Array, Pose2, quat_wxyz_from_yaw, yaw_from_quat_wxyz


def pose_msg(pose: Pose2, z: float = 0.0) -> Pose:
    """Return a planar pose, at height z [m], as a message."""
    qw, _, _, qz = quat_wxyz_from_yaw(pose.yaw)
    return Pose(
        position=Point(x=float(pose.x), y=float(pose.y), z=z),
        orientation=Quaternion(x=0.0, y=0.0, z=float(qz), w=float(qw)),
    )


def pose2(message: Pose) -> Pose2:
    """Project a pose message to the ground plane."""
    q = message.orientation
    return Pose2(message.position.x, message.position.y, yaw_from_quat_wxyz((q.w, q.x, q.y, q.z)))


def pose_stamped(pose: Pose2, frame: str, time_ns: int, z: float = 0.0) -> PoseStamped:
    """Return a planar pose in `frame` as a stamped message."""
    return PoseStamped(header=Header(stamp=stamp(time_ns), frame_id=frame), pose=pose_msg(pose, z))


def path_msg(poses: Sequence[Pose2] | Array, frame: str, time_ns: int) -> Path:
    """Return poses, shape (n, 3) or a list of them, as a path message."""
    header = Header(stamp=stamp(time_ns), frame_id=frame)
    return Path(
        header=header, poses=[PoseStamped(header=header, pose=pose_msg(Pose2(*pose))) for pose in poses]
    )


def path_array(message: Path) -> Array:
    """Return a path message as x, y, yaw, shape (n, 3)."""
    return np.array([pose2(pose.pose) for pose in message.poses]).reshape(-1, 3)
