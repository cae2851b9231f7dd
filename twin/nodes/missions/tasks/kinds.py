"""What tasks there are for every robot that navigates: drive to a place, dock, undock, wait."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from twin.bridge import types
from twin.bridge.action_types import DockRobot, NavigateToPose, UndockRobot, Wait
from twin.bridge.actions import ActionClient
from twin.bridge.conversions import pose2_from_pose, pose_from_pose2
from twin.bridge.msgs import OccupancyGrid, new, ns
from twin.bridge.qos import LATCHED
from twin.errors import TaskError, nearest
from twin.geometry import Array, Pose2
from twin.navigation.behavior_trees.node import TreeNode
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.nodes.messages import pose_stamped
from twin.nodes.missions.leaves import CallAction
from twin.nodes.missions.mission_node import MissionNode
from twin.nodes.missions.random_goals import open_places
from twin.nodes.navigation.mapping.map_server import occupancy_map
from twin.nodes.navigation.robot_pose import RobotPose


class TaskKind(ABC):
    """Tasks of one type."""

    name: str
    """The type."""

    @abstractmethod
    def check(self, task: Any) -> str:
        """Return the task for people.

        Raises:
            TaskError: it cannot be done: a sentence that says what could.
        """

    @abstractmethod
    def tree(self, task: Any) -> TreeNode:
        """Return what does it, now that its turn has come.

        Raises:
            TaskError: it cannot be done any more.
        """

    def places(self) -> Sequence[Any]:
        """Return what its tasks can name, each a `twin_msgs/msg/Place`."""
        return ()

    def tidy(self) -> TreeNode | None:
        """Return what is to be put away after a task that was broken off, before another one begins."""
        return None


def place(kind: str, name: str, pose: Pose2) -> Any:
    """Return a `twin_msgs/msg/Place`."""
    return types.get("twin_msgs/msg/Place")(kind=kind, name=name, pose=pose_from_pose2(pose))


class DriveTo(TaskKind):
    """Drive to a named place, or to a pose that the map says is free and can be reached."""

    name = "drive_to"

    def __init__(
        self, mission: MissionNode, robot_pose: RobotPose, places: Mapping[str, Pose2], clearance: float
    ) -> None:
        """Listen to `map`, and be a client of `navigate_to_pose`.

        Args:
            mission: Whose tasks these are.
            robot_pose: Where the robot is.
            places: Poses in the map by their names.
            clearance: Of a pose without a name from everything that is not free [m].
        """
        self._mission, self._robot_pose, self._clearance = mission, robot_pose, clearance
        self._places = places
        self._frame = robot_pose.frames.map
        self._client = ActionClient(mission.node, NavigateToPose, "navigate_to_pose")
        self._map: OccupancyMap | None = None
        mission.node.create_subscription(OccupancyGrid, "map", self._on_map, LATCHED)

    def _on_map(self, message: OccupancyGrid) -> None:
        self._map = occupancy_map(message)

    def check(self, task: Any) -> str:
        """Find the place, or look at the pose on the map."""
        if task.place:
            self._named(task.place)
            return f"drive to {task.place}"
        frame, goal = task.pose.header.frame_id, pose2_from_pose(task.pose.pose)
        if frame not in ("", self._frame):
            raise TaskError(f"the pose is in the frame '{frame}'; valid: {self._frame}")
        if not all(map(math.isfinite, goal)):
            raise TaskError("the pose is not finite; valid: x and y in m, and a quaternion")
        robot = self._robot_pose.in_map()
        if self._map is not None and robot is not None:
            self._check_room(goal, open_places(self._map, robot, self._clearance), self._map.resolution)
        return f"drive to ({goal.x:.2f}, {goal.y:.2f}), {math.degrees(goal.yaw):.0f}°"

    def _check_room(self, goal: Pose2, places: Array, apart: float) -> None:
        if not len(places):
            raise TaskError("the map has no free place around the robot")
        away = np.hypot(places[:, 0] - goal.x, places[:, 1] - goal.y)
        if away.min() > apart:
            x, y = places[int(np.argmin(away))].tolist()
            raise TaskError(
                f"({goal.x:.2f}, {goal.y:.2f}) is in a wall, or cannot be reached; "
                f"the nearest place that can is ({x:.2f}, {y:.2f})"
            )

    def _named(self, name: str) -> Pose2:
        if name not in self._places:
            raise TaskError(f"there is no place '{name}'; {nearest(name, self._places)}")
        return self._places[name]

    def tree(self, task: Any) -> TreeNode:
        """Navigate."""
        pose = self._named(task.place) if task.place else pose2_from_pose(task.pose.pose)

        def goal() -> Any:
            return new(NavigateToPose.Goal, pose=pose_stamped(pose, self._frame, self._mission.node.now_ns))

        return CallAction("NavigateTo", self._client, goal, on_failure=self._mission.note)

    def places(self) -> Sequence[Any]:
        """Return the named ones."""
        return [place("pose", name, pose) for name, pose in self._places.items()]


class Dock(TaskKind):
    """Drive to a dock, and dock."""

    name = "dock"

    def __init__(self, mission: MissionNode, docks: Mapping[str, Pose2]) -> None:
        """Be a client of `dock_robot`; docks by name are where the base stands in the map."""
        self._mission, self._docks = mission, docks
        self._client = ActionClient(mission.node, DockRobot, "dock_robot")

    def check(self, task: Any) -> str:
        """Find the dock."""
        if task.dock not in self._docks:
            raise TaskError(f"there is no dock '{task.dock}'; {nearest(task.dock, self._docks)}")
        return f"dock at {task.dock}"

    def tree(self, task: Any) -> TreeNode:
        """Dock."""
        goal = new(DockRobot.Goal, use_dock_id=True, dock_id=task.dock, max_staging_time=1000.0)
        return CallAction("Dock", self._client, lambda: goal, on_failure=self._mission.note)

    def places(self) -> Sequence[Any]:
        """Return the docks."""
        return [place("dock", name, pose) for name, pose in self._docks.items()]


class Undock(TaskKind):
    """Leave the dock."""

    name = "undock"

    def __init__(self, mission: MissionNode) -> None:
        """Be a client of `undock_robot`."""
        self._mission = mission
        self._client = ActionClient(mission.node, UndockRobot, "undock_robot")

    def check(self, task: Any) -> str:
        """Accept it: the docking server knows whether the robot is docked."""
        return "undock"

    def tree(self, task: Any) -> TreeNode:
        """Undock."""
        return CallAction(
            "Undock", self._client, lambda: new(UndockRobot.Goal), on_failure=self._mission.note
        )


class WaitFor(TaskKind):
    """Stand still for some time."""

    name = "wait"

    def __init__(self, mission: MissionNode) -> None:
        """Be a client of `wait`."""
        self._mission = mission
        self._client = ActionClient(mission.node, Wait, "wait")

    def check(self, task: Any) -> str:
        """Look at the time."""
        seconds = ns(task.duration) * 1e-9
        if seconds <= 0.0:
            raise TaskError(f"a wait of {seconds:g} s is none; valid: a duration of more than 0 s")
        return f"wait {seconds:g} s"

    def tree(self, task: Any) -> TreeNode:
        """Wait."""
        goal = new(Wait.Goal, time=task.duration)
        return CallAction("Wait", self._client, lambda: goal, on_failure=self._mission.note)
