"""Turns to a path in place before another controller drives along it: Nav2's RotationShimController."""

from __future__ import annotations

import math

import numpy as np

from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.control.controller import Controller, Situation
from twin.navigation.control.path_handler import PathHandler
from twin.navigation.control.rotation import turn_rate
from twin.navigation.control.rotation_shim_config import RotationShimConfig
from twin.navigation.costmaps.costmap import NO_INFORMATION, footprint_cost
from twin.navigation.plugins import CONTROLLERS, create


class RotationShim(Controller):
    """Wraps any controller."""

    Config = RotationShimConfig
    config: RotationShimConfig

    def __init__(self, *, config: RotationShimConfig, footprint: Array | None = None) -> None:
        self.primary = create(CONTROLLERS, config.primary_controller, footprint=footprint)
        super().__init__(config=config, footprint=footprint)
        self._tolerance = 0.0

    @property
    def trajectory(self) -> Array | None:
        """That of the primary controller, while it drives."""
        return self.primary.trajectory if self._driving else None

    @property
    def candidates(self) -> Array | None:
        """Those of the primary controller, while it drives."""
        return self.primary.candidates if self._driving else None

    @property
    def reverses(self) -> bool:
        """Whether the primary controller drives backwards."""
        return self.primary.reverses

    @property
    def max_speed(self) -> float:
        """The primary controller's [m/s]."""
        return self.primary.max_speed

    def configure(self, config: RotationShimConfig) -> None:
        """Go on with other parameters, those of the primary controller too; lifts the speed limit."""
        self.primary.configure(config.primary_controller)
        super().configure(config)

    def _build(self) -> None:
        self._handler = PathHandler(to_cusps=self.primary.reverses)

    def set_plan(self, path: Array) -> None:
        """Follow another path; see `Controller.set_plan`."""
        same = self.path is not None and bool(np.array_equal(self.path[-1], path[-1]))
        self._handler.accept(path)
        super().set_plan(path)
        self.primary.set_plan(path)
        self._aligned &= same and self.config.rotate_to_heading_once
        self._turning = self._at_goal = False

    def reset(self) -> None:
        """Forget the path."""
        super().reset()
        self.primary.reset()
        self._handler.reset()
        self._aligned = False
        self._turning = self._at_goal = self._driving = False
        self._last_w: float | None = None

    def set_speed_limit(self, limit: float | None) -> None:
        """Pass the limit [m/s] on."""
        self.primary.set_speed_limit(limit)

    def set_goal_tolerance(self, xy: float) -> None:
        """Turn to the goal's heading within this distance of it [m]."""
        self._tolerance = xy
        self.primary.set_goal_tolerance(xy)

    def cancel(self) -> bool:
        """Leave it to the primary controller."""
        return self.primary.cancel()

    def compute_velocity_commands(self, now: Situation) -> tuple[float, float]:
        """Return the command (v [m/s], w [rad/s]); see `Controller.compute_velocity_commands`."""
        assert self.path is not None
        angle = self._angle(now.pose, self.path)
        w = 0.0 if angle is None else self._turn_rate(angle, now.velocity[1], now.dt)
        # Where there is no room to turn the primary controller may know a way, as in Nav2.
        if angle is None or self._collides(now, w, angle):
            self._turning = False
            command = self.primary.compute_velocity_commands(now)
            self.carrot, self._driving = self.primary.carrot, True
        else:
            command, self._driving = (0.0, w), False
        self._last_w = command[1]
        return command

    def _angle(self, pose: Pose2, path: Array) -> float | None:
        """Return by how much to turn in place [rad]; None: drive."""
        config, local = self.config, self._handler.local(pose)
        goal = Pose2(*path[-1].tolist())
        if config.rotate_to_goal_heading:
            off = pose.distance(goal)
            self._at_goal = self._is_there(self._at_goal, off, at_end=local.ends_at_goal)
            if self._at_goal:
                self.carrot = goal[:2]
                return wrap_angle(goal.yaw - pose.yaw)
        if self._aligned:
            return None
        far = np.hypot(*(local.poses[:, :2] - local.poses[0, :2]).T) >= config.forward_sampling_distance
        if not far.any() and pose.distance(goal) <= self._tolerance:
            return None
        x, y, yaw = local.poses[int(np.argmax(far)) if far.any() else -1].tolist()
        if config.use_path_orientations:
            angle = wrap_angle(yaw - pose.yaw)
        else:
            angle = wrap_angle(math.atan2(y - pose.y, x - pose.x) - pose.yaw)
            if local.reversing and self.reverses:
                angle = wrap_angle(angle + math.pi)
        limit = config.angular_disengage_threshold if self._turning else config.angular_dist_threshold
        if abs(angle) <= limit or (not far.any() and not self._turning and self._aligned):
            self._aligned = True
            return None
        self._turning, self.carrot = True, (x, y)
        return angle

    def _turn_rate(self, angle: float, w_now: float, dt: float) -> float:
        config = self.config
        return turn_rate(
            angle,
            w_now if config.closed_loop or self._last_w is None else self._last_w,
            dt,
            max_rate=config.rotate_to_heading_angular_vel,
            acceleration=config.max_angular_accel,
        )

    def _collides(self, now: Situation, w: float, angle: float) -> bool:
        """Return whether the footprint hits something while it turns."""
        if now.costmap is None or w == 0.0:
            return False
        steps = math.ceil(min(self.config.simulate_ahead_time, abs(angle / w)) / now.dt)
        for step in range(1, steps + 1):
            at = Pose2(now.at.x, now.at.y, now.at.yaw + w * now.dt * step)
            cost = footprint_cost(now.costmap, self.footprint, at)
            if self.config.max_cost_threshold <= cost != NO_INFORMATION:
                return True
        return False
