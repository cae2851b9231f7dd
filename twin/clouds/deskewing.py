"""Clouds that were measured on the way, as if they had been measured at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from twin.clouds.points import Points, coordinates, with_coordinates
from twin.errors import CloudError
from twin.geometry import Pose3


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
