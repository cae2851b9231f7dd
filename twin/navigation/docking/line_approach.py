"""Driving a differential base onto a pose along a line: turn to the line, drive onto it, turn to the heading.

On the way the lateral error follows the cubic that ends on the line, along the line (the guidance law for a
terminal heading of Ryoo, Cho and Tahk, JGCD 28(4), 2005): of all ways that end so it bends least, and the
heading leaves the line's by no more than 1.5 times the lateral error over the way left. Whether it would
touch something is asked as by opennav_docking's Controller::isTrajectoryCollisionFree.
"""

from __future__ import annotations

import copy
import math
from enum import Enum, auto

from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import Costmap, collision_step
from twin.navigation.docking.config import DockCollisionConfig, LineApproachConfig
from twin.navigation.recovery import TIMEOUT, BehaviorStep

MISSED = "missed"


_LATERAL_GAIN, _HEADING_GAIN = 6.0, 4.0
"""Of the law; with these the lateral error is a sum of the square and the cube of the way left."""


class _Phase(Enum):
    TURN_TO_LINE = auto()
    DRIVE = auto()
    TURN_AT_POSE = auto()


class LineApproach:
    """One approach to one pose, forwards to dock or backwards to undock."""

    def __init__(self, config: LineApproachConfig, goal: Pose2, *, backward: bool = False) -> None:
        """Prepare an approach.

        Args:
            config: Gains and limits.
            goal: Where the base shall stand, with its heading there, in the odom frame.
            backward: Drive in reverse; the robot starts in front of the goal.
        """
        self.config = config
        self.backward = backward
        self._T_goal_odom = goal.inverse()
        self._v = 0.0
        self._w = 0.0
        self._elapsed = 0.0
        self._phase = _Phase.TURN_TO_LINE

    def retarget(self, goal: Pose2) -> None:
        """Correct the goal on the way, as newer scans see the dock better."""
        self._T_goal_odom = goal.inverse()

    def errors(self, pose: Pose2) -> tuple[float, float, float]:
        """Return the way left along the line [m], the lateral error [m] and the yaw error [rad] of `pose`."""
        error = self._T_goal_odom @ pose
        return (error.x if self.backward else -error.x), error.y, error.yaw

    def halt(self) -> None:
        """Take that the robot stands: it speeds up anew."""
        self._v = self._w = 0.0

    def update(self, pose: Pose2, dt: float) -> BehaviorStep:
        """Return the next command; `pose` in the odom frame, `dt` in [s].

        The step fails with `MISSED` at the end of the line aside of it, or with `TIMEOUT`.
        """
        config = self.config
        left, lateral, yaw_error = self.errors(pose)
        self._elapsed += dt
        if self._elapsed > config.time_allowance:
            return BehaviorStep(failed_reason=TIMEOUT)
        if self._phase is _Phase.TURN_TO_LINE:
            # A turn once begun goes on to the end.
            enough = config.yaw_tolerance if self._w else config.turn_first_above
            if left > config.stop_tolerance and abs(yaw_error) > max(enough, config.yaw_tolerance):
                return self._turn(yaw_error, dt)
            self._phase, self._w = _Phase.DRIVE, 0.0
        if self._phase is _Phase.DRIVE:
            if left > config.stop_tolerance:
                return self._drive(left, lateral, yaw_error, dt)
            self._phase = _Phase.TURN_AT_POSE
        if abs(lateral) > config.lateral_tolerance:
            return BehaviorStep(failed_reason=MISSED)
        if abs(yaw_error) > config.yaw_tolerance:
            return self._turn(yaw_error, dt)
        return BehaviorStep(done=True)

    def _turn(self, yaw_error: float, dt: float) -> BehaviorStep:
        config = self.config
        w = min(config.v_angular_max, math.sqrt(2.0 * config.angular_acceleration * abs(yaw_error)))
        w = min(w, abs(self._w) + config.angular_acceleration * dt)
        self._w = -math.copysign(max(w, config.v_angular_min), yaw_error)
        return BehaviorStep(0.0, self._w)

    def _drive(self, left: float, lateral: float, yaw_error: float, dt: float) -> BehaviorStep:
        config = self.config
        curvature = self._curvature(left, lateral, yaw_error)
        v = min(config.v_linear_max, math.sqrt(2.0 * config.deceleration * left))
        v = max(min(v, self._v + config.acceleration * dt), config.v_linear_min)
        if abs(v * curvature) > config.v_angular_max:
            v = config.v_angular_max / abs(curvature)
        self._v = v = min(v, left / dt)
        return BehaviorStep(-v if self.backward else v, curvature * v)

    def _curvature(self, left: float, lateral: float, yaw_error: float) -> float:
        """Return how far to turn per way driven [rad/m]; in reverse a heading leads to the other side."""
        settle = self.config.settle_distance
        horizon = max(left - settle, settle)
        aside = -lateral if self.backward else lateral
        return -(_LATERAL_GAIN * aside / horizon + _HEADING_GAIN * math.sin(yaw_error)) / horizon


def collision_ahead(
    approach: LineApproach,
    pose: Pose2,
    docked: Pose2,
    costmap: Costmap,
    footprint: Array,
    config: DockCollisionConfig,
) -> Pose2 | None:
    """Return where the robot would touch something if the approach went on; None if nowhere.

    Args:
        approach: As far as it is; it stays so.
        pose: Of the base, in the costmap's frame, as all poses here.
        docked: Where the base stands at the dock.
        costmap: What is in the way.
        footprint: As `collision_step` takes it, shape (n, 2) [m].
        config: How far is looked ahead.
    """
    if not config.use_collision_detection:
        return None
    ghost, dt = copy.copy(approach), config.simulation_time_step
    for _ in range(round(config.projection_time / dt)):
        step = ghost.update(pose, dt)
        if step.done or step.failed_reason is not None:
            return None
        pose = pose @ Pose2(step.v * dt, 0.0, step.w * dt)
        if pose.distance(docked) < config.dock_collision_threshold:
            if not approach.backward:
                return None  # the rest leads nearer still
        elif collision_step(costmap, footprint, pose, (0.0, 0.0), 0.0, 0) == 0:
            return pose
    return None
