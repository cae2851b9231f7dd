"""Global planning on a grid: the cheapest path, 8-connected (A*) or of straight lines (Theta*)."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.geometry import Array, Pose2
from twin.navigation.configured import Configured
from twin.navigation.costmaps.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    MAX_NON_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from twin.navigation.failures import GoalOccupied, GoalOutsideMap, NoValidPath, StartOccupied, StartOutsideMap
from twin.navigation.planning.config import PlannerConfig, ThetaStarConfig
from twin.navigation.planning.grid_search import GridSearch


class GlobalPlanner(Configured, ABC):
    """What plans a path over a costmap (nav2_core::GlobalPlanner)."""

    drivable: ClassVar[bool] = False
    """Whether its paths are followed as they are; others are smoothed."""

    def __init__(
        self, *, config: Any = None, footprint: ArrayLike = ((0.0, 0.0),), inflation_radius: float = 0.0
    ) -> None:
        """Take what planning depends on.

        Args:
            config: An object of its `Config`; without one its defaults.
            footprint: Corners in the base frame, shape (n, 2) [m]; one alone leaves it to the inscribed zone.
            inflation_radius: Of the costmap [m].
        """
        super().__init__(config=config)
        self.footprint = np.array(footprint, dtype=np.float64, order="C")
        self.inflation_radius = inflation_radius

    @abstractmethod
    def create_plan(self, costmap: Costmap, start: Pose2, goal: Pose2) -> Array:
        """Return a path, shape (n, 3), n >= 1: x, y [m], yaw [rad], finite, in the map's frame.

        Args:
            costmap: The global one; its frame is the map's.
            start: Where the robot is, or the last path ended.
            goal: Where to.

        Raises:
            PlanningFailure: there is none, for a reason that has an error code.
        """


class Planner(GlobalPlanner):
    """A* (Hart, Nilsson, Raphael 1968), 8-connected, or with any angle Theta*; never cuts a corner."""

    Config: ClassVar[type] = PlannerConfig

    def __init__(self, **setup: Any) -> None:
        super().__init__(**setup)
        self._search = GridSearch()

    def create_plan(self, costmap: Costmap, start: Pose2, goal: Pose2) -> Array:
        """Return the cheapest path, shape (n, 3): x, y [m], yaw [rad] along the path.

        The first row is the start's position, the last the goal itself with its yaw, or the nearest reachable
        cell within the tolerance. Rows between are cell centres, or with Theta* points of straight lines
        between such, at most a cell apart.

        Raises:
            StartOutsideMap: the start is off the costmap.
            GoalOutsideMap: the goal is off the costmap.
            StartOccupied: the start's cell is lethal, or unknown and `allow_unknown` is off.
            GoalOccupied: no cell within the tolerance of the goal is free.
            NoValidPath: none of them is connected to the start.
        """
        check_inside(costmap, start, goal)
        prices = self._prices()
        first = _flat(costmap, start)
        if prices[1, costmap.costs.flat[first]] == math.inf:
            raise StartOccupied(f"the start ({start.x:.2f}, {start.y:.2f}) is inside an obstacle")
        candidates = self._candidates(costmap, prices[0], first, goal)
        if not candidates.size:
            near = f"within {self.config.tolerance:g} m of " if self.config.tolerance else ""
            raise GoalOccupied(f"nothing is free {near}the goal ({goal.x:.2f}, {goal.y:.2f})")
        last = int(candidates[0])
        search = self._search
        if not search.run(costmap.costs, prices, first, last, any_angle=self.config.any_angle):
            reached = candidates[search.reached(candidates)]
            if not reached.size:
                route = f"({start.x:.2f}, {start.y:.2f}) to ({goal.x:.2f}, {goal.y:.2f})"
                raise NoValidPath(f"no path from {route}")
            last = int(reached[0])
        flat = search.path(last)
        width = costmap.costs.shape[1]
        points = costmap.cell_to_world(np.column_stack([flat % width, flat // width]))
        path = _ends(points, start, goal, exact=last == _flat(costmap, goal))
        if self.config.any_angle:
            path = filled(path, costmap.resolution)
        return with_headings(path, goal.yaw if last == _flat(costmap, goal) else None)

    def _prices(self) -> Array:
        """Return the price of a metre by cost, shape (2, 256), as `grid_kernel.search` takes it."""
        config = self.config
        price = np.empty((2, 256))
        price[:] = config.price(np.arange(256) / MAX_NON_OBSTACLE)
        price[0, INSCRIBED_INFLATED_OBSTACLE] = math.inf
        price[1, INSCRIBED_INFLATED_OBSTACLE] = max(config.escape_factor, 1.0)
        price[:, LETHAL_OBSTACLE] = math.inf
        price[:, NO_INFORMATION] = price[0, MAX_NON_OBSTACLE] if config.allow_unknown else math.inf
        return price

    def _candidates(self, costmap: Costmap, price: Array, first: int, goal: Pose2) -> NDArray[np.int64]:
        """Return the flat indices of the cells a path may end in, the nearest to the goal first."""
        height, width = costmap.costs.shape
        column, row = costmap.world_to_cell(goal.x, goal.y)
        r = math.floor(self.config.tolerance / costmap.resolution)
        rows = np.arange(max(0, row - r), min(height, row + r + 1))
        columns = np.arange(max(0, column - r), min(width, column + r + 1))
        v, u = (grid.ravel() for grid in np.meshgrid(rows, columns, indexing="ij"))
        centres = costmap.cell_to_world(np.column_stack([u, v]))
        distance = np.hypot(centres[:, 0] - goal.x, centres[:, 1] - goal.y)
        distance[(v == row) & (u == column)] = 0.0
        flat = v * width + u
        free = np.isfinite(price[costmap.costs[v, u]]) | (flat == first)
        usable = free & (distance <= self.config.tolerance)
        return flat[usable][np.argsort(distance[usable], kind="stable")]


class ThetaStar(Planner):
    """Theta* (Nash, Daniel, Koenig, Felner 2007)."""

    Config: ClassVar = ThetaStarConfig


def check_inside(costmap: Costmap, start: Pose2, goal: Pose2) -> None:
    """Raise StartOutsideMap or GoalOutsideMap for a pose that is off the costmap, or not finite."""
    for pose, outside in ((start, StartOutsideMap), (goal, GoalOutsideMap)):
        if not np.all(np.isfinite(pose)):
            raise outside(f"({pose.x:g}, {pose.y:g}) with yaw {pose.yaw:g} is not finite")
        if not costmap.contains(pose.x, pose.y):
            raise outside(f"({pose.x:.2f}, {pose.y:.2f}) is outside the costmap")


def filled(corners: Array, spacing: float) -> Array:
    """Return corners, shape (n, 2) [m], with points between that are at most `spacing` [m] apart."""
    pieces = np.maximum(1, np.ceil(np.hypot(*np.diff(corners, axis=0).T) / spacing - 1e-9)).astype(int)
    lines = [
        a + np.arange(n)[:, None] / n * (b - a)
        for a, b, n in zip(corners[:-1], corners[1:], pieces, strict=True)
    ]
    return np.concatenate([*lines, corners[-1:]])


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


def _flat(costmap: Costmap, pose: Pose2) -> int:
    column, row = costmap.world_to_cell(pose.x, pose.y)
    return row * costmap.costs.shape[1] + column


def _ends(points: Array, start: Pose2, goal: Pose2, *, exact: bool) -> Array:
    """Put the exact start and goal in place of the centres of their cells."""
    if len(points) == 1:
        points = np.repeat(points, 2, axis=0)
    points[0] = start.x, start.y
    if exact:
        points[-1] = goal.x, goal.y
    return points
