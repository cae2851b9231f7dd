"""Nav2's leaves that are actions: planning, following, recoveries, navigation, docking (plugins/action)."""

from __future__ import annotations

from typing import Any, ClassVar

from twin.bridge import action_types
from twin.bridge.msgs import Path, Point, duration, new
from twin.navigation.behavior_trees.node import Status
from twin.navigation.behavior_trees.ports import inputs, outputs
from twin.nodes.navigation.behavior_trees.action_node import (
    ACTION_PORTS,
    ERROR_PORTS,
    ActionNode,
)
from twin.nodes.navigation.behavior_trees.context import fill

_BASIC = ACTION_PORTS + ERROR_PORTS
_LONGEST = 2.0**31 - 1.0
"""What a Duration message can hold [s]: 68 years."""


def seconds(value: float) -> Any:
    """Return seconds as a Duration message, the longest there is if they are more."""
    return duration(round(min(max(value, -_LONGEST), _LONGEST) * 1e9))


class _Planning(ActionNode):
    """Leaves an empty path on the blackboard when there is no plan."""

    RESULTS: ClassVar[tuple[tuple[str, str], ...]] = (("path", "path"),)

    def on_aborted(self, result: Any) -> Status:
        """Write the error, and an empty path."""
        self.put("path", new(Path))
        return super().on_aborted(result)

    def on_cancelled(self) -> Status:
        """Leave an empty path."""
        self.put("path", new(Path))
        return Status.SUCCESS


class ComputePathToPose(_Planning):
    """Plans from the robot, or from `start`, to `goal`."""

    ACTION, SERVER = action_types.ComputePathToPose, "compute_path_to_pose"
    PORTS = (
        *_BASIC,
        *inputs(goal="message", start="message", viapoints="message", use_start="bool"),
        *inputs(planner_id=("string", "")),
        *outputs(path="message"),
    )

    def make_goal(self) -> Any | None:
        """Return the goal; `use_start` without a start is ignored."""
        start, use_start = self.get("start"), self.get("use_start")
        return fill(
            self.ACTION.Goal,
            goal=self.get("goal"),
            start=start,
            use_start=start is not None and use_start is not False,
            planner_id=self.get("planner_id"),
            viapoints=self.get("viapoints"),
        )


class ComputePathThroughPoses(_Planning):
    """Plans from the robot, or from `start`, through all `goals`."""

    ACTION, SERVER = action_types.ComputePathThroughPoses, "compute_path_through_poses"
    PORTS = (
        *_BASIC,
        *inputs(goals="message", start="message", planner_id=("string", "")),
        *outputs(path="message", last_reached_index="int"),
    )
    RESULTS = (("path", "path"), ("last_reached_index", "last_reached_index"))

    def make_goal(self) -> Any | None:
        """Return the goal."""
        start = self.get("start")
        return fill(
            self.ACTION.Goal,
            goals=self.get("goals"),
            start=start,
            use_start=start is not None,
            planner_id=self.get("planner_id"),
        )


class SmoothPath(ActionNode):
    """Smooths a path."""

    ACTION, SERVER = action_types.SmoothPath, "smooth_path"
    PORTS = (
        *_BASIC,
        *inputs(unsmoothed_path="message", max_smoothing_duration=("double", 3.0)),
        *inputs(check_for_collisions=("bool", False), smoother_id=("string", "")),
        *outputs(smoothed_path="message", smoothing_duration="double", was_completed="bool"),
    )
    RESULTS = (("path", "smoothed_path"), ("was_completed", "was_completed"))

    def make_goal(self) -> Any | None:
        """Return the goal."""
        return fill(
            self.ACTION.Goal,
            path=self.get("unsmoothed_path"),
            smoother_id=self.get("smoother_id"),
            max_smoothing_duration=seconds(self.get("max_smoothing_duration")),
            check_for_collisions=self.get("check_for_collisions"),
        )

    def on_success(self, result: Any) -> Status:
        """Write the path and how long it took [s]."""
        took = result.smoothing_duration
        self.put("smoothing_duration", took.sec + took.nanosec * 1e-9)
        return super().on_success(result)


class FollowPath(ActionNode):
    """Follows a path; a new one, or another plugin, preempts without a stop."""

    ACTION, SERVER = action_types.FollowPath, "follow_path"
    _IDS = ("controller_id", "goal_checker_id", "progress_checker_id", "path_handler_id")
    PORTS = (
        *_BASIC,
        *inputs(path="message", **dict.fromkeys(_IDS, ("string", ""))),
        *outputs(tracking_feedback="message"),
    )

    def make_goal(self) -> Any | None:
        """Return the goal, and remember what it was made of; None for the empty path of a failed planner."""
        self._path = self.get("path")
        if self._path is not None and not len(self._path.poses):
            return None
        self._ids = [self.get(name) for name in self._IDS]
        return fill(self.ACTION.Goal, path=self._path, **dict(zip(self._IDS, self._ids, strict=True)))

    def updated_goal(self) -> Any | None:
        """Return a goal with the present path and plugins, if they have changed."""
        path, ids = self.get("path"), [self.get(name) for name in self._IDS]
        # A path is a new object when it is planned anew; comparing first by identity is cheap.
        is_new = path is not self._path and path is not None and len(path.poses) and path != self._path
        if ids == self._ids and not is_new:
            return None
        if not is_new:
            path = self._path
        self._path, self._ids = path, ids
        return fill(self.ACTION.Goal, path=path, **dict(zip(self._IDS, ids, strict=True)))


class Spin(ActionNode):
    """Turns on the spot."""

    ACTION, SERVER = action_types.Spin, "spin"
    PORTS = (
        *_BASIC,
        *inputs(spin_dist=("double", 1.57), time_allowance=("double", 10.0)),
        *inputs(is_recovery=("bool", True), disable_collision_checks=("bool", False)),
    )

    def make_goal(self) -> Any | None:
        """Return the goal; a recovery unless `is_recovery` says otherwise."""
        if self.get("is_recovery"):
            self.count_recovery()
        return fill(
            self.ACTION.Goal,
            target_yaw=self.get("spin_dist"),
            time_allowance=seconds(self.get("time_allowance")),
            disable_collision_checks=self.get("disable_collision_checks"),
        )


class BackUp(ActionNode):
    """Drives straight back."""

    ACTION, SERVER = action_types.BackUp, "backup"
    PORTS = (
        *_BASIC,
        *inputs(backup_dist=("double", 0.15), backup_speed=("double", 0.025)),
        *inputs(time_allowance=("double", 10.0), disable_collision_checks=("bool", False)),
    )

    def make_goal(self) -> Any | None:
        """Return the goal; always a recovery."""
        self.count_recovery()
        return fill(
            self.ACTION.Goal,
            target=Point(x=self.get("backup_dist"), y=0.0, z=0.0),
            speed=self.get("backup_speed"),
            time_allowance=seconds(self.get("time_allowance")),
            disable_collision_checks=self.get("disable_collision_checks"),
        )


class DriveOnHeading(ActionNode):
    """Drives straight."""

    ACTION, SERVER = action_types.DriveOnHeading, "drive_on_heading"
    PORTS = (
        *_BASIC,
        *inputs(dist_to_travel=("double", 0.15), speed=("double", 0.025)),
        *inputs(time_allowance=("double", 10.0), disable_collision_checks=("bool", False)),
    )

    def make_goal(self) -> Any | None:
        """Return the goal."""
        return fill(
            self.ACTION.Goal,
            target=Point(x=self.get("dist_to_travel"), y=0.0, z=0.0),
            speed=self.get("speed"),
            time_allowance=seconds(self.get("time_allowance")),
            disable_collision_checks=self.get("disable_collision_checks"),
        )


class Wait(ActionNode):
    """Stands still; always a recovery."""

    ACTION, SERVER = action_types.Wait, "wait"
    PORTS = (*_BASIC, *inputs(wait_duration=("double", 1.0)))

    def make_goal(self) -> Any | None:
        """Return the goal."""
        self.count_recovery()
        return new(self.ACTION.Goal, time=seconds(abs(self.get("wait_duration"))))


class AssistedTeleop(ActionNode):
    """Lets somebody steer, without collisions; time running out is a failure of a recovery only."""

    ACTION, SERVER = action_types.AssistedTeleop, "assisted_teleop"
    PORTS = (*_BASIC, *inputs(time_allowance=("double", 10.0), is_recovery=("bool", False)))

    def make_goal(self) -> Any | None:
        """Return the goal."""
        if self.get("is_recovery"):
            self.count_recovery()
        return new(self.ACTION.Goal, time_allowance=seconds(self.get("time_allowance")))

    def on_aborted(self, result: Any) -> Status:
        """Write the error."""
        super().on_aborted(result)
        return Status.FAILURE if self.get("is_recovery") else Status.SUCCESS


class NavigateToPose(ActionNode):
    """Navigates with another navigator's action."""

    ACTION, SERVER = action_types.NavigateToPose, "navigate_to_pose"
    PORTS = (*_BASIC, *inputs(goal="message", behavior_tree=("string", "")))

    def make_goal(self) -> Any | None:
        """Return the goal; none without a pose."""
        goal = self.get("goal")
        if goal is None:
            return None
        return new(self.ACTION.Goal, pose=goal, behavior_tree=self.get("behavior_tree"))


class NavigateThroughPoses(ActionNode):
    """Navigates through poses with another navigator's action."""

    ACTION, SERVER = action_types.NavigateThroughPoses, "navigate_through_poses"
    PORTS = (*_BASIC, *inputs(goals="message", behavior_tree=("string", "")))

    def make_goal(self) -> Any | None:
        """Return the goal; none without poses."""
        goals = self.get("goals")
        if not goals:
            return None
        return new(self.ACTION.Goal, poses=goals, behavior_tree=self.get("behavior_tree"))


class DockRobot(ActionNode):
    """Docks (opennav_docking_bt)."""

    ACTION, SERVER = action_types.DockRobot, "dock_robot"
    PORTS = (
        *_BASIC,
        *inputs(use_dock_id=("bool", True), dock_id=("string", ""), dock_pose="message"),
        *inputs(dock_type=("string", ""), max_staging_time=("double", 1000.0)),
        *inputs(navigate_to_staging_pose=("bool", True)),
        *outputs(success="bool", num_retries="int"),
    )
    RESULTS = (("success", "success"), ("num_retries", "num_retries"))

    def make_goal(self) -> Any | None:
        """Return the goal."""
        return fill(
            self.ACTION.Goal,
            use_dock_id=self.get("use_dock_id"),
            dock_id=self.get("dock_id"),
            dock_pose=self.get("dock_pose"),
            dock_type=self.get("dock_type"),
            max_staging_time=self.get("max_staging_time"),
            navigate_to_staging_pose=self.get("navigate_to_staging_pose"),
        )


class UndockRobot(ActionNode):
    """Undocks (opennav_docking_bt)."""

    ACTION, SERVER = action_types.UndockRobot, "undock_robot"
    PORTS = (
        *_BASIC,
        *inputs(dock_type=("string", ""), max_undocking_time=("double", 30.0)),
        *outputs(success="bool"),
    )
    RESULTS = (("success", "success"),)

    def make_goal(self) -> Any | None:
        """Return the goal."""
        return fill(
            self.ACTION.Goal,
            dock_type=self.get("dock_type"),
            max_undocking_time=self.get("max_undocking_time"),
        )
