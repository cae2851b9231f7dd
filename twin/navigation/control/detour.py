"""A way around what stands on the path, for controllers that look for the way themselves.

A rollout sees as far as it drives: beside an obstacle every step along the path costs, every step aside is
away from it, and the robot stays where it is. A search over the local costmap knows the way out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2
from twin.navigation._jit import fast_jit
from twin.navigation.control.path_handler import LocalPath, PathHandler, PathHandlerConfig
from twin.navigation.costmaps.costmap import INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION, Costmap
from twin.navigation.failures import PlanningFailure
from twin.navigation.planning.config import PlannerConfig, SmootherConfig
from twin.navigation.planning.planner import Planner
from twin.navigation.planning.smoother import SimpleSmoother

_PAST = 16
"""Poses of the path behind the obstacle, 5 cm apart, that a way around need not lead back to."""
_PATIENCE = 8
"""Control periods between two searches, if the first finds nothing."""


class DetouringPathHandler(PathHandler):
    """A path handler that leads around what stands on the path, as long as nobody plans anew."""

    def __init__(
        self, config: PathHandlerConfig, *, to_cusps: bool, prune_distance: float, detours: bool
    ) -> None:
        self._planner = Planner(config=PlannerConfig(tolerance=0.0, cost_factor=3.0))
        self._smoother = SimpleSmoother(config=SmootherConfig(max_its=50))
        self._detours = detours
        super().__init__(config, to_cusps=to_cusps, prune_distance=prune_distance)

    def reset(self) -> None:
        """Forget the path."""
        super().reset()
        self._wait = 0

    def local_around(self, pose: Pose2, costmap: Costmap | None, at: Pose2) -> LocalPath:
        """Return what lies ahead of the robot, or the way around it; moves on along the path.

        Args:
            pose: Of the base, in the path's frame.
            costmap: Where obstacles are; None: there are none.
            at: Of the base, in the costmap's frame.
        """
        local = self.local(pose)
        if not self._detours or costmap is None or local.reversing:
            return local
        to_grid = at @ pose.inverse()
        target = _next_free(costmap, to_grid.apply(local.poses[:, :2]))
        if target is None:
            return local
        if self._wait:
            self._wait -= 1
            return local
        try:
            around = self._around(costmap, at, to_grid.apply(local.poses[target : target + 1, :2])[0])
        except PlanningFailure:
            self._wait = _PATIENCE
            return local
        self.lead(to_grid.inverse().apply(around), target)
        return self.local(pose)

    def _around(self, costmap: Costmap, start: Pose2, target: Array) -> Array:
        """Return the smoothed cheapest way, shape (n, 2); raises PlanningFailure."""
        path = self._planner.create_plan(costmap, start, Pose2(float(target[0]), float(target[1]), 0.0))
        return self._smoother.smooth(path, costmap)[:, :2]


def _next_free(costmap: Costmap, points: Array) -> int | None:
    """Return the point, of shape (n, 2), a little after the first blocked stretch; None: nothing is blocked.

    A stretch that the robot stands in itself is no obstacle: it is driven out of.
    """
    free = free_points(costmap, points)
    clear = np.flatnonzero(free)
    if not clear.size:
        return None
    blocked = clear[0] + np.flatnonzero(~free[clear[0] :])
    if not blocked.size:
        return None
    after = clear[clear > blocked[0]]
    on_map = [i for i in after if costmap.contains(float(points[i, 0]), float(points[i, 1]))]
    if not on_map:
        return None
    first = last = int(on_map[0])
    while last - first < _PAST and last + 1 in on_map:
        last += 1
    return last


def free_points(costmap: Costmap, points: Array) -> NDArray[np.bool_]:
    """Return which points, shape (n, 2) [m], are neither inscribed nor lethal; off the map all are free."""
    return _free(costmap.costs, points, *costmap.frame)


@fast_jit
def _free(
    costs: NDArray[np.uint8], points: Array, x0: float, y0: float, resolution: float
) -> NDArray[np.bool_]:
    height, width = costs.shape
    free = np.ones(points.shape[0], dtype=np.bool_)
    for i in range(points.shape[0]):
        u, v = math.floor((points[i, 0] - x0) / resolution), math.floor((points[i, 1] - y0) / resolution)
        if 0 <= u < width and 0 <= v < height:
            cost = costs[v, u]
            free[i] = cost < INSCRIBED_INFLATED_OBSTACLE or cost == NO_INFORMATION
    return free
