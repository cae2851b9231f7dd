"""The goals of a mission on their way to the navigator, where an agent may take them over."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from twin.bridge.action_types import NavigateToPose
from twin.bridge.actions import ActionClient, ClientGoal
from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import GoalStatus, new
from twin.bridge.node import Node
from twin.geometry import Pose2
from twin.nodes.messages import pose_stamped
from twin.nodes.navigation.robot_pose import RobotPose

ACTION = "navigate_to_pose"


class MissionGoal:
    """One goal that a node of the mission sends to the navigator."""

    def __init__(self, client: ActionClient, goal: ClientGoal, message: Any, pose: Pose2) -> None:
        self.pose = pose
        """Where the mission wants the robot, in `map`."""
        self._client, self._goal, self._message = client, goal, message

    @property
    def waits(self) -> bool:
        """Whether it waits for an agent's decision."""
        return self._goal.held

    @property
    def done(self) -> bool:
        """Whether it is reached, given up or cancelled."""
        return self._goal.done

    @property
    def reached(self) -> bool:
        """Whether it ended with success."""
        return self._goal.done and self._goal.succeeded

    def send(self, pose: Pose2, frame: str) -> None:
        """Send it to the navigator: the mission's own message if the pose is its own, else with another.

        Args:
            pose: Where the robot is to go, in `frame`.
            frame: Name of the frame `map`.
        """
        message = self._message
        if pose != self.pose:
            target = pose_stamped(pose, frame, self._client.node.now_ns)
            message = new(NavigateToPose.Goal, pose=target, behavior_tree=message.behavior_tree)
        self._client.post(self._goal, message)

    def succeed(self) -> None:
        """Tell the mission that the robot is there, instead of the navigator."""
        self._client.answer(self._goal, GoalStatus.STATUS_SUCCEEDED)


class Task:
    """What the mission wants of one robot: its last goal, and how many have been reached."""

    def __init__(self, bus: Bus, deciders: Collection[Node], robot_pose: RobotPose, namespace: str) -> None:
        """Look at all goals from now on.

        Args:
            bus: Of the run.
            deciders: The nodes whose goals count: the missions'.
            robot_pose: The robot's frames and transforms.
            namespace: Of the robot: '' or '/name'.
        """
        self.last: MissionGoal | None = None
        self.holding = False
        """Whether goals wait for the agent, instead of going to the navigator."""
        self._settled = 0
        self._deciders, self._robot_pose = deciders, robot_pose
        self._action = f"{namespace}/{ACTION}"
        bus.hold_goal = self._on_goal

    @property
    def goal(self) -> Pose2 | None:
        """Where the mission wants the robot now, in `map`; None: nowhere."""
        return None if self.last is None or self.last.done else self.last.pose

    @property
    def reached(self) -> int:
        """Goals that ended with success so far."""
        return self._settled + (self.last is not None and self.last.reached)

    @property
    def is_set(self) -> bool:
        """Whether a node of the mission has a client of the navigator at all."""
        service = f"{self._action}/_action/send_goal"
        return any(getattr(end, "name", "") == service for node in self._deciders for end in node.endpoints)

    def _on_goal(self, client: ActionClient, goal: ClientGoal, message: Any) -> bool:
        if client.name != self._action or client.node not in self._deciders:
            return False
        self._settled = self.reached
        self.last = MissionGoal(client, goal, message, self._in_map(message.pose))
        return self.holding

    def _in_map(self, target: Any) -> Pose2:
        pose, frame, here = pose2_from_pose(target.pose), target.header.frame_id, self._robot_pose
        T_map_frame = None if frame in ("", here.frames.map) else here.relative(here.frames.map, frame)
        return pose if T_map_frame is None else T_map_frame @ pose
