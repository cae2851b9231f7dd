"""Hybrid-A*: paths that a robot with a limited turning circle can follow, safe for its whole footprint."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    MAX_NON_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from twin.navigation.failures import GoalOccupied, NoValidPath, PlanningTimeout, StartOccupied
from twin.navigation.planning.config import HybridConfig
from twin.navigation.planning.curves import Turns, advance
from twin.navigation.planning.grid_search import GridSearch
from twin.navigation.planning.hybrid_kernel import (
    FOUND,
    OUT_OF_NODES,
    Drive,
    Ints,
    curve_cost,
    expand,
    pose_cost,
)
from twin.navigation.planning.planner import GlobalPlanner, check_inside

_SLACK = 1.3
"""The cost to the goal is known for cells of so many times the start's; the others cost more."""


class HybridPlanner(GlobalPlanner):
    """Plans arcs and straight lines (Dolgov et al. 2008; nav2_smac_planner), forwards or also backwards.

    From the costmap's inflation radius follows how low a cost keeps the whole footprint clear.
    """

    Config: ClassVar = HybridConfig
    drivable = True

    def __init__(self, **setup: Any) -> None:
        super().__init__(**setup)
        self._search = GridSearch()

    def create_plan(self, costmap: Costmap, start: Pose2, goal: Pose2) -> Array:
        """Return a path, shape (n, 3): x, y [m] and the robot's heading [rad], at most a cell apart.

        Where the robot drives backwards, the next pose lies behind the heading.

        Raises:
            StartOutsideMap: the start is off the costmap.
            GoalOutsideMap: the goal is off the costmap.
            StartOccupied: the footprint collides at the start.
            GoalOccupied: and so at every cell within the tolerance of the goal.
            NoValidPath: there is no path.
            PlanningTimeout: none was found within `max_iterations`.
        """
        check_inside(costmap, start, goal)
        drive, first = self._drive(costmap), _in_cells(costmap, start)
        if pose_cost(drive, *first.tolist()) < 0:
            raise StartOccupied(f"the robot collides at the start ({start.x:.2f}, {start.y:.2f})")
        last = _in_cells(costmap, self._reachable(drive, costmap, goal))
        anchors, moves, g = self._expanded(drive, costmap.resolution, first, last)
        pieces = self._pieces(drive, anchors, moves, g)
        poses = _driven(first, pieces, drive.radius)
        poses[-1] = last
        x, y, resolution = costmap.frame
        poses[:, :2] = poses[:, :2] * resolution + (x, y)
        poses[:, 2] = (poses[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
        return poses

    def _drive(self, costmap: Costmap) -> Drive:
        config, corners = self.config, self.footprint
        reach = float(np.hypot(corners[:, 0], corners[:, 1]).max())
        reach += costmap.resolution  # for costs are those of the cells' centres
        clear_below = costmap.cost_within(reach) if self.inflation_radius >= reach else 0
        turning = (config.non_straight_penalty, config.change_penalty)
        return Drive(
            costs=costmap.costs,
            corners=corners / costmap.resolution,
            radius=max(config.minimum_turning_radius / costmap.resolution, 1.0),
            reverse=config.motion_model_for_search == "REEDS_SHEPP",
            clear_below=clear_below,
            allow_unknown=config.allow_unknown,
            penalties=np.array([config.cost_penalty, *turning, config.reverse_penalty]),
        )

    def _reachable(self, drive: Drive, costmap: Costmap, goal: Pose2) -> Pose2:
        """Return the goal, or the nearest pose of its heading at a cell's centre where the robot fits."""
        tolerance = self.config.tolerance
        if pose_cost(drive, *_in_cells(costmap, goal).tolist()) >= 0:
            return goal
        r = math.ceil(tolerance / costmap.resolution)
        column, row = costmap.world_to_cell(goal.x, goal.y)
        offsets = np.stack(np.meshgrid(np.arange(-r, r + 1), np.arange(-r, r + 1)), axis=-1).reshape(-1, 2)
        centres = costmap.cell_to_world(offsets + np.array([column, row]))
        away = np.hypot(*(centres - (goal.x, goal.y)).T)
        for i in np.argsort(away, kind="stable"):
            near = Pose2(float(centres[i, 0]), float(centres[i, 1]), goal.yaw)
            if away[i] <= tolerance and pose_cost(drive, *_in_cells(costmap, near).tolist()) >= 0:
                return near
        message = f"the robot fits nowhere within {tolerance:g} m of the goal"
        raise GoalOccupied(f"{message} ({goal.x:.2f}, {goal.y:.2f})")

    def _expanded(
        self, drive: Drive, resolution: float, first: Array, last: Array
    ) -> tuple[Array, Ints, Array]:
        """Return the nodes of the way: poses, moves into them, costs."""
        config, width = self.config, drive.costs.shape[1]
        here, there = (math.floor(pose[1]) * width + math.floor(pose[0]) for pose in (first, last))
        if not self._search.run(drive.costs, self._prices(), there, here, slack=_SLACK):
            raise NoValidPath("start and goal are not connected")
        bins = config.angle_quantization_bins
        # A move leaves its cell, and turns by a whole number of bins (nav2_smac_planner, node_hybrid.cpp).
        turn = 2.0 * math.asin(min(1.0, math.sqrt(2.0) / (2.0 * drive.radius)))
        arc = max(1, math.ceil(turn / (2.0 * math.pi / bins))) * 2.0 * math.pi / bins
        longest = max(config.analytic_expansion_max_length / resolution, 4.0 * drive.radius)
        outcome, node, poses, g, parent, move = expand(
            drive,
            first,
            last,
            *self._search.field,
            _SLACK * self._search.cost(here),
            bins,
            arc,
            float(config.analytic_expansion_ratio),
            longest,
            config.max_iterations,
        )
        if outcome == OUT_OF_NODES:
            raise PlanningTimeout(f"no path within {config.max_iterations} iterations")
        if outcome != FOUND:
            raise NoValidPath("the robot cannot turn its way to the goal")
        nodes = [node]
        while parent[nodes[-1]] >= 0:
            nodes.append(int(parent[nodes[-1]]))
        order = np.array(nodes[::-1])
        self._arc = arc
        return poses[order], move[order], g[order]

    def _prices(self) -> Array:
        """Return what a cell's width costs by its cost, as `grid_kernel.search` has it."""
        config = self.config
        price = np.full((2, 256), 1.0 + config.cost_penalty * np.arange(256) / MAX_NON_OBSTACLE)
        price[:, INSCRIBED_INFLATED_OBSTACLE:NO_INFORMATION] = math.inf
        price[:, NO_INFORMATION] = 1.0 + config.cost_penalty if config.allow_unknown else math.inf
        return price

    def _pieces(self, drive: Drive, anchors: Array, moves: Ints, g: Array) -> list[tuple[int, float]]:
        """Return the path as turns and lengths [radii], with cheaper curves in place of parts if smoothed."""
        pieces: list[tuple[int, float]] = []
        i, count = 0, len(anchors) - 1
        last = (0, 1)
        while i < count:
            found: list[tuple[int, float]] = []
            j = i + 1
            for ahead in _aheads(count - i) if self.config.smooth_path else ():
                saved = float(g[i + ahead] - g[i]) - 1e-6
                cost, curve = _curve(drive, anchors[i], anchors[i + ahead], last)
                if cost < saved:
                    j, found = i + ahead, curve
                    break
            if not found and moves[j] == 6:
                found = _curve(drive, anchors[i], anchors[j], last)[1]
            elif not found:
                found = [(int(moves[j]) % 3 - 1, self._arc if moves[j] < 3 else -self._arc)]
            pieces += found
            if pieces:  # none yet where the robot stands at the goal
                last = (pieces[-1][0], 1 if pieces[-1][1] > 0.0 else -1)
            i = j
        return pieces


def _in_cells(costmap: Costmap, pose: Pose2) -> Array:
    x, y, resolution = costmap.frame
    return np.array([(pose.x - x) / resolution, (pose.y - y) / resolution, pose.yaw])


def _curve(
    drive: Drive, start: Array, goal: Array, last: tuple[int, int]
) -> tuple[float, list[tuple[int, float]]]:
    """Return the cost [cells] and the pieces of the shortest curve between two poses."""
    turns: Turns = np.zeros(5, np.int64)
    lengths = np.zeros(5)
    cost, _, count = curve_cost(drive, start, goal, *last, turns, lengths)
    drawn = zip(turns[:count].tolist(), lengths[:count].tolist(), strict=True)
    return cost, [(turn, length) for turn, length in drawn if abs(length) > 1e-9]


def _aheads(most: int) -> list[int]:
    """Return how many nodes ahead curves are tried to: far ones first, each two thirds of the one before."""
    steps = [most]
    while steps[-1] > 2:
        steps.append(steps[-1] * 2 // 3)
    return steps


def _driven(first: Array, pieces: list[tuple[int, float]], radius: float) -> Array:
    """Return the poses along pieces, shape (n, 3), at most a cell apart."""
    poses = [tuple(first.tolist())]
    for turn, length in pieces:
        count = max(1, math.ceil(abs(length) * radius))
        x, y, yaw = poses[-1]
        poses += [advance(x, y, yaw, turn, length * i / count, radius) for i in range(1, count + 1)]
    return np.array(poses if len(poses) > 1 else 2 * poses)
