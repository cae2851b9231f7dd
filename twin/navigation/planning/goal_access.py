"""Goals that somebody stands on: driven to in the hope that they move away, for a while."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from twin.geometry import Pose2
from twin.navigation.costmaps.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
    footprint_cost,
    triple,
)
from twin.navigation.costmaps.footprint import radii
from twin.navigation.costmaps.kernels import footprint_hits
from twin.navigation.failures import GoalOccupied
from twin.navigation.planning.config import GoalAccessConfig

_STALE_S = 3.0
"""A goal that nobody has asked for, longer than patience by so much, is another one when it comes again."""


@dataclass(kw_only=True)
class GoalAccess:
    """Says what to plan on, for the footprint of one robot.

    The planners ask whether the centre of the robot may be at the goal. A robot that is longer than wide
    needs more room, and beside somebody enough to turn; to find that out on the spot takes many recoveries.
    Where it fits, but could hardly turn, it is waited for room, and then tried.
    """

    footprint: ArrayLike
    """Shape (n, 2) [m]."""
    config: GoalAccessConfig = field(default_factory=GoalAccessConfig)

    def __post_init__(self) -> None:
        self._corners = np.array(self.footprint, dtype=np.float64, order="C")
        self._turning_radius = radii(self._corners)[1]
        self._asked: dict[Pose2, tuple[int, int]] = {}
        """For occupied goals near the robot: since when they are, and when they were asked for last [ns]."""

    def open_to(self, goal: Pose2, robot: Pose2, costmap: Costmap, known: Costmap, now_ns: int) -> Costmap:
        """Return the costmap to plan on: the given one, or without what is seen around an occupied goal.

        Args:
            goal: Where to.
            robot: Where the robot is.
            costmap: As it is now.
            known: What the map and the masks alone say.
            now_ns: The time.

        Raises:
            GoalOccupied: the robot is near, and what is seen has left it no room at the goal for too long.
        """
        self._forget(now_ns)
        inside = bool(np.isfinite(goal).all()) and costmap.contains(goal.x, goal.y)
        if not inside or not self._is_free(known, goal):
            return costmap  # the planner says what is wrong with it
        free = self._is_free(costmap, goal)
        if free and not self._is_crowded(costmap, known, goal):
            self._asked.pop(goal, None)
            return costmap
        if robot.distance(goal) < self.config.goal_near:
            since, _ = self._asked.get(goal, (now_ns, now_ns))
            self._asked[goal] = since, now_ns
            waited = (now_ns - since) * 1e-9
            if waited >= self.config.goal_patience:
                if free:
                    return costmap
                raise GoalOccupied(
                    f"something has stood at the goal ({goal.x:.2f}, {goal.y:.2f}) for {waited:.0f} s"
                )
        return self._without_visitors(costmap, known, goal)

    def is_lost(self, end: Pose2, robot: Pose2, costmap: Costmap, known: Costmap) -> bool:
        """Whether the robot is near the end of its path, and what is seen there leaves it no room."""
        near = robot.distance(end) < self.config.goal_near
        return near and not self._is_free(costmap, end) and self._is_free(known, end)

    def _forget(self, now_ns: int) -> None:
        """Begin anew with goals that nobody has asked for lately."""
        stale_ns = round((self.config.goal_patience + _STALE_S) * 1e9)
        self._asked = {goal: times for goal, times in self._asked.items() if now_ns - times[1] < stale_ns}

    def _is_crowded(self, costmap: Costmap, known: Costmap, goal: Pose2) -> bool:
        """Whether somebody who is seen, and not on the map, is too near for the robot to turn there."""
        around = self._around(costmap, goal, self._turning_radius)
        # A wall is seen a cell beside where the map has it.
        unmapped = known.costs[around] < INSCRIBED_INFLATED_OBSTACLE
        rows, columns = np.nonzero((costmap.costs[around] == LETHAL_OBSTACLE) & unmapped)
        corner = np.array([around[1].start, around[0].start])
        away = costmap.cell_to_world(np.column_stack([columns, rows]) + corner) - goal[:2]
        return bool((np.hypot(away[:, 0], away[:, 1]) < self._turning_radius).any())

    def _is_free(self, costmap: Costmap, pose: Pose2) -> bool:
        cost = costmap.cost_at(pose.x, pose.y)
        if cost >= INSCRIBED_INFLATED_OBSTACLE and cost != NO_INFORMATION:
            return False
        if footprint_cost(costmap, self._corners, pose) == LETHAL_OBSTACLE:
            return False
        return footprint_hits(costmap.costs, self._corners, triple(pose), costmap.frame) == 0

    def _without_visitors(self, costmap: Costmap, known: Costmap, goal: Pose2) -> Costmap:
        around = self._around(costmap, goal, self.config.goal_surroundings)
        costs = costmap.costs.copy()
        costs[around] = known.costs[around]
        return replace(costmap, costs=costs)

    @staticmethod
    def _around(costmap: Costmap, goal: Pose2, reach: float) -> tuple[slice, slice]:
        """Return the rows and columns of the square that reaches so far from the goal [m]."""
        cells = math.ceil(reach / costmap.resolution)
        column, row = costmap.world_to_cell(goal.x, goal.y)
        rows = slice(max(row - cells, 0), max(row + cells + 1, 0))
        return rows, slice(max(column - cells, 0), max(column + cells + 1, 0))
