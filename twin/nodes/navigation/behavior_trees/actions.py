"""Nav2's leaves that are actions: planning, following, recoveries, navigation, docking (plugins/action)."""

from __future__ import annotations

from typing import Any, ClassVar

from twin.bridge import action_types
from twin.bridge.msgs import Path, Point, new
from twin.navigation.behavior_trees.node import Status
from twin.navigation.behavior_trees.ports import inputs, outputs
from twin.nodes.navigation.behavior_trees.action_node import ACTION_PORTS, ERROR_PORTS, ActionNode
from twin.nodes.navigation.behavior_trees.context import seconds

_BASIC = ACTION_PORTS + ERROR_PORTS


class _Planning(ActionNode):
    """Leaves an empty path on the blackboard when there is no plan."""

    def make_goal(self, **values: Any) -> Any | None:
        """Return the goal; `use_start` without a start is ignored."""
        use = "use_start" not in self._ports or self.get("use_start") is not False
        return super().make_goal(use_start=use and self.get("start") is not None, **values)

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


class ComputePathThroughPoses(_Planning):
    """Plans from the robot, or from `start`, through all `goals`."""

    ACTION, SERVER = action_types.ComputePathThroughPoses, "compute_path_through_poses"
    PORTS = (
        *_BASIC,
        *inputs(goals="message", start="message", planner_id=("string", "")),
        *outputs(path="message", last_reached_index="int"),
    )


class SmoothPath(ActionNode):
    """Smooths a path."""

    ACTION, SERVER = action_types.SmoothPath, "smooth_path"
    PORTS = (
        *_BASIC,
        *inputs(unsmoothed_path="message", max_smoothing_duration=("seconds", 3.0)),
        *inputs(check_for_collisions=("bool", False), smoother_id=("string", "")),
        *outputs(smoothed_path="message", smoothing_duration="double", was_completed="bool"),
    )
    FIELDS: ClassVar = {"unsmoothed_path": "path", "smoothed_path": "path"}

    def on_success(self, result: Any) -> Status:
        """Write the path and how long it took [s]."""
        status, took = super().on_success(result), result.smoothing_duration
        self.put("smoothing_duration", took.sec + took.nanosec * 1e-9)
        return status


class FollowPath(ActionNode):
    """Follows a path; a new one, or another plugin, preempts without a stop."""

    ACTION, SERVER = action_types.FollowPath, "follow_path"
    _IDS = ("controller_id", "goal_checker_id", "progress_checker_id", "path_handler_id")
    PORTS = (
        *_BASIC,
        *inputs(path="message", **dict.fromkeys(_IDS, ("string", ""))),
        *outputs(tracking_feedback="message"),
    )

    def make_goal(self, **values: Any) -> Any | None:
        """Return the goal, and remember what it was made of; None for the empty path of a failed planner."""
        self._path = self.get("path")
        if self._path is not None and not len(self._path.poses):
            return None
        self._ids = [self.get(name) for name in self._IDS]
        return super().make_goal(**values)

    def updated_goal(self) -> Any | None:
        """Return a goal with the present path and plugins, if they have changed."""
        path, ids = self.get("path"), [self.get(name) for name in self._IDS]
        # A path is a new object when it is planned anew; comparing first by identity is cheap.
        is_new = path is not self._path and path is not None and len(path.poses) and path != self._path
        if ids == self._ids and not is_new:
            return None
        self._path, self._ids = path if is_new else self._path, ids
        return super().make_goal(path=self._path)


class Spin(ActionNode):
    """Turns on the spot."""

    ACTION, SERVER = action_types.Spin, "spin"
    PORTS = (
        *_BASIC,
        *inputs(spin_dist=("double", 1.57), time_allowance=("seconds", 10.0)),
        *inputs(is_recovery=("bool", True), disable_collision_checks=("bool", False)),
    )

    FIELDS: ClassVar = {"spin_dist": "target_yaw"}

    def make_goal(self, **values: Any) -> Any | None:
        """Return the goal; a recovery unless `is_recovery` says otherwise."""
        if self.get("is_recovery"):
            self.count_recovery()
        return super().make_goal(**values)


class BackUp(ActionNode):
    """Drives straight back."""

    ACTION, SERVER = action_types.BackUp, "backup"
    PORTS = (
        *_BASIC,
        *inputs(backup_dist=("double", 0.15), backup_speed=("double", 0.025)),
        *inputs(time_allowance=("seconds", 10.0), disable_collision_checks=("bool", False)),
    )

    FIELDS: ClassVar = {"backup_speed": "speed"}

    def make_goal(self, **values: Any) -> Any | None:
        """Return the goal; always a recovery."""
        self.count_recovery()
        return super().make_goal(target=Point(x=self.get("backup_dist"), y=0.0, z=0.0), **values)


class DriveOnHeading(ActionNode):
    """Drives straight."""

    ACTION, SERVER = action_types.DriveOnHeading, "drive_on_heading"
    PORTS = (
        *_BASIC,
        *inputs(dist_to_travel=("double", 0.15), speed=("double", 0.025)),
        *inputs(time_allowance=("seconds", 10.0), disable_collision_checks=("bool", False)),
    )

    def make_goal(self, **values: Any) -> Any | None:
        """Return the goal."""
        return super().make_goal(target=Point(x=self.get("dist_to_travel"), y=0.0, z=0.0), **values)


class Wait(ActionNode):
    """Stands still; always a recovery."""

    ACTION, SERVER = action_types.Wait, "wait"
    PORTS = (*_BASIC, *inputs(wait_duration=("double", 1.0)))

    def make_goal(self, **values: Any) -> Any | None:
        """Return the goal."""
        self.count_recovery()
        return super().make_goal(time=seconds(abs(self.get("wait_duration"))), **values)


class AssistedTeleop(ActionNode):
    """Lets somebody steer, without collisions; time running out is a failure of a recovery only."""

    ACTION, SERVER = action_types.AssistedTeleop, "assisted_teleop"
    PORTS = (*_BASIC, *inputs(time_allowance=("seconds", 10.0), is_recovery=("bool", False)))

    def make_goal(self, **values: Any) -> Any | None:
        """Return the goal."""
        if self.get("is_recovery"):
            self.count_recovery()
        return super().make_goal(**values)

    def on_aborted(self, result: Any) -> Status:
        """Write the error."""
        super().on_aborted(result)
        return Status.FAILURE if self.get("is_recovery") else Status.SUCCESS


class NavigateToPose(ActionNode):
    """Navigates with another navigator's action."""

    ACTION, SERVER = action_types.NavigateToPose, "navigate_to_pose"
    PORTS = (*_BASIC, *inputs(goal="message", behavior_tree=("string", "")))

    FIELDS: ClassVar = {"goal": "pose"}

    def make_goal(self, **values: Any) -> Any | None:
        """Return the goal; none without a pose."""
        return None if self.get("goal") is None else super().make_goal(**values)


class NavigateThroughPoses(ActionNode):
    """Navigates through poses with another navigator's action."""

    ACTION, SERVER = action_types.NavigateThroughPoses, "navigate_through_poses"
    PORTS = (*_BASIC, *inputs(goals="message", behavior_tree=("string", "")))

    FIELDS: ClassVar = {"goals": "poses"}

    def make_goal(self, **values: Any) -> Any | None:
        """Return the goal; none without poses."""
        return super().make_goal(**values) if self.get("goals") else None


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


class UndockRobot(ActionNode):
    """Undocks (opennav_docking_bt)."""

    ACTION, SERVER = action_types.UndockRobot, "undock_robot"
    PORTS = (
        *_BASIC,
        *inputs(dock_type=("string", ""), max_undocking_time=("double", 30.0)),
        *outputs(success="bool"),
    )
