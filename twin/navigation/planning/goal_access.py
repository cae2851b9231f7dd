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
)
from twin.navigation.costmaps.footprint import radii
from twin.navigation.costmaps.kernels import footprint_hits
from twin.navigation.failures import GoalOccupied


@dataclass(frozen=True, kw_only=True)
class GoalAccessConfig:
    """How long an occupied goal is hoped for."""

    goal_near: float = 3.0
    """From here on it matters whether the goal is free [m]: what is seen there from afar will have moved."""
    goal_patience: float = 4.0
    """How long something may be on the goal when the robot is near [s]."""
    goal_surroundings: float = 1.2
    """How far around an occupied goal only what the map shows is planned around [m]."""


@dataclass(kw_only=True)
class GoalAccess:
    """Says what to plan on, for the footprint of one robot.

    The planners ask whether the centre of the robot may be at the goal. A robot that is longer than wide
    needs more room, and beside somebody enough to turn; to find that out on the spot takes many recoveries.
    """

    footprint: ArrayLike
    """Shape (n, 2) [m]."""
    config: GoalAccessConfig = field(default_factory=GoalAccessConfig)

    def __post_init__(self) -> None:
        self._corners = np.array(self.footprint, dtype=np.float64, order="C")
        self._turning_radius = radii(self._corners)[1]
        self._goal: Pose2 | None = None
        self._occupied_ns: int | None = None

    def open_to(self, goal: Pose2, start: Pose2, costmap: Costmap, known: Costmap, now_ns: int) -> Costmap:
        """Return the costmap to plan on: the given one, or without what is seen around an occupied goal.

        Args:
            goal: Where to.
            start: Where the robot is.
            costmap: As it is now.
            known: What the map and the masks alone say.
            now_ns: The time.

        Raises:
            GoalOccupied: something has been seen on the goal for too long, the robot being near.
        """
        if goal != self._goal:
            self._goal, self._occupied_ns = goal, None
        if (
            not np.isfinite(goal).all()
            or not costmap.contains(goal.x, goal.y)
            or not self._is_occupied(costmap, known, goal)
        ):
            self._occupied_ns = None
            return costmap
        if start.distance(goal) < self.config.goal_near:
            if self._occupied_ns is None:
                self._occupied_ns = now_ns
            waited = (now_ns - self._occupied_ns) * 1e-9
            if waited >= self.config.goal_patience:
                raise GoalOccupied(
                    f"something has stood at the goal ({goal.x:.2f}, {goal.y:.2f}) for {waited:.0f} s"
                )
        return self._without_visitors(costmap, known, goal)

    def is_lost(self, end: Pose2, robot: Pose2, costmap: Costmap, known: Costmap) -> bool:
        """Whether the robot is near the end of its path, and what is seen there leaves it no room."""
        return robot.distance(end) < self.config.goal_near and self._is_occupied(costmap, known, end)

    def _is_occupied(self, costmap: Costmap, known: Costmap, goal: Pose2) -> bool:
        """Whether what is seen, and not on the map, leaves no room to stand or turn at the goal."""
        if not self._is_free(known, goal):
            return False
        around = self._around(costmap, goal, self._turning_radius)
        # A wall is seen a cell beside where the map has it.
        seen = (costmap.costs[around] == LETHAL_OBSTACLE) & (
            known.costs[around] < INSCRIBED_INFLATED_OBSTACLE
        )
        rows, columns = np.nonzero(seen)
        corner = np.array([around[1].start, around[0].start])
        away = costmap.cell_to_world(np.column_stack([columns, rows]) + corner) - goal[:2]
        near = np.hypot(away[:, 0], away[:, 1]) < self._turning_radius
        return bool(near.any()) or not self._is_free(costmap, goal)

    def _is_free(self, costmap: Costmap, pose: Pose2) -> bool:
        cost = costmap.cost_at(pose.x, pose.y)
        if cost >= INSCRIBED_INFLATED_OBSTACLE and cost != NO_INFORMATION:
            return False
        if footprint_cost(costmap, self._corners, pose) == LETHAL_OBSTACLE:
            return False
        at = float(pose.x), float(pose.y), float(pose.yaw)
        return footprint_hits(costmap.costs, self._corners, *at, *costmap.frame) == 0

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
