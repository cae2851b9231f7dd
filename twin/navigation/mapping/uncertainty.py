"""Covariances of poses in the plane: turned into other frames, and added up along a path."""

from __future__ import annotations

import math

import numpy as np

from twin.geometry import Array, Pose2


def turned(covariance: Array, yaw: float) -> Array:
    """Return a covariance of x, y, yaw, shape (3, 3), in a frame in which its own is turned by `yaw`."""
    c, s = math.cos(yaw), math.sin(yaw)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return rotation @ covariance @ rotation.T


def inverted(matrix: Array) -> Array:
    """Return the inverse of a symmetric matrix, shape (3, 3)."""
    inverse: Array = np.linalg.inv(matrix).astype(np.float64)
    return 0.5 * (inverse + inverse.T)


def compounded(first: Array, T_a_b: Pose2, T_b_c: Pose2, second: Array) -> Array:
    """Return the covariance of `T_a_b @ T_b_c`.

    Args:
        first: Of x, y, yaw of `T_a_b` in a, shape (3, 3).
        T_a_b: The first transform.
        T_b_c: The second.
        second: Of x, y, yaw of `T_b_c` in b, shape (3, 3).
    """
    c, s = math.cos(T_a_b.yaw), math.sin(T_a_b.yaw)
    jacobian = np.eye(3)
    jacobian[0, 2] = -s * T_b_c.x - c * T_b_c.y
    jacobian[1, 2] = c * T_b_c.x - s * T_b_c.y
    return jacobian @ first @ jacobian.T + turned(second, T_a_b.yaw)


def difference(first: Pose2, second: Pose2) -> Array:
    """Return x, y [m], yaw [rad] of `second` less those of `first`, shape (3,)."""
    yaw = math.remainder(second.yaw - first.yaw, 2.0 * math.pi)
    return np.array([second.x - first.x, second.y - first.y, yaw])


def odometry_covariance(step: Pose2) -> Array:
    """Return the covariance, shape (3, 3), of a step of odometry [m, rad] in the frame in which it began."""
    distance, turn = math.hypot(step.x, step.y), abs(step.yaw)
    position = 0.02 + 0.1 * distance + 0.05 * turn
    heading = 0.01 + 0.1 * turn + 0.03 * distance
    return np.diag([position**2, position**2, heading**2])
