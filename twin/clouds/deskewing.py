"""Clouds that were measured on the way, as if they had been measured at once."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from twin.clouds.points import XYZ, Points, coordinates, with_coordinates
from twin.clouds.times import TIME_FIELDS, timed
from twin.errors import CloudError
from twin.geometry import Array, Pose3


def deskewed(
    points: Points, pose_at: Callable[[float], Pose3], *, at: float = 0.0, field: str = "time"
) -> Points:
    """Return a cloud with every point where the lidar would have measured it at one moment.

    Args:
        points: As a spinning lidar tells them: in its own frame, each at a time of its own.
        pose_at: Returns the lidar's pose, in a frame that stands still, so long after the stamp [s].
        at: That moment, after the stamp [s]; the stamp itself, unless told.
        field: That holds the times [s].

    Raises:
        CloudError: There is no such field.
    """
    if field not in (points.dtype.names or ()):
        raise CloudError(f"the cloud has no field {field!r} that tells when its points were measured")
    xyz, times = coordinates(points), points[field].reshape(-1)
    then = pose_at(at).inverse()
    for time in np.unique(times):
        now = times == time
        xyz[now] = (then @ pose_at(float(time))).apply(xyz[now])
    return with_coordinates(points, xyz)


def deskewed_by_twist(points: Points, linear: Array, angular: Array, *, at: float = 0.0) -> Points:
    """Return a cloud with the motion of a lidar taken out that moved evenly meanwhile; all fields are kept.

    A file keeps no stamp, so that moments count from the first point, whatever its driver counts from.

    Args:
        points: In the lidar's own frame, with one of `TIME_FIELDS`.
        linear: Velocity of the lidar in its own frame, shape (3,) [m/s].
        angular: Likewise [rad/s].
        at: The moment of the cloud, after its first point [s].

    Raises:
        CloudError: No field tells when its points were measured.
    """
    told = timed(points, 0.0)
    if "time" not in (told.dtype.names or ()):
        valid = ", ".join(TIME_FIELDS)
        raise CloudError(f"no field tells when the points of the cloud were measured; valid are {valid}")
    times = told["time"].astype(np.float64)
    finite = np.isfinite(times)
    clock = np.zeros(points.shape, [*((axis, "f8") for axis in XYZ), ("time", "f8")])
    clock["time"][finite] = times[finite] - times[finite].min(initial=np.inf)
    clock = with_coordinates(clock, coordinates(points))
    return with_coordinates(
        points, coordinates(deskewed(clock, lambda time: _pose_after(time, linear, angular), at=at))
    )


def _pose_after(time: float, linear: Array, angular: Array) -> Pose3:
    """Return where something is that moved evenly in its own frame: on a screw."""
    angle = float(np.linalg.norm(angular)) * time
    if abs(angle) < 1e-12:
        return Pose3(linear * time, np.array([1.0, 0.0, 0.0, 0.0]))
    axis = angular * (time / angle)
    across, along = np.cross(axis, linear), axis * (axis @ linear)
    level = (linear - along) * math.sin(angle) + across * (1.0 - math.cos(angle))
    half = angle / 2.0
    turn = np.array([math.cos(half), *(math.sin(half) * axis)])
    return Pose3(along * time + level * (time / angle), turn)
