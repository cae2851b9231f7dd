"""Stamped poses and paths as ROS messages, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.bridge.conversions import pose2_from_pose, pose_from_pose2
from twin.bridge.msgs import Path, PoseStamped, header
from twin.geometry import Array, Pose2


def pose_stamped(pose: Pose2, frame: str, time_ns: int) -> PoseStamped:
    """Return a planar pose in `frame` as a stamped message."""
    return PoseStamped(header=header(time_ns, frame), pose=pose_from_pose2(pose))


def path_msg(poses: Sequence[Pose2] | Array, frame: str, time_ns: int) -> Path:
    """Return poses, shape (n, 3) or a list of them, as a path message."""
    shared = header(time_ns, frame)
    rows = poses.tolist() if isinstance(poses, np.ndarray) else poses
    stamped = [PoseStamped(header=shared, pose=pose_from_pose2(Pose2(*pose))) for pose in rows]
    return Path(header=shared, poses=stamped)


def path_array(message: Path) -> Array:
    """Return a path message as x, y, yaw, shape (n, 3)."""
    return np.array([pose2_from_pose(pose.pose) for pose in message.poses]).reshape(-1, 3)
