"""What SLAM tells of itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2


@dataclass(frozen=True, kw_only=True)
class SlamUpdate:
    """Where the robot is, after a scan was taken."""

    pose: Pose2
    """Of the base in the map frame."""
    covariance: Array
    """Of x, y, yaw in the map frame, shape (3, 3)."""
    T_map_odom: Pose2
    """What to publish as the transform map -> odom."""
    loop_closed: bool
    """Whether the whole graph has moved."""
    node: int
    """Of the scan in the graph; in localization mode the nearest node of the graph."""
    response: float
    """Part of the scan's points that lie on what was seen before, 0..1; 0 if only odometry was believed."""


class GraphView(NamedTuple):
    """The graph, to be shown."""

    poses: Array
    """Of the nodes in the map frame: x [m], y [m], yaw [rad], shape (n, 3)."""
    edges: NDArray[np.int64]
    """Pairs of nodes, shape (m, 2)."""
    loops: NDArray[np.bool_]
    """Which edges close loops, shape (m,)."""
