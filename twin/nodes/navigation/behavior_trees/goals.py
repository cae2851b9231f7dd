"""Nav2's leaves that edit the list of goals of a navigation through poses (plugins/action)."""

from __future__ import annotations

import math
from typing import ClassVar

from twin.bridge.conversions import pose2_from_pose
from twin.bridge.services import Future
from twin.bridge.types import ServiceType
from twin.navigation.behavior_trees.node import NodeSetup, Status
from twin.navigation.behavior_trees.ports import Port, inputs, outputs
from twin.nodes.navigation.behavior_trees.action_node import NavigatorNode
from twin.nodes.navigation.behavior_trees.services import SERVICE_PORTS

_GetCost = ServiceType("nav2_msgs/srv/GetCost")
_NO_INFORMATION = 255
_STATUSES = inputs(input_waypoint_statuses="message") + outputs(output_waypoint_statuses="message")


class RemovePassedGoals(NavigatorNode):
    """Removes goals from the front that the robot is near to; never the last one."""

    PORTS = (
        *inputs(input_goals="message", radius=("double", 0.5)),
        *inputs(global_frame="string", robot_base_frame="string"),
        *outputs(output_goals="message"),
        *_STATUSES,
    )

    def tick(self) -> Status:
        """Look how far the robot is from the goals."""
        goals = list(self.get("input_goals") or [])
        if not goals:
            self.put("output_goals", goals)
            return Status.SUCCESS
        pose = self.context.pose(goals[0].header.frame_id, self.get("robot_base_frame"))
        if pose is None:
            return Status.FAILURE
        while len(goals) > 1 and pose2_from_pose(goals[0].pose).distance(pose) <= self.get("radius"):
            goals.pop(0)
        self.put("output_goals", goals)
        return Status.SUCCESS


class RemoveInCollisionGoals(NavigatorNode):
    """Removes goals whose cost in the global costmap is too high."""

    PORTS = (
        *SERVICE_PORTS,
        *inputs(input_goals="message", cost_threshold=("double", 254.0), use_footprint=("bool", True)),
        *inputs(consider_unknown_as_obstacle=("bool", False)),
        *outputs(output_goals="message"),
        *_STATUSES,
    )

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        name = self.get("service_name") or "global_costmap/get_cost_global_costmap"
        self._client = self.context.service_client(_GetCost, name)
        self._asked: list[Future] = []

    def tick(self) -> Status:
        """Ask for the cost of every goal; when all are known, keep the free ones."""
        goals = list(self.get("input_goals") or [])
        if not goals:
            self.put("output_goals", goals)
            return Status.FAILURE
        if not self._asked:
            for x, y, yaw in (pose2_from_pose(goal.pose) for goal in goals):
                request = self.filled(_GetCost.Request, x=x, y=y, theta=yaw)
                self._asked.append(self._client.call_async(request))
        if not all(future.done for future in self._asked):
            return Status.RUNNING
        asked, self._asked = self._asked, []
        if any(future.error is not None for future in asked):
            self.put("output_goals", goals)
            return Status.FAILURE
        costs = [float(future.result.cost) for future in asked]
        self.put("output_goals", [g for g, cost in zip(goals, costs, strict=True) if self._is_free(cost)])
        return Status.SUCCESS

    def halt(self) -> None:
        """Wait no more."""
        self._asked = []

    def _is_free(self, cost: float) -> bool:
        if cost == _NO_INFORMATION or math.isnan(cost):
            return not self.get("consider_unknown_as_obstacle")
        return bool(cost < self.get("cost_threshold"))


class GetNextFewGoals(NavigatorNode):
    """Takes the first goals of a list."""

    PORTS = (*inputs(input_goals="message", num_goals="int"), *outputs(output_goals="message"))

    def tick(self) -> Status:
        """Take them; fails without any."""
        goals = self.get("input_goals")
        if not goals:
            return Status.FAILURE
        self.put("output_goals", list(goals)[: self.get("num_goals") or 0])
        return Status.SUCCESS


class AppendGoalPoseToGoals(NavigatorNode):
    """Puts a goal behind a list of goals."""

    PORTS: ClassVar[tuple[Port, ...]] = (
        *inputs(goal_pose="message", input_goals="message"),
        *outputs(output_goals="message"),
    )

    def tick(self) -> Status:
        """Append it; fails without a goal."""
        goal = self.get("goal_pose")
        if goal is None:
            return Status.FAILURE
        self.put("output_goals", [*(self.get("input_goals") or []), goal])
        return Status.SUCCESS
