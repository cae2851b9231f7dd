"""How far a navigation is: distance along the path and time to go, as Nav2's feedback tells them."""

from __future__ import annotations

import numpy as np

from twin.bridge.msgs import Path
from twin.geometry import Array, Pose2
from twin.navigation.behavior_trees import paths
from twin.nodes.messages import path_array

_SEARCH_WINDOW = 2.0
"""How far along the path the robot is searched for, from where it was [m]."""
_SLOW, _NEAR = 0.01, 0.1
"""Below these speeds [m/s] and distances [m] no time is estimated."""


class Progress:
    """Follows the robot along the path of the moment."""

    def __init__(self) -> None:
        self._path: Path | None = None
        self._points: Array = np.zeros((0, 3))
        self._nearest = 0

    def remaining(self, path: Path | None, pose: Pose2) -> float:
        """Return how much of the path is left [m]; 0 without a path."""
        if path is not self._path:
            self._path, self._nearest = path, 0
            self._points = path_array(path) if path is not None else np.zeros((0, 3))
        if not len(self._points):
            return 0.0
        self._nearest = paths.nearest(self._points, pose.x, pose.y, self._nearest, _SEARCH_WINDOW)
        return paths.length(self._points, self._nearest)


def time_remaining_ns(distance: float, speed: float) -> int:
    """Return the time to go at the present speed [ns]; 0 while it cannot be told."""
    if speed <= _SLOW or distance <= _NEAR:
        return 0
    return round(distance / speed * 1e9)
