"""Fine alignment of a scan: points onto pieces of lines, by Gauss-Newton with a robust kernel.

Censi, An ICP variant using a point-to-line metric, ICRA 2008.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation._jit import jit

BUCKET = 0.5
"""Edge of the cells in which lines are looked up [m]."""
REACHES = (0.5, 0.35, 0.25, 0.2, 0.15, 0.12, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1)
"""How far [m] a point may be from its line, iteration by iteration."""


@dataclass(frozen=True, kw_only=True)
class Alignment:
    """A pose with which the points of a scan lie on lines."""

    pose: Pose2
    information: Array
    """Inverse covariance of x, y [m], yaw [rad] in the frame of the lines, shape (3, 3); without a prior."""
    inliers: float
    """Part of the points that lie on lines, 0..1."""


class Lines:
    """Pieces of lines in the map frame, looked up by place."""

    def __init__(self, points: Array, normals: Array, half_lengths: Array) -> None:
        """Take points and unit normals, both of shape (n, 2), and half lengths [m], shape (n,)."""
        valid = np.any(normals != 0.0, axis=1)
        points = points[valid]
        self._low = (
            np.floor(points.min(axis=0) / BUCKET).astype(np.int64) if len(points) else np.zeros(2, np.int64)
        )
        cells = np.floor(points / BUCKET).astype(np.int64) - self._low
        self._shape = cells.max(axis=0) + 1 if len(points) else np.ones(2, np.int64)
        keys = cells[:, 1] * self._shape[0] + cells[:, 0]
        order = np.argsort(keys, kind="stable")
        self._starts = np.searchsorted(keys[order], np.arange(int(np.prod(self._shape)) + 1))
        self._lines = np.column_stack([points, normals[valid], half_lengths[valid]])[order]

    def align(
        self,
        points: Array,
        normals: Array,
        start: Pose2,
        prior: Pose2,
        prior_information: Array,
        deviation: float,
    ) -> Alignment:
        """Move a scan from `start` onto the lines.

        Args:
            points: Of the scan in the robot's frame, shape (n, 2) [m].
            normals: Of the scan's own lines, shape (n, 2); zero where there is none.
            start: The first pose.
            prior: The pose that is pulled to where no line says otherwise.
            prior_information: Inverse covariance of the prior, shape (3, 3).
            deviation: Of a point from its line [m].
        """
        pose, information, inliers = _align(
            self._lines,
            self._starts,
            self._low,
            self._shape,
            points,
            normals,
            np.array(start),
            np.array([prior.x, prior.y, start.yaw + math.remainder(prior.yaw - start.yaw, 2.0 * math.pi)]),
            prior_information,
            np.array(REACHES),
            deviation,
        )
        x, y, yaw = pose.tolist()
        share = inliers / max(len(points), 1)
        return Alignment(pose=Pose2(x, y, wrap_angle(yaw)), information=information, inliers=share)


@jit
def _align(
    lines: Array,
    starts: NDArray[np.int64],
    low: NDArray[np.int64],
    shape: NDArray[np.int64],
    points: Array,
    normals: Array,
    start: Array,
    prior: Array,
    prior_information: Array,
    reaches: Array,
    deviation: float,
) -> tuple[Array, Array, int]:
    pose = start.copy()
    information = np.zeros((3, 3))
    inliers = 0
    for iteration in range(reaches.shape[0]):
        reach = reaches[iteration]
        scale = max(deviation, 0.4 * reach)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        information[:] = 0.0
        gradient = np.zeros(3)
        inliers = 0
        for n in range(points.shape[0]):
            rx = c * points[n, 0] - s * points[n, 1]
            ry = s * points[n, 0] + c * points[n, 1]
            ux = c * normals[n, 0] - s * normals[n, 1]
            uy = s * normals[n, 0] + c * normals[n, 1]
            px, py = pose[0] + rx, pose[1] + ry
            has_normal = normals[n, 0] != 0.0 or normals[n, 1] != 0.0
            column = math.floor(px / 0.5) - low[0]
            row = math.floor(py / 0.5) - low[1]
            nearest, found, residual = reach * reach, -1, 0.0
            for j in range(max(row - 1, 0), min(row + 2, shape[1])):
                for i in range(max(column - 1, 0), min(column + 2, shape[0])):
                    cell = j * shape[0] + i
                    for k in range(starts[cell], starts[cell + 1]):
                        dx, dy = px - lines[k, 0], py - lines[k, 1]
                        across = lines[k, 2] * dx + lines[k, 3] * dy
                        along = abs(lines[k, 2] * dy - lines[k, 3] * dx) - lines[k, 4]
                        # Of overlapping pieces the one whose middle is nearest: its normal is the best one.
                        distance = across * across + (along * along if along > 0.0 else 0.0)
                        distance += 0.01 * (dx * dx + dy * dy)
                        if distance >= nearest:
                            continue
                        if has_normal and ux * lines[k, 2] + uy * lines[k, 3] < 0.7:
                            continue
                        nearest, found, residual = distance, k, across
            if found < 0:
                continue
            if abs(residual) < 0.1:
                inliers += 1
            ratio = residual / scale
            weight = 1.0 / (1.0 + ratio * ratio)
            weight = weight * weight
            j0, j1 = lines[found, 2], lines[found, 3]
            j2 = j1 * rx - j0 * ry
            information[0, 0] += weight * j0 * j0
            information[0, 1] += weight * j0 * j1
            information[0, 2] += weight * j0 * j2
            information[1, 1] += weight * j1 * j1
            information[1, 2] += weight * j1 * j2
            information[2, 2] += weight * j2 * j2
            gradient[0] += weight * residual * j0
            gradient[1] += weight * residual * j1
            gradient[2] += weight * residual * j2
        information[1, 0] = information[0, 1]
        information[2, 0] = information[0, 2]
        information[2, 1] = information[1, 2]
        information /= deviation * deviation
        gradient /= deviation * deviation
        gradient += prior_information @ (pose - prior)
        system = information + prior_information
        step = np.linalg.solve(system, gradient)
        pose -= step
        if iteration > 6 and abs(step[0]) + abs(step[1]) < 1e-4 and abs(step[2]) < 1e-5:
            break
    return pose, information, inliers
