"""`/docking_server`: the actions `dock_robot` and `undock_robot`, as in Nav2's opennav_docking.

The map tells where to expect a dock; scans and detectors tell where it is. What lies behind a dock's
face is its own business: a charger, a shelf, a table.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import replace
from typing import Any

import numpy as np

from twin.bridge.action_types import DockRobot, NavigateToPose, UndockRobot
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import BatteryState, new
from twin.geometry import Array, Pose2
from twin.navigation.docking.docks import Dock, DockError, DockType
from twin.nodes.messages import pose_stamped
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.docking.attempt import (
    FAILED_TO_CHARGE,
    FAILED_TO_CONTROL,
    FAILED_TO_DETECT_DOCK,
    FAILED_TO_STAGE,
    PERCEPTION,
    RETRY,
    STAGING,
    WAITING,
    Attempt,
    Cancelled,
)
from twin.nodes.navigation.docking.config import DockingServerConfig
from twin.nodes.navigation.docking.detection import DockDetection
from twin.nodes.navigation.docking.drive import BlindError, DockDrive
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.node_parameters import declare_config

Work = Generator[int | None, None, Any]


class DockingServerNode:
    """Takes what `DockDetection` does, and `battery_state`; drives by `DockDrive`."""

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        config: DockingServerConfig | None = None,
        *,
        costmap: CostmapNode | None = None,
        footprint: Array | None = None,
        boxes: str = "box_poses",
        namespace: str = "",
    ) -> None:
        """Make the node; `boxes` is the topic of what docks with the detection `box` line up with."""
        self.node = bus.create_node("docking_server", namespace)
        self.config = config or DockingServerConfig()
        declare_config(self.node, self.config)
        self._robot_pose = robot_pose
        self._detection = DockDetection(self.node, robot_pose, self.config.estimate, boxes)
        self._current = 0.0
        """Into the battery [A]."""
        self._left_for: Pose2 | None = None
        """Docked pose of the dock last driven to, in `odom`: where to undock from; None after undocking."""
        self._docked_type = ""
        """Of the dock at which the robot stands; '' if it does not."""
        self._drive = DockDrive(
            self.node,
            robot_pose,
            self.config.controller,
            costmap,
            np.zeros((1, 2)) if footprint is None else footprint,
            self.config.controller_period_ns,
        )
        self._navigator = ActionClient(self.node, NavigateToPose, "navigate_to_pose")
        self.node.create_subscription(BatteryState, "battery_state", self._on_battery_state, 1)
        ActionServer(self.node, DockRobot, "dock_robot", self._serving(self._dock_robot), _is_finite)
        ActionServer(self.node, UndockRobot, "undock_robot", self._serving(self._undock_robot), _is_finite)

    def _on_battery_state(self, message: BatteryState) -> None:
        self._current = message.current

    def _serving(self, work: Callable[[Attempt], Work]) -> Callable[[GoalHandle], Work]:
        """Return what serves an action: it ends as its work ends, and the robot stands."""

        def serve(handle: GoalHandle) -> Work:
            attempt = Attempt(handle, self.node.steady_ns)
            try:
                yield from work(attempt)
                return attempt.result()
            except Cancelled:
                handle.canceled()
                return attempt.result(FAILED_TO_CONTROL, "canceled")
            except DockError as error:
                handle.abort()
                return attempt.result(error.code, str(error))
            finally:
                self._drive.stop()

        return serve

    # Docking

    def _dock_robot(self, attempt: Attempt) -> Work:
        dock = self._requested(attempt.handle.request)
        type_ = self.config.database.type_of(dock.type)
        yield from self._stage(attempt, dock, type_)
        yield from self._dock_at(attempt, self._in_odom(dock), type_)
        self._docked_type = dock.type

    def _requested(self, goal: Any) -> Dock:
        if goal.use_dock_id:
            return self.config.database.find(goal.dock_id)
        pose = goal.dock_pose
        frame = pose.header.frame_id or self._robot_pose.frames.map
        return Dock(type=goal.dock_type, frame=frame, pose=pose2_from_pose(pose.pose))

    def _in_odom(self, dock: Dock) -> Pose2:
        """Return the docked pose in the odom frame, as the map has it."""
        frame = self._robot_pose.relative(self._robot_pose.frames.odom, dock.frame)
        if frame is None or self._robot_pose.in_odom() is None:
            raise DockError(FAILED_TO_DETECT_DOCK, "the robot is not localised")
        return frame @ dock.pose

    def _stage(self, attempt: Attempt, dock: Dock, type_: DockType) -> Work:
        """Navigate to the staging pose, if that is wanted and the robot is not there."""
        goal, staging = attempt.handle.request, type_.staging_pose(dock.pose)
        pose = self._robot_pose.relative(dock.frame, self._robot_pose.frames.base)
        near = pose is not None and pose.distance(staging) < self.config.dock_prestaging_tolerance
        if near or not goal.navigate_to_staging_pose:
            return
        deadline = self.node.steady_ns + round(goal.max_staging_time * 1e9)
        target = pose_stamped(staging, dock.frame, self.node.now_ns)
        sent = self._navigator.send_goal(new(NavigateToPose.Goal, pose=target))
        try:
            while not sent.done:
                attempt.tell(STAGING, self.node.steady_ns)
                if self.node.steady_ns > deadline:
                    raise DockError(
                        FAILED_TO_STAGE, f"not at the staging pose after {goal.max_staging_time:g} s"
                    )
                yield None
        finally:
            if not sent.done:
                sent.cancel()
        if not sent.succeeded:
            reason = sent.error or getattr(sent.result, "error_msg", "")
            raise DockError(FAILED_TO_STAGE, f"cannot drive to the staging pose: {reason}")

    def _dock_at(self, attempt: Attempt, expected: Pose2, type_: DockType) -> Work:
        """See the dock and approach it; after a miss drive back to the staging distance and try again."""
        detection, docked = self._detection, expected
        detection.begin(expected, type_)

        def goal() -> Pose2:
            nonlocal docked
            seen = detection.docked()
            if seen is None:
                raise DockError(FAILED_TO_DETECT_DOCK, f"lost sight of {detection.lacks}")
            docked = seen
            return docked

        def staging() -> Pose2:
            return docked @ Pose2(type_.staging_x_offset, 0.0, 0.0)

        approach = replace(self.config.dock, time_allowance=self.config.dock_approach_timeout)
        try:
            yield from self._see(attempt)
            while True:
                try:
                    yield from self._drive.drive(attempt, goal, approach)
                    return (yield from self._wait_for_charge(attempt, type_))
                except BlindError:
                    raise  # nor could it drive back
                except DockError as error:
                    self._count_retry(attempt, error)
                yield from self._back_off(attempt, staging, docked)
        finally:
            detection.end()
            self._left_for = docked

    def _count_retry(self, attempt: Attempt, error: DockError) -> None:
        if attempt.retries >= self.config.max_retries:
            raise DockError(error.code, f"docking failed: {error}") from error
        attempt.retries += 1
        self.node.get_logger().warn(f"docking attempt {attempt.retries}: {error}; trying again")

    def _see(self, attempt: Attempt) -> Work:
        deadline = self.node.steady_ns + self.config.initial_perception_timeout_ns
        while self._detection.docked() is None:
            attempt.tell(PERCEPTION, self.node.steady_ns)
            if self.node.steady_ns > deadline:
                raise DockError(FAILED_TO_DETECT_DOCK, f"no {self._detection.lacks} in sight")
            yield None

    def _back_off(self, attempt: Attempt, goal: Callable[[], Pose2], docked: Pose2) -> Work:
        attempt.tell(RETRY, self.node.steady_ns)
        config = self.config.undock
        try:
            yield from self._drive.drive(attempt, goal, config, state=RETRY, backward=True, docked=docked)
        except BlindError:
            raise
        except DockError as error:
            self.node.get_logger().warn(f"backing off: {error}")

    def _wait_for_charge(self, attempt: Attempt, type_: DockType) -> Work:
        deadline = self.node.steady_ns + self.config.wait_charge_timeout_ns
        while type_.is_charger and not self._is_charging(type_):
            self._drive.stop()
            attempt.tell(WAITING, self.node.steady_ns)
            if self.node.steady_ns > deadline:
                raise DockError(FAILED_TO_CHARGE, "docked, but the battery is not charged")
            yield None

    def _is_charging(self, type_: DockType) -> bool:
        if type_.use_battery_status:
            return bool(self._current > type_.charging_threshold)
        docked, pose = self._detection.docked(), self._robot_pose.in_odom()
        return docked is not None and pose is not None and pose.distance(docked) < type_.docking_threshold

    # Undocking

    def _undock_robot(self, attempt: Attempt) -> Work:
        goal, pose = attempt.handle.request, self._robot_pose.in_odom()
        type_ = self.config.database.type_of(goal.dock_type or self._docked_type)
        if pose is None:
            raise DockError(FAILED_TO_CONTROL, "no odometry")
        target = pose @ Pose2(-self._way_to_staging(pose, type_), 0.0, 0.0)
        config = replace(self.config.undock, time_allowance=goal.max_undocking_time)
        docked = self._left_for or pose
        yield from self._drive.drive(attempt, lambda: target, config, backward=True, docked=docked)
        self._left_for, self._docked_type = None, ""

    def _way_to_staging(self, pose: Pose2, type_: DockType) -> float:
        """Return how far to back off [m]: none if the robot never left the staging pose for the dock."""
        away = -type_.staging_x_offset
        if self._left_for is None:
            return away
        return min(max(away + (self._left_for.inverse() @ pose).x, 0.0), away)


def _is_finite(goal: Any) -> bool:
    """Whether a goal's pose and time, as far as they count, are numbers to act on."""
    if isinstance(goal, UndockRobot.Goal):
        return math.isfinite(goal.max_undocking_time)
    pose = () if goal.use_dock_id else pose2_from_pose(goal.dock_pose.pose)
    return all(map(math.isfinite, (goal.max_staging_time, *pose)))
