"""One period of `/controller_server`: the controller's command, a maneuver's instead, or patience."""

from __future__ import annotations

import numpy as np

from twin.bridge.node import Node
from twin.geometry import Array, Pose2
from twin.navigation.control.controller import Situation
from twin.navigation.control.maneuver import Maneuver
from twin.navigation.failures import ControlFailure, NoValidControl
from twin.navigation.warm_up import warm_up_maneuver
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.nodes.navigation.controller_server.goal import (
    CONTROLLER_TIMED_OUT,
    PATIENCE_EXCEEDED,
    Abort,
    FollowGoal,
)
from twin.nodes.navigation.costmaps.costmap import CostmapNode

FOR_EVER_NS = -1_000_000_000
"""`failure_tolerance` of Nav2's -1.0; it takes other negative values as 0."""
_AGAIN_NS = 1_000_000_000
"""A robot that was blocked so short a time ago is blocked again and again."""


class Commander:
    """Finds what the robot does next, from the local costmap."""

    def __init__(
        self, node: Node, costmap: CostmapNode, footprint: Array, config: ControllerServerConfig
    ) -> None:
        self._node = node
        self._costmap = costmap
        self._config = config
        self.maneuver = Maneuver(
            footprint=np.array(footprint, dtype=np.float64, order="C"), config=config.maneuver
        )
        """What gets a robot free that stands blocked."""
        if config.maneuver.reach:
            warm_up_maneuver()

    def configure(self, config: ControllerServerConfig) -> None:
        """Go on with other parameters."""
        self._config = config
        self.maneuver.config = config.maneuver

    def is_costmap_current(self, goal: FollowGoal) -> bool:
        """Return whether to drive on by the costmap; raises Abort if it has been out of date for long."""
        now, fault = self._node.steady_ns, self._costmap.fault
        if not fault:
            goal.current_ns, goal.waiting = now, False
        elif now - goal.current_ns > self._config.costmap_update_timeout_ns:
            raise Abort(CONTROLLER_TIMED_OUT, f"the local costmap is not current: {fault}")
        elif not goal.waiting:
            goal.waiting = True
            self._node.get_logger().warn(f"waiting: the local costmap is not current: {fault}")
        return not fault

    def command(
        self, goal: FollowGoal, velocity: tuple[float, float], in_map: Pose2, in_odom: Pose2, ahead: Array
    ) -> tuple[float, float]:
        """Return the command (v [m/s], w [rad/s]).

        Args:
            goal: What is followed.
            velocity: The present (v, w).
            in_map: Where the robot is in the path's frame.
            in_odom: Where it is in the costmap's.
            ahead: The path from there on, shape (n, 3).

        Raises:
            Abort: the controller fails, or has found nothing for longer than is borne.
        """
        costmap, now = self._costmap.costmap, self._node.steady_ns
        dt = self._config.controller_period_ns * 1e-9
        if self.maneuver.active and costmap is not None:
            maneuvered = self.maneuver.command(in_odom, velocity, costmap, dt)
            if maneuvered is not None:
                goal.last_valid_ns = goal.searched_ns = now
                return maneuvered
        try:
            command = goal.controller.compute_velocity_commands(
                Situation(pose=in_map, velocity=velocity, costmap=costmap, at=in_odom, dt=dt)
            )
        except NoValidControl as failure:
            goal.blocked_ns = now
            self._be_patient(goal, failure)
            if now - goal.searched_ns >= self._config.maneuver.wait * 1e9:
                self._look_for_a_maneuver(goal, str(failure), in_map, in_odom, ahead)
            return 0.0, 0.0
        except ControlFailure as failure:
            raise Abort(failure.error_code, str(failure)) from failure
        goal.last_valid_ns = goal.searched_ns = now
        return command

    def _be_patient(self, goal: FollowGoal, failure: NoValidControl) -> None:
        """Wait for a valid control for as long as the tolerance says; raises Abort."""
        tolerance = self._config.failure_tolerance_ns
        if tolerance <= 0 and tolerance != FOR_EVER_NS:
            raise Abort(failure.error_code, str(failure))
        if 0 < tolerance < self._node.steady_ns - goal.last_valid_ns:
            raise Abort(PATIENCE_EXCEEDED, f"no valid control for {tolerance * 1e-9:g} s: {failure}")

    def frees(self, goal: FollowGoal, in_map: Pose2, in_odom: Pose2, ahead: Array) -> bool:
        """Whether a maneuver begins for a robot that makes no progress: one that is blocked again and again.

        Now and then it finds a control that is valid, so it never stands blocked for long, and turns to and
        fro. It is tried once about one place; arguments as those of `command`.
        """
        blocked = goal.blocked_ns is not None and self._node.steady_ns - goal.blocked_ns < _AGAIN_NS
        tried = goal.freed_at is not None and goal.freed_at.distance(in_map) < self._config.maneuver.reach
        if tried or self.maneuver.active or not blocked:
            return False
        goal.freed_at = in_map
        return self._look_for_a_maneuver(goal, "no progress", in_map, in_odom, ahead)

    def _look_for_a_maneuver(
        self, goal: FollowGoal, why: str, in_map: Pose2, in_odom: Pose2, ahead: Array
    ) -> bool:
        """Begin one, if there is one on to the path ahead."""
        if self._costmap.costmap is None:
            return False
        goal.searched_ns = self._node.steady_ns
        to_costmap = in_odom @ in_map.inverse()
        path = np.array([to_costmap @ Pose2(*pose) for pose in ahead.tolist()])
        if self.maneuver.begin(self._costmap.costmap, in_odom, path):
            self._node.get_logger().info(f"maneuvering: {why}")
        return self.maneuver.active
