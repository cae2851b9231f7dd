"""SE(2), SE(3) and quaternions: the algebra that every other package shares.

Quaternion order is in the name: `quat_wxyz` (MuJoCo), `quat_xyzw` (ROS). A transform `T_a_b` maps coordinates
in frame b to frame a, and is the pose of b in a.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def wrap_angle(angle: float) -> float:
    """Return `angle` [rad] wrapped to (-pi, pi]."""
    wrapped = math.fmod(angle, 2.0 * math.pi)
    if wrapped <= -math.pi:
        return wrapped + 2.0 * math.pi
    if wrapped > math.pi:
        return wrapped - 2.0 * math.pi
    return wrapped


def wrap_angles(angles: ArrayLike) -> Array:
    """Return angles [rad], any shape, wrapped to [-pi, pi)."""
    return np.mod(np.asarray(angles, dtype=np.float64) + math.pi, 2.0 * math.pi) - math.pi


class Pose2(NamedTuple):
    """A pose in the plane: SE(2) as x [m], y [m], yaw [rad]."""

    x: float
    y: float
    yaw: float

    def __matmul__(self, other: Pose2) -> Pose2:
        """Compose: `T_a_b @ T_b_c = T_a_c`."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            wrap_angle(self.yaw + other.yaw),
        )

    def inverse(self) -> Pose2:
        """Return `T_b_a` of `T_a_b`."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(-c * self.x - s * self.y, s * self.x - c * self.y, wrap_angle(-self.yaw))

    def apply(self, points: ArrayLike) -> Array:
        """Return points, shape (n, 2), given in frame b, in frame a."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        turned = np.dot(np.asarray(points, dtype=np.float64), np.array(((c, s), (-s, c))))
        # Pairs moved as complex numbers: numpy adds those in one loop, pairs in one of two numbers each.
        moved: Array = (turned.view(np.complex128) + complex(self.x, self.y)).view(np.float64)
        return moved

    def distance(self, other: Pose2) -> float:
        """Return the distance of the two origins [m]."""
        return math.hypot(other.x - self.x, other.y - self.y)


class Pose3(NamedTuple):
    """A pose in space: translation, shape (3,), and unit quaternion (w, x, y, z), shape (4,)."""

    xyz: Array
    quat_wxyz: Array

    @staticmethod
    def from_xyz_rpy(xyz: ArrayLike = (0.0, 0.0, 0.0), rpy: ArrayLike = (0.0, 0.0, 0.0)) -> Pose3:
        """Build from URDF's origin: translation [m] and fixed-axis roll, pitch, yaw [rad]."""
        return Pose3(np.array(xyz, dtype=np.float64), quat_wxyz_from_rpy(*_floats(rpy)))

    @staticmethod
    def from_pose2(pose: Pose2, z: float = 0.0) -> Pose3:
        """Lift a planar pose to height z [m]."""
        return Pose3(np.array([pose.x, pose.y, z]), quat_wxyz_from_yaw(pose.yaw))

    def __matmul__(self, other: Pose3) -> Pose3:
        """Compose: `T_a_b @ T_b_c = T_a_c`."""
        return Pose3(
            self.xyz + rotate_wxyz(self.quat_wxyz, other.xyz),
            multiply_wxyz(self.quat_wxyz, other.quat_wxyz),
        )

    def inverse(self) -> Pose3:
        """Return `T_b_a` of `T_a_b`."""
        conjugate = self.quat_wxyz * (1.0, -1.0, -1.0, -1.0)
        return Pose3(-rotate_wxyz(conjugate, self.xyz), conjugate)

    def apply(self, points: ArrayLike) -> Array:
        """Return points, shape (3,) or (n, 3), given in frame b, in frame a."""
        return np.asarray(points, dtype=np.float64) @ matrix_from_quat_wxyz(self.quat_wxyz).T + self.xyz

    def to_pose2(self) -> Pose2:
        """Project to the ground plane (yaw of REP-103: rotation about z of the x axis)."""
        return Pose2(float(self.xyz[0]), float(self.xyz[1]), yaw_from_quat_wxyz(self.quat_wxyz))


def quat_wxyz_from_yaw(yaw: float) -> Array:
    """Return the rotation about z by `yaw` [rad]."""
    return np.array([math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)])


def quat_wxyz_from_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation of URDF's rpy [rad]: about fixed x, then y, then z."""
    cr, sr = math.cos(roll / 2.0), math.sin(roll / 2.0)
    cp, sp = math.cos(pitch / 2.0), math.sin(pitch / 2.0)
    cy, sy = math.cos(yaw / 2.0), math.sin(yaw / 2.0)
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def rpy_from_quat_wxyz(quat_wxyz: ArrayLike) -> Array:
    """Return roll, pitch, yaw [rad] with pitch in [-pi/2, pi/2]; the inverse of `quat_wxyz_from_rpy`."""
    w, x, y, z = _floats(quat_wxyz)
    return np.array(
        [
            math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))),
            math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        ]
    )


def yaw_from_quat_wxyz(quat_wxyz: ArrayLike) -> float:
    """Return the yaw [rad] of a rotation."""
    w, x, y, z = _floats(quat_wxyz)
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def multiply_wxyz(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the Hamilton product a·b of two quaternions."""
    aw, ax, ay, az = _floats(a)
    bw, bx, by, bz = _floats(b)
    return np.array(
        (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        )
    )


def rotate_wxyz(quat_wxyz: ArrayLike, vector: ArrayLike) -> Array:
    """Return `vector`, shape (3,), turned by a unit quaternion."""
    # v + 2 w (q × v) + 2 q × (q × v) in plain floats: ten times as fast as numpy on three numbers.
    w, i, j, k = _floats(quat_wxyz)
    x, y, z = _floats(vector)
    cx, cy, cz = 2.0 * (j * z - k * y), 2.0 * (k * x - i * z), 2.0 * (i * y - j * x)
    return np.array(
        (
            x + w * cx + j * cz - k * cy,
            y + w * cy + k * cx - i * cz,
            z + w * cz + i * cy - j * cx,
        )
    )


def _floats(values: ArrayLike) -> list[float]:
    floats: list[float] = np.asarray(values, dtype=np.float64).tolist()
    return floats


def matrix_from_quat_wxyz(quat_wxyz: ArrayLike) -> Array:
    """Return the rotation matrix, shape (3, 3), of a unit quaternion."""
    w, x, y, z = _floats(quat_wxyz)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def xyzw_from_wxyz(quat_wxyz: ArrayLike) -> Array:
    """Return a MuJoCo quaternion in ROS order."""
    return np.asarray(quat_wxyz, dtype=np.float64)[[1, 2, 3, 0]]


def wxyz_from_xyzw(quat_xyzw: ArrayLike) -> Array:
    """Return a ROS quaternion in MuJoCo order."""
    return np.asarray(quat_xyzw, dtype=np.float64)[[3, 0, 1, 2]]
