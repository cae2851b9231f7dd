"""Behaviours that get a robot out of trouble (nav2_behaviors): spin, back up, drive, wait, assisted teleop.

Each is made for one execution; `update` is called once per control period until `done` or `failed_reason`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

import numpy as np

from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.costmaps.costmap import Costmap, collision_step, triple
from twin.navigation.costmaps.kernels import escapes
from twin.parameters import (
    Interval,
    Le,
    Metres,
    MetresPerSecond,
    MetresPerSecondSquared,
    NotNegative,
    Positive,
    RadiansPerSecond,
    RadiansPerSecondSquared,
    Seconds,
)

COLLISION_AHEAD = "collision_ahead"
TIMEOUT = "timeout"


class BehaviorStep(NamedTuple):
    """The command of one period."""

    v: float = 0.0
    """[m/s]"""
    w: float = 0.0
    """[rad/s]"""
    done: bool = False
    failed_reason: str | None = None
    """`COLLISION_AHEAD`, `TIMEOUT` or None."""


@dataclass(frozen=True, kw_only=True)
class BehaviorConfig:
    """Parameters; names and defaults are those of nav2_behaviors."""

    simulate_ahead_time: Annotated[Seconds, Interval(ge=0.0, le=60.0)] = 2.0
    """How far ahead collisions are looked for."""
    max_rotational_vel: Annotated[RadiansPerSecond, Positive, Le(100.0)] = 1.0
    """Greatest speed of turning."""
    min_rotational_vel: Annotated[RadiansPerSecond, NotNegative, Le(100.0)] = 0.4
    """Least speed of turning."""
    rotational_acc_lim: Annotated[RadiansPerSecondSquared, Positive, Le(1000.0)] = 3.2
    """Of speeding up and slowing down a turn."""
    acceleration_limit: Annotated[MetresPerSecondSquared, Positive, Le(1000.0)] = 2.5
    """Of driving off."""
    deceleration_limit: Annotated[MetresPerSecondSquared, Positive, Le(1000.0)] = 2.5
    """Of slowing down, as a magnitude."""
    minimum_speed: Annotated[MetresPerSecond, NotNegative, Le(100.0)] = 0.05
    """Least speed of driving."""
    projection_time: Annotated[Seconds, Interval(ge=0.0, le=60.0)] = 1.0
    """How far ahead assisted teleop looks for collisions ..."""
    simulation_time_step: Annotated[Seconds, Interval(ge=0.01, le=60.0)] = 0.1
    """... in steps of this."""
    footprint: tuple[tuple[Metres, Metres], ...] = ((0.0, 0.0),)
    """Corners in the base frame; the single one (0, 0) checks the centre for inscribed cost instead."""


@dataclass(kw_only=True)
class _Behavior:
    """Time and collision checks shared by the behaviours."""

    config: BehaviorConfig = field(default_factory=BehaviorConfig)
    time_allowance: float = 10.0
    """[s]; 0 for none."""

    def __post_init__(self) -> None:
        self._footprint: Array = np.array(self.config.footprint, dtype=np.float64)
        self._elapsed = 0.0
        self._turned = 0.0
        self._start: Pose2 | None = None
        self._speed = 0.0
        self.progress = 0.0
        """For feedback: turned [rad], driven [m], time left or time steered [s]."""

    def _timed_out(self, dt: float) -> bool:
        self._elapsed += dt
        return 0.0 < self.time_allowance < self._elapsed - 1e-9

    def _ramp(
        self, remaining: float, accel: float, decel: float, least: float, most: float, dt: float
    ) -> float:
        """Return the next speed: limited by acceleration, by `most`, and by being able to stop."""
        self._speed = min(self._speed + accel * dt, most, math.sqrt(2.0 * decel * max(remaining, 0.0)))
        self._speed = max(self._speed, min(least, most))
        return min(self._speed, remaining / dt) if dt > 0.0 else self._speed

    def _collides(self, pose: Pose2, v: float, w: float, remaining: float, costmap: Costmap | None) -> bool:
        """Return whether the motion, at most `remaining` [m or rad] more of it, hits something."""
        speed = abs(v) if v else abs(w)
        if costmap is None or speed == 0.0:
            return False
        time = min(self.config.simulate_ahead_time, remaining / speed)
        size = costmap.resolution / 2.0 if v else math.radians(5.0)
        steps = max(1, math.ceil(time * speed / size))
        hit = collision_step(costmap, self._footprint, pose, (v, w), time / steps, steps)
        if hit != 0:
            return hit > 0
        # The present pose is a collision: a robot that touches something may move away, not further in.
        at, command = triple(pose), (float(v), float(w))
        return not escapes(costmap.costs, self._footprint, at, command, time / steps, steps, costmap.frame)


@dataclass(kw_only=True)
class Spin(_Behavior):
    """Turn in place."""

    target_yaw: float = math.pi / 2.0
    """Relative; more than a full turn is allowed [rad]."""

    def update(self, pose: Pose2, dt: float, costmap: Costmap | None = None) -> BehaviorStep:
        """Return the next command; `pose` in the costmap's frame, `dt` in [s]."""
        if self._start is None:
            self._start, self._last_yaw = pose, pose.yaw
        self._turned += wrap_angle(pose.yaw - self._last_yaw)
        self._last_yaw = pose.yaw
        self.progress = abs(self._turned)
        direction = math.copysign(1.0, self.target_yaw)
        remaining = abs(self.target_yaw) - direction * self._turned
        if remaining <= 1e-3:
            return BehaviorStep(done=True)
        if self._timed_out(dt):
            return BehaviorStep(failed_reason=TIMEOUT)
        config, accel = self.config, self.config.rotational_acc_lim
        speed = self._ramp(remaining, accel, accel, config.min_rotational_vel, config.max_rotational_vel, dt)
        w = direction * speed
        if self._collides(pose, 0.0, w, remaining, costmap):
            return BehaviorStep(failed_reason=COLLISION_AHEAD)
        return BehaviorStep(0.0, w)


@dataclass(kw_only=True)
class DriveOnHeading(_Behavior):
    """Drive straight; backwards for a negative distance."""

    target_distance: float = 0.15
    """[m]"""
    speed: float = 0.15
    """[m/s], positive."""

    def update(self, pose: Pose2, dt: float, costmap: Costmap | None = None) -> BehaviorStep:
        """Return the next command; `pose` in the costmap's frame, `dt` in [s]."""
        if self._start is None:
            self._start = pose
        self.progress = self._start.distance(pose)
        remaining = abs(self.target_distance) - self.progress
        if remaining <= 1e-3:
            return BehaviorStep(done=True)
        if self._timed_out(dt):
            return BehaviorStep(failed_reason=TIMEOUT)
        accel, decel = self.config.acceleration_limit, self.config.deceleration_limit
        speed = self._ramp(remaining, accel, decel, self.config.minimum_speed, self.speed, dt)
        v = math.copysign(speed, self.target_distance)
        if self._collides(pose, v, 0.0, remaining, costmap):
            return BehaviorStep(failed_reason=COLLISION_AHEAD)
        return BehaviorStep(v, 0.0)


@dataclass(kw_only=True)
class Wait(_Behavior):
    """Stand still."""

    duration: float = 1.0
    """[s]"""

    def update(self, pose: Pose2, dt: float, costmap: Costmap | None = None) -> BehaviorStep:
        """Return a zero command until the duration is over."""
        del pose, costmap
        self._elapsed += dt
        self.progress = max(self.duration - self._elapsed, 0.0)
        return BehaviorStep(done=self._elapsed >= self.duration - 1e-9)


@dataclass(kw_only=True)
class AssistedTeleop(_Behavior):
    """Does what somebody steers, slower the nearer a collision is; until `is_over`, or the time is over."""

    steered: tuple[float, float] = (0.0, 0.0)
    """The latest command of whoever steers: v [m/s], w [rad/s]."""
    is_over: bool = False
    """Whether whoever steers has had enough."""

    def update(self, pose: Pose2, dt: float, costmap: Costmap | None = None) -> BehaviorStep:
        """Return the next command; `pose` in the costmap's frame, `dt` in [s]."""
        if self.is_over:
            return BehaviorStep(done=True)
        if self._timed_out(dt):
            return BehaviorStep(failed_reason=TIMEOUT)
        self.progress = self._elapsed
        v, w = self.steered
        share = self._share(pose, v, w, costmap)
        return BehaviorStep(v * share, w * share)

    def _share(self, pose: Pose2, v: float, w: float, costmap: Costmap | None) -> float:
        """Return by how much a command is to be slowed: 1 where nothing is hit within the projection."""
        if costmap is None or (v == 0.0 and w == 0.0):
            return 1.0
        config = self.config
        steps = max(1, round(config.projection_time / config.simulation_time_step))
        step = float(config.simulation_time_step)
        hit = collision_step(costmap, self._footprint, pose, (v, w), step, steps)
        if hit == -1:
            return 1.0
        return 0.0 if hit <= 1 else hit / steps
