"""`/planner_server`: the `compute_path_to_pose` action and `is_path_valid`, over the global costmap."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.bridge.action_types import ComputePathToPose
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import Path, duration, new
from twin.bridge.srvs import IsPathValid
from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION
from twin.navigation.failures import PlanningFailure
from twin.navigation.planning.commitment import CommitmentConfig, committed
from twin.navigation.planning.planner import Planner, PlannerConfig
from twin.navigation.planning.smoother import SimpleSmoother, SmootherConfig
from twin.nodes.messages import path_array, path_msg
from twin.nodes.navigation.costmap import CostmapNode
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.node_parameters import declare_config


@dataclass(frozen=True, kw_only=True)
class PlannerParameters:
    """Parameters of the server's plugins."""

    planner: PlannerConfig
    commitment: CommitmentConfig
    smoother: SmootherConfig


class PlannerServerNode:
    """Plans on request; publishes `plan`."""

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        costmap: CostmapNode,
        *,
        config: PlannerConfig | None = None,
        smoother: SmootherConfig | None = None,
        commitment: CommitmentConfig | None = None,
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node("planner_server", namespace)
        self._robot_pose = robot_pose
        self._costmap = costmap
        self._planner = Planner(config=config or PlannerConfig())
        self._smoother = SimpleSmoother(config=smoother or SmootherConfig())
        self._commitment = commitment or CommitmentConfig()
        self._last: tuple[Pose2, Array] | None = None
        """The goal of the last plan, and that plan."""
        parameters = PlannerParameters(
            planner=self._planner.config, commitment=self._commitment, smoother=self._smoother.config
        )
        names = {"planner": "GridBased", "commitment": "GridBased"}
        declare_config(self.node, parameters, self._reconfigure, names)
        self._publisher = self.node.create_publisher(Path, "plan", 1)
        self.node.create_service(IsPathValid, "is_path_valid", self._on_is_path_valid)
        ActionServer(self.node, ComputePathToPose, "compute_path_to_pose", self._execute)

    def _reconfigure(self, parameters: PlannerParameters) -> None:
        """Plan the next path with other parameters."""
        self._planner.config = parameters.planner
        self._commitment = parameters.commitment
        self._smoother = SimpleSmoother(config=parameters.smoother)

    def _execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        request = handle.request
        start = pose2_from_pose(request.start.pose) if request.use_start else self._robot_pose.in_map()
        costmap = self._costmap.costmap
        if start is None or costmap is None:
            handle.abort()
            what = "map" if costmap is None else "localisation"
            return new(ComputePathToPose.Result, error_code=202, error_msg=f"no plan without {what}")
        yield
        goal = pose2_from_pose(request.goal.pose)
        if self._commitment.commitment_cost and self._last is not None and self._last[0] == goal:
            costmap = committed(costmap, self._last[1], self._commitment)
        try:
            raw = self._planner.plan(costmap, start, goal)
        except PlanningFailure as failure:
            handle.abort()
            return new(ComputePathToPose.Result, error_code=failure.error_code, error_msg=str(failure))
        smooth = self._smoother.smooth(raw, costmap)
        # A smooth path needs no point per cell; the message costs by the point.
        thinned = np.concatenate([smooth[:-1:2], smooth[-1:]])
        self._last = (goal, thinned)
        path = path_msg(thinned, self._robot_pose.frames.map, self.node.now_ns)
        self._publisher.publish(path)
        return new(ComputePathToPose.Result, path=path, planning_time=duration(0))

    def _on_is_path_valid(self, request: Any) -> Any:
        """Answer whether the rest of a path, from the pose nearest to the robot on, is free."""
        path, costmap, robot = path_array(request.path), self._costmap.costmap, self._robot_pose.in_map()
        if not len(path) or costmap is None or robot is None:
            return new(IsPathValid.Response, is_valid=False)
        nearest = int(np.argmin(np.hypot(path[:, 0] - robot.x, path[:, 1] - robot.y)))
        columns, rows = np.floor((path[nearest:, :2] - costmap.origin) / costmap.resolution).astype(int).T
        height, width = costmap.costs.shape
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        costs = costmap.costs[rows[inside], columns[inside]]
        blocked = (costs >= INSCRIBED_INFLATED_OBSTACLE) & (costs != NO_INFORMATION)
        return new(IsPathValid.Response, is_valid=bool(inside.all() and not blocked.any()))
