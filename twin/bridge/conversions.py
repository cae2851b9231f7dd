"""Between `twin.geometry` and messages; ROS writes a quaternion as x, y, z, w."""

from __future__ import annotations

import math

import numpy as np

from twin.bridge.msgs import Point, Pose, Quaternion, Transform, Twist, Vector3
from twin.geometry import Pose2, Pose3


def quaternion_from_yaw(yaw: float) -> Quaternion:
    """Return the rotation about z by `yaw` [rad]."""
    return Quaternion(0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))


def yaw_from_quaternion(q: Quaternion) -> float:
    """Return the yaw [rad] of a rotation."""
    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))


def pose_from_pose2(pose: Pose2, z: float = 0.0) -> Pose:
    """Return a planar pose, at height z [m], as a message."""
    return Pose(Point(pose.x, pose.y, z), quaternion_from_yaw(pose.yaw))


def pose2_from_pose(pose: Pose) -> Pose2:
    """Return a pose message projected to the ground plane."""
    return Pose2(pose.position.x, pose.position.y, yaw_from_quaternion(pose.orientation))


def pose_from_pose3(pose: Pose3) -> Pose:
    """Return a pose as a message."""
    w, x, y, z = pose.quat_wxyz.tolist()
    return Pose(Point(*pose.xyz.tolist()), Quaternion(x, y, z, w))


def pose3_from_pose(pose: Pose) -> Pose3:
    """Return a pose message as a pose."""
    p, q = pose.position, pose.orientation
    return Pose3(np.array([p.x, p.y, p.z]), np.array([q.w, q.x, q.y, q.z]))


def transform_from_pose3(pose: Pose3) -> Transform:
    """Return T_a_b as the transform message whose header says a and whose child is b."""
    w, x, y, z = pose.quat_wxyz.tolist()
    return Transform(Vector3(*pose.xyz.tolist()), Quaternion(x, y, z, w))


def transform_from_pose2(pose: Pose2) -> Transform:
    """Return a planar T_a_b as the transform message whose header says a and whose child is b."""
    return Transform(Vector3(float(pose.x), float(pose.y), 0.0), quaternion_from_yaw(pose.yaw))


def pose3_from_transform(transform: Transform) -> Pose3:
    """Return a transform message as T_parent_child."""
    t, q = transform.translation, transform.rotation
    return Pose3(np.array([t.x, t.y, t.z]), np.array([q.w, q.x, q.y, q.z]))


def twist_from_planar(vx: float, wz: float, vy: float = 0.0) -> Twist:
    """Return a planar velocity as a message: vx, vy [m/s] and wz [rad/s] in the base frame."""
    return Twist(Vector3(vx, vy, 0.0), Vector3(0.0, 0.0, wz))
