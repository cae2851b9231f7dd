"""Driving a differential base onto a pose along a line: the smooth law of Park and Kuipers (ICRA 2011)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from twin.geometry import Pose2, wrap_angle
from twin.navigation.recovery import TIMEOUT, BehaviorStep

MISSED = "missed"


@dataclass(frozen=True, kw_only=True)
class GracefulDockConfig:
    """Parameters; names of the control law are those of nav2_graceful_controller and opennav_docking."""

    k_phi: float = 2.0
    """How fast the heading error is traded for the lateral error."""
    k_delta: float = 3.0
    """Gain of the steering."""
    beta: float = 0.4
    """How much a curve slows the robot down."""
    lambda_: float = 2.0
    """How sharply."""
    v_linear_min: float = 0.02
    """[m/s]"""
    v_linear_max: float = 0.25
    """[m/s]"""
    v_angular_max: float = 0.75
    """[rad/s]"""
    acceleration: float = 0.3
    """[m/s²]"""
    deceleration: float = 0.1
    """Of slowing down at the end: low, so that a drive that lags stops in time all the same [m/s²]."""
    lookahead: float = 0.3
    """The law aims at the line so far ahead of the robot: short converges fast, long is calm [m]."""
    stop_tolerance: float = 0.003
    """Stop so far before the pose [m]."""
    lateral_tolerance: float = 0.01
    """[m]"""
    yaw_tolerance: float = math.radians(1.5)
    """[rad]"""
    time_allowance: float = 30.0
    """[s]"""


class GracefulDock:
    """One approach to one pose, forwards to dock or backwards to undock."""

    def __init__(self, config: GracefulDockConfig, goal: Pose2, *, backward: bool = False) -> None:
        """Prepare an approach.

        Args:
            config: Gains and limits.
            goal: Where the base shall stand, with its heading there, in the odom frame.
            backward: Drive in reverse; the robot starts in front of the goal.
        """
        self.config = config
        self.backward = backward
        self._goal = goal
        self._speed = 0.0
        self._elapsed = 0.0

    def retarget(self, goal: Pose2) -> None:
        """Correct the goal on the way, as newer scans see the dock better."""
        self._goal = goal

    def errors(self, pose: Pose2) -> tuple[float, float, float]:
        """Return the way left along the line [m], the lateral error [m] and the yaw error [rad] of `pose`."""
        error = self._goal.inverse() @ pose
        return (error.x if self.backward else -error.x), error.y, error.yaw

    def update(self, pose: Pose2, dt: float) -> BehaviorStep:
        """Return the next command; `pose` in the odom frame, `dt` in [s].

        The step fails with `MISSED` at the end of the line outside the tolerances, or with `TIMEOUT`.
        """
        config = self.config
        left, lateral, yaw_error = self.errors(pose)
        if left <= config.stop_tolerance:
            if abs(lateral) > config.lateral_tolerance or abs(yaw_error) > config.yaw_tolerance:
                return BehaviorStep(0.0, 0.0, failed_reason=MISSED)
            return BehaviorStep(0.0, 0.0, done=True)
        self._elapsed += dt
        if self._elapsed > config.time_allowance:
            return BehaviorStep(0.0, 0.0, failed_reason=TIMEOUT)
        curvature = self._curvature(lateral, yaw_error)
        v = config.v_linear_max / (1.0 + config.beta * abs(curvature) ** config.lambda_)
        v = min(v, math.sqrt(2.0 * config.deceleration * left), self._speed + config.acceleration * dt)
        v = max(v, config.v_linear_min)
        if abs(v * curvature) > config.v_angular_max:
            v = config.v_angular_max / abs(curvature)
        v = min(v, left / dt)
        self._speed = v
        return BehaviorStep(-v if self.backward else v, curvature * v)

    def _curvature(self, lateral: float, yaw_error: float) -> float:
        """Return the curvature [1/m] of the path of the end that goes first.

        Aiming at a point on the line ahead, not at the pose itself, keeps the law away from its singularity
        at distance 0 (opennav_docking projects its target for the same reason).
        """
        config = self.config
        heading = wrap_angle(yaw_error + math.pi) if self.backward else yaw_error
        onward = math.pi if self.backward else 0.0
        sight_x = -config.lookahead if self.backward else config.lookahead
        distance = math.hypot(sight_x, lateral)
        sight = math.atan2(-lateral, sight_x)
        phi = wrap_angle(onward - sight)
        delta = wrap_angle(heading - sight)
        steer = config.k_delta * (delta - math.atan(-config.k_phi * phi))
        follow = (1.0 + config.k_phi / (1.0 + (config.k_phi * phi) ** 2)) * math.sin(delta)
        return -(steer + follow) / distance
