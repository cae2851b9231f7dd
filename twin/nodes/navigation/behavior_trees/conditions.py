"""Nav2's conditions on errors, goals, poses and paths, and on the robot's state (plugins/condition)."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import BatteryState, Path, new
from twin.geometry import Pose2
from twin.navigation.behavior_trees import paths
from twin.navigation.behavior_trees.node import ConditionNode, NodeSetup
from twin.navigation.behavior_trees.ports import Port, inputs
from twin.nodes.messages import path_array
from twin.nodes.navigation.behavior_trees.context import NavigatorContext

_FRAMES = inputs(global_frame="string", robot_base_frame="string")
_BRAKE_LIMIT = -10.0
"""IsStuck's, fixed in Nav2 too [m/s²]."""


class NavigatorCondition(ConditionNode):
    """A condition that needs what the navigator has."""

    context: NavigatorContext

    def robot(self) -> Pose2 | None:
        """Return the robot's pose in the node's frames; None while it is not known."""
        return self.context.pose(self.get("global_frame"), self.get("robot_base_frame"))


class AreErrorCodesPresent(NavigatorCondition):
    """Whether an error code is one of some."""

    PORTS = inputs(error_code="unsigned", error_codes_to_check="ints")
    CODES: ClassVar[tuple[int, ...]] = ()

    def holds(self) -> bool:
        """Look."""
        codes = self.get("error_codes_to_check") or self.CODES
        return self.get("error_code") in codes


class WouldAControllerRecoveryHelp(AreErrorCodesPresent):
    """Whether following failed for a reason that may go away: unknown, patience, progress, control."""

    CODES = (100, 104, 105, 106)


class WouldAPlannerRecoveryHelp(AreErrorCodesPresent):
    """Whether planning failed for a reason that may go away: unknown, time-out, no valid path."""

    CODES = (200, 207, 208, 300, 307, 308)


class WouldASmootherRecoveryHelp(AreErrorCodesPresent):
    """Whether smoothing failed for a reason that may go away: unknown, time-out, failed, in collision."""

    CODES = (500, 502, 504, 503)


class GlobalUpdatedGoal(NavigatorCondition):
    """Whether the goal has changed since the last tick; true at the first one."""

    PORTS = inputs(goal="message", goals="message")
    _goal: Any = None

    def holds(self) -> bool:
        """Compare."""
        before, self._goal = self._goal, (self.get_or_entry("goal"), self.get_or_entry("goals"))
        return bool(before != self._goal)


class GoalUpdated(GlobalUpdatedGoal):
    """Whether the goal has changed since this node began to be ticked."""

    def holds(self) -> bool:
        """Compare."""
        return super().holds() and self.status.is_active


class GoalReached(NavigatorCondition):
    """Whether the robot is as near to the goal as the navigator's `goal_reached_tol`."""

    PORTS = (*inputs(goal="message"), *_FRAMES)

    def holds(self) -> bool:
        """Measure."""
        goal = self.get("goal")
        if goal is None:
            return False
        pose = self.context.pose(goal.header.frame_id or None, self.get("robot_base_frame"))
        near = self.context.goal_reached_tol
        return pose is not None and pose.distance(pose2_from_pose(goal.pose)) <= near


class ArePosesNear(NavigatorCondition):
    """Whether two poses are near to each other."""

    PORTS = inputs(
        ref_pose="message", target_pose="message", global_frame="string", tolerance=("double", 0.5)
    )

    def holds(self) -> bool:
        """Measure, in the map frame."""
        one, two = self.get("ref_pose"), self.get("target_pose")
        one, two = (pose and self.context.in_map(pose) for pose in (one, two))
        if one is None or two is None:
            return False
        return pose2_from_pose(one.pose).distance(pose2_from_pose(two.pose)) <= float(self.get("tolerance"))


class DistanceTraveled(NavigatorCondition):
    """Whether the robot is so far from where it was last time this held."""

    PORTS = (*inputs(distance=("double", 1.0)), *_FRAMES)
    _start: Pose2 | None = None

    def holds(self) -> bool:
        """Measure; begins to count at the first tick."""
        pose = self.robot()
        if not self.status.is_active or self._start is None:
            self._start = pose
            return False
        if pose is None or self._start.distance(pose) < self.get("distance"):
            return False
        self._start = pose
        return True


class TimeExpired(NavigatorCondition):
    """Whether so much time has passed since this held last."""

    PORTS = inputs(seconds=("double", 1.0))
    _start = 0

    def holds(self) -> bool:
        """Look at the clock; begins to count at the first tick."""
        now = self.context.now_ns()
        if self.status.is_active and now - self._start < self.get("seconds") * 1e9:
            return False
        is_late, self._start = self.status.is_active, now
        return is_late


class PathExpiringTimer(NavigatorCondition):
    """Whether a path has been the same for so long."""

    PORTS = inputs(seconds=("double", 1.0), path="message")
    _start: int | None = None
    _path: Any = None

    def holds(self) -> bool:
        """Look at the clock; a new path sets it back."""
        now, path = self.context.now_ns(), self.get("path")
        if self._start is None or (path is not self._path and path != self._path):
            self._start, self._path = now, path
            return False
        if now - self._start < self.get("seconds") * 1e9:
            return False
        self._start = now
        return True


class IsGoalNearby(NavigatorCondition):
    """Whether less than so much of a path is left."""

    PORTS = (
        *inputs(path="message", proximity_threshold=("double", 1.0)),
        *inputs(max_robot_pose_search_dist=("limit", -1.0)),
        *_FRAMES,
    )
    _path: Any = None
    _nearest = 0

    def holds(self) -> bool:
        """Measure from the pose nearest to the robot."""
        path = self.get("path") or new(Path)
        pose = self.context.pose(path.header.frame_id or None, self.get("robot_base_frame"))
        if not path.poses or pose is None:
            return False
        window = self.get("max_robot_pose_search_dist")
        if window < 0.0 or path is not self._path:
            self._path, self._nearest = path, 0
        points = path_array(path)
        reach = math.inf if window < 0.0 else window
        self._nearest = paths.nearest(points, pose.x, pose.y, self._nearest, reach)
        return paths.length(points, self._nearest) < float(self.get("proximity_threshold"))


class IsWithinPathTrackingBounds(NavigatorCondition):
    """Whether the controller tells that the robot is near its path; true while it tells nothing."""

    PORTS = (
        *inputs(max_error_left=("limit", 0.5), max_error_right=("limit", 0.5)),
        *inputs(max_error_heading=("limit", 3.14), tracking_feedback="message"),
    )

    def holds(self) -> bool:
        """Look at the feedback; errors to the left are positive."""
        feedback = self.get("tracking_feedback")
        if feedback is None:
            return True
        aside = feedback.position_tracking_error
        limit = abs(self.get("max_error_left" if aside >= 0.0 else "max_error_right"))
        turned = abs(feedback.heading_tracking_error)
        return bool(abs(aside) <= limit and turned <= abs(self.get("max_error_heading")))


class InitialPoseReceived(NavigatorCondition):
    """Whether the blackboard says that an initial pose was received."""

    PORTS = inputs(initial_pose_received="bool")

    def holds(self) -> bool:
        """Look."""
        return bool(self.get_or_entry("initial_pose_received"))


class TransformAvailable(NavigatorCondition):
    """Whether two frames are connected; once they were, for ever."""

    PORTS = (Port("child", required=True), Port("parent", required=True))
    _was_found = False

    def holds(self) -> bool:
        """Look it up."""
        if not self._was_found:
            found = self.context.robot_pose.relative(self.get("parent"), self.get("child"))
            self._was_found = found is not None
        return self._was_found


class _Battery(NavigatorCondition):
    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._battery = self.context.latest(BatteryState, self.get("battery_topic"))


class IsBatteryLow(_Battery):
    """Whether the battery's percentage (0 to 1), or voltage, is as low as `min_battery`."""

    PORTS = (
        Port("min_battery", "double", required=True),
        *inputs(battery_topic=("string", "battery_status"), is_voltage=("bool", False)),
    )

    def holds(self) -> bool:
        """Look; false before the first message."""
        state = self._battery.message
        if state is None:
            return False
        level = state.voltage if self.get("is_voltage") else state.percentage
        return bool(level <= self.get("min_battery"))


class IsBatteryCharging(_Battery):
    """Whether the battery is being charged."""

    PORTS = inputs(battery_topic=("string", "battery_status"))

    def holds(self) -> bool:
        """Look; false before the first message."""
        state = self._battery.message
        charging = BatteryState.POWER_SUPPLY_STATUS_CHARGING
        return state is not None and state.power_supply_status == charging


class IsStuck(NavigatorCondition):
    """Whether the robot has just lost speed as it can only by a bump."""

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._odometer = self.context.odometer

    def holds(self) -> bool:
        """Look at odometry."""
        return self._odometer.acceleration < _BRAKE_LIMIT
