"""Global planning: the cheapest 8-connected path over a costmap."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    MAX_NON_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from twin.navigation.failures import (
    GoalOccupied,
    GoalOutsideMap,
    NoValidPath,
    StartOccupied,
    StartOutsideMap,
)
from twin.navigation.planning.astar_kernel import search


@dataclass(frozen=True, kw_only=True)
class PlannerConfig:
    """Parameters of the planner; names are those of Nav2's NavFn and Smac 2-D planners."""

    tolerance: float = 0.5
    """If the goal cannot be reached, how far from it the path may end [m]."""
    allow_unknown: bool = True
    """Whether a path may cross unknown cells; they cost as much as the most expensive free cell."""
    cost_factor: float = 3.0
    """A metre at cost 252 counts as 1 + cost_factor metres of free space."""
    escape_factor: float = 20.0
    """A metre inside the inscribed zone (253), out of which a start may escape, counts as so many."""


@dataclass(kw_only=True)
class Planner:
    """A* (Hart, Nilsson, Raphael 1968) with the octile heuristic; it never cuts a blocked corner."""

    config: PlannerConfig

    def plan(self, costmap: Costmap, start: Pose2, goal: Pose2) -> Array:
        """Return the cheapest path, shape (n, 3): x, y [m], yaw [rad] along the path.

        The first row is the start's position, the last the goal itself with its yaw, or the nearest reachable
        cell within the tolerance. Rows between are cell centres.

        Raises:
            StartOutsideMap: the start is off the costmap.
            GoalOutsideMap: the goal is off the costmap.
            StartOccupied: the start's cell is lethal, or unknown and `allow_unknown` is off.
            GoalOccupied: no cell within the tolerance of the goal is free.
            NoValidPath: none of them is connected to the start.
        """
        for pose, outside in ((start, StartOutsideMap), (goal, GoalOutsideMap)):
            if not (np.all(np.isfinite(pose)) and costmap.contains(pose.x, pose.y)):
                raise outside(f"({pose.x:.2f}, {pose.y:.2f}) is outside the costmap")
        factor, penned = self._factors(costmap, start)
        width = factor.shape[1]
        first = _flat(costmap, start)
        if factor.flat[first] == math.inf:
            raise StartOccupied(f"the start ({start.x:.2f}, {start.y:.2f}) is inside an obstacle")
        candidates = self._candidates(costmap, factor, penned, first, goal)
        if not candidates.size:
            near = f"within {self.config.tolerance:g} m of " if self.config.tolerance else ""
            raise GoalOccupied(f"nothing is free {near}the goal ({goal.x:.2f}, {goal.y:.2f})")
        size = factor.size
        g, closed = np.full(size, np.inf), np.zeros(size, dtype=np.bool_)
        parent = np.empty(size, dtype=np.int32)
        last = int(candidates[0])
        if not search(factor, first, last, penned, g, parent, closed):
            reached = candidates[closed[candidates]]
            if not reached.size:
                route = f"({start.x:.2f}, {start.y:.2f}) to ({goal.x:.2f}, {goal.y:.2f})"
                raise NoValidPath(f"no path from {route}")
            last = int(reached[0])
        cells = [last]
        while cells[-1] != first:
            cells.append(int(parent[cells[-1]]))
        flat = np.array(cells[::-1])
        points = costmap.cell_to_world(np.column_stack([flat % width, flat // width]))
        return _finish(points, start, goal, exact=last == _flat(costmap, goal))

    def _factors(self, costmap: Costmap, start: Pose2) -> tuple[Array, NDArray[np.bool_]]:
        """Return the price of each cell, and the cells that may be left but not entered."""
        config = self.config
        price = 1.0 + config.cost_factor * np.arange(256) / MAX_NON_OBSTACLE
        unknown = 1.0 + config.cost_factor if config.allow_unknown else math.inf
        price[INSCRIBED_INFLATED_OBSTACLE:] = (math.inf, math.inf, unknown)
        column, row = costmap.world_to_cell(start.x, start.y)
        starts_inscribed = costmap.costs[row, column] == INSCRIBED_INFLATED_OBSTACLE
        if starts_inscribed:
            price[INSCRIBED_INFLATED_OBSTACLE] = max(config.escape_factor, 1.0)
        price[LETHAL_OBSTACLE] = math.inf
        penned = np.zeros(256, dtype=np.bool_)
        penned[INSCRIBED_INFLATED_OBSTACLE] = starts_inscribed
        price[NO_INFORMATION] = unknown
        return price[costmap.costs], penned[costmap.costs]

    def _candidates(
        self, costmap: Costmap, factor: Array, penned: NDArray[np.bool_], first: int, goal: Pose2
    ) -> NDArray[np.int64]:
        """Return the flat indices of the cells a path may end in, the nearest to the goal first."""
        height, width = factor.shape
        column, row = costmap.world_to_cell(goal.x, goal.y)
        r = math.floor(self.config.tolerance / costmap.resolution)
        rows = np.arange(max(0, row - r), min(height, row + r + 1))
        columns = np.arange(max(0, column - r), min(width, column + r + 1))
        v, u = (grid.ravel() for grid in np.meshgrid(rows, columns, indexing="ij"))
        centres = costmap.cell_to_world(np.column_stack([u, v]))
        distance = np.hypot(centres[:, 0] - goal.x, centres[:, 1] - goal.y)
        distance[(v == row) & (u == column)] = 0.0
        flat = v * width + u
        free = np.isfinite(factor[v, u]) & (~penned[v, u] | (flat == first))
        usable = free & (distance <= self.config.tolerance)
        return flat[usable][np.argsort(distance[usable], kind="stable")]


def with_headings(points: Array, final_yaw: float | None = None) -> Array:
    """Return points, shape (n, 2), as a path, shape (n, 3), each turned towards the next.

    Args:
        points: x, y [m].
        final_yaw: Yaw of the last row [rad]; that of the row before if None.
    """
    yaw = np.zeros(len(points))
    if len(points) > 1:
        step = np.diff(points[:, :2], axis=0)
        yaw[:-1] = np.arctan2(step[:, 1], step[:, 0])
        yaw[-1] = yaw[-2]
    if final_yaw is not None:
        yaw[-1] = final_yaw
    return np.column_stack([points[:, :2], yaw])


def path_length(path: Array) -> float:
    """Return the length [m] of a path, shape (n, 2 or 3)."""
    return float(np.hypot(*np.diff(path[:, :2], axis=0).T).sum())


def _flat(costmap: Costmap, pose: Pose2) -> int:
    column, row = costmap.world_to_cell(pose.x, pose.y)
    return row * costmap.costs.shape[1] + column


def _finish(points: Array, start: Pose2, goal: Pose2, *, exact: bool) -> Array:
    """Put the exact start and goal in place of the centres of their cells."""
    if len(points) == 1:
        points = np.repeat(points, 2, axis=0)
    points[0] = start.x, start.y
    if exact:
        points[-1] = goal.x, goal.y
    return with_headings(points, goal.yaw if exact else None)
