"""Driving a differential base onto a pose along a line: turn to the line, drive onto it, turn to the heading.

On the way the lateral error follows the cubic that ends on the line, along the line (the guidance law for a
terminal heading of Ryoo, Cho and Tahk, JGCD 28(4), 2005): of all ways that end so it bends least, and the
heading leaves the line's by no more than 1.5 times the lateral error over the way left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto
from typing import Annotated

from twin.geometry import Pose2
from twin.navigation.recovery import TIMEOUT, BehaviorStep
from twin.parameters import (
    Interval,
    Le,
    Metres,
    MetresPerSecond,
    MetresPerSecondSquared,
    NotNegative,
    Positive,
    Radians,
    RadiansPerSecond,
    RadiansPerSecondSquared,
    Seconds,
)

MISSED = "missed"

_DEGREE = math.pi / 180.0

_LATERAL_GAIN, _HEADING_GAIN = 6.0, 4.0
"""Of the law; with these the lateral error is a sum of the square and the cube of the way left."""


@dataclass(frozen=True, kw_only=True)
class LineApproachConfig:
    """How calmly, and how exactly, a pose is approached.

    Raises:
        ValueError: speeds are out of order.
    """

    v_linear_min: Annotated[MetresPerSecond, Positive, Le(10.0)] = 0.02
    """Least speed."""
    v_linear_max: Annotated[MetresPerSecond, Positive, Le(10.0)] = 0.25
    """Greatest speed."""
    v_angular_min: Annotated[RadiansPerSecond, Positive, Le(100.0)] = 0.04
    """Least speed of turning on the spot."""
    v_angular_max: Annotated[RadiansPerSecond, Positive, Le(100.0)] = 0.5
    """Greatest speed of turning."""
    acceleration: Annotated[MetresPerSecondSquared, Positive, Le(1000.0)] = 0.3
    """Of driving off."""
    deceleration: Annotated[MetresPerSecondSquared, Positive, Le(1000.0)] = 0.1
    """Of slowing down at the end: low, so that a drive that lags stops in time all the same."""
    angular_acceleration: Annotated[RadiansPerSecondSquared, Positive, Le(1000.0)] = 0.5
    """Of turning on the spot."""
    turn_first_above: Annotated[Radians, NotNegative] = 3.0 * _DEGREE
    """A heading further off than this is corrected on the spot before driving."""
    settle_distance: Annotated[Metres, Interval(ge=0.01, le=10.0)] = 0.15
    """The robot is to be on the line so far before the pose; from there on the gains grow no more."""
    stop_tolerance: Annotated[Metres, NotNegative] = 0.003
    """Stop so far before the pose."""
    lateral_tolerance: Annotated[Metres, NotNegative] = 0.01
    """A robot further aside of the pose has missed it."""
    yaw_tolerance: Annotated[Radians, Positive] = 0.5 * _DEGREE
    """At the pose the robot turns on the spot until it is within this."""
    time_allowance: Annotated[Seconds, Positive, Le(3600.0)] = 30.0
    """After so long the approach has failed."""

    def __post_init__(self) -> None:
        for axis in ("v_linear", "v_angular"):
            low, high = getattr(self, f"{axis}_min"), getattr(self, f"{axis}_max")
            if low > high:
                raise ValueError(f"{axis}_min is {low:g}, more than {axis}_max, {high:g}")


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
        self._goal = goal
        self._v = 0.0
        self._w = 0.0
        self._elapsed = 0.0
        self._phase = _Phase.TURN_TO_LINE

    def retarget(self, goal: Pose2) -> None:
        """Correct the goal on the way, as newer scans see the dock better."""
        self._goal = goal

    def errors(self, pose: Pose2) -> tuple[float, float, float]:
        """Return the way left along the line [m], the lateral error [m] and the yaw error [rad] of `pose`."""
        error = self._goal.inverse() @ pose
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
            return BehaviorStep(0.0, 0.0, failed_reason=TIMEOUT)
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
            return BehaviorStep(0.0, 0.0, failed_reason=MISSED)
        if abs(yaw_error) > config.yaw_tolerance:
            return self._turn(yaw_error, dt)
        return BehaviorStep(0.0, 0.0, done=True)

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
