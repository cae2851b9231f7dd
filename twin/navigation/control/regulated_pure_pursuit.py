"""Path following: Nav2's Regulated Pure Pursuit (Macenski, Singh, Martín, Ginés 2023, arXiv 2305.20026)."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.control.path_handler import PathHandler, PathHandlerConfig
from twin.navigation.control.regulated_pure_pursuit_config import RegulatedPurePursuitConfig
from twin.navigation.control.rotation import turn_rate
from twin.navigation.costmaps.costmap import (
    FREE_SPACE,
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from twin.navigation.costmaps.footprint import radii
from twin.navigation.costmaps.kernels import escapes, outline_cost, steps_to_collision
from twin.navigation.failures import NoValidControl

_ESCAPE_TURN = 0.5
"""Rate at which the robot turns away from what it nearly touches [rad/s]."""
_STILL_THERE = 0.25
"""A goal once reached is so no more when the robot is farther off than the tolerance by so much [m]."""


@dataclass(kw_only=True)
class RegulatedPurePursuit:
    """Follows one path at a time; a new path array resets it."""

    config: RegulatedPurePursuitConfig
    footprint: Array = field(default_factory=lambda: np.zeros((1, 2)))
    """Shape (n, 2) [m]; the single corner (0, 0) checks the centre for inscribed cost instead."""
    desired_linear_vel: float = field(init=False)
    """Current speed limit [m/s]; see `set_speed_limit`."""
    carrot: tuple[float, float] | None = field(init=False, default=None)
    """The lookahead point of the last command, in the path's frame [m]."""
    trajectory: Array | None = field(init=False, default=None)
    """None: it plans none."""
    candidates: None = field(init=False, default=None)
    """It shows none."""

    def __post_init__(self) -> None:
        self.footprint = np.array(self.footprint, dtype=np.float64, order="C")
        self._radius = max(radii(self.footprint)[1], 0.05)
        self.configure(self.config)

    @property
    def max_speed(self) -> float:
        """desired_linear_vel without limit [m/s]."""
        return self.config.desired_linear_vel

    @property
    def reverses(self) -> bool:
        """Whether it drives backwards."""
        return self.config.allow_reversing

    def configure(self, config: RegulatedPurePursuitConfig) -> None:
        """Go on with other parameters; lifts the speed limit."""
        self.config = config
        self.desired_linear_vel = config.desired_linear_vel
        self._tolerance = config.xy_goal_tolerance
        self._handler = PathHandler(
            config=PathHandlerConfig(
                prune_distance=math.inf,
                max_robot_pose_search_dist=config.max_robot_pose_search_dist,
                enforce_path_inversion=config.allow_reversing,
                inversion_xy_tolerance=config.inversion_xy_tolerance,
                inversion_yaw_tolerance=config.inversion_yaw_tolerance,
            )
        )
        self.reset()

    def reset(self) -> None:
        """Forget the path."""
        self._handler.reset()
        self._reached_xy = False
        self._cancelling = self._stopped = False
        self.carrot = None

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than `limit` [m/s]; None lifts the limit (nav2's SpeedLimit)."""
        maximum = self.config.desired_linear_vel
        self.desired_linear_vel = maximum if limit is None else min(limit, maximum)

    def set_goal_tolerance(self, xy: float) -> None:
        """Turn to the goal's heading within this distance of it [m]."""
        self._tolerance = xy

    def cancel(self) -> bool:
        """Brake along the path if use_cancel_deceleration; return whether the robot may be stopped."""
        self._cancelling = True
        return self._stopped or not self.config.use_cancel_deceleration

    def compute_velocity(
        self,
        pose: Pose2,
        velocity: tuple[float, float],
        path: Array,
        costmap: Costmap | None,
        dt: float,
        *,
        costmap_pose: Pose2 | None = None,
    ) -> tuple[float, float]:
        """Return the command (v [m/s], w [rad/s]); see `Controller.compute_velocity`.

        Args:
            pose: Of the base, in the path's frame.
            velocity: The present (v, w).
            path: Shape (n, 3): x, y, yaw.
            costmap: For slowing down near obstacles and for collision checks; None switches both off.
            dt: Control period [s].
            costmap_pose: Of the base in the costmap's frame; None where that is the path's frame too.

        Raises:
            InvalidPath: the path is empty, not finite or not of shape (n, 3).
            NoValidControl: the command would collide within max_allowed_time_to_collision_up_to_carrot.
        """
        config = self.config
        if self._handler.accept(path):
            self._reached_xy = False
        ahead = self._handler.local(pose)
        sign = -1.0 if ahead.reversing and config.allow_reversing else 1.0
        local = pose.inverse().apply(ahead.poses[:, :2])
        x, y = _lookahead_point(local, self._lookahead(velocity[0]))
        self.carrot = (pose @ Pose2(x, y, 0.0))[:2]
        distance = math.hypot(x, y)
        if config.use_fixed_curvature_lookahead:
            x, y = self._curvature_point(local)
        bearing = math.atan2(sign * y, sign * x)
        off = math.hypot(*local[-1])
        self._reached_xy |= ahead.ends_at_goal and off < self._tolerance
        self._reached_xy &= off < self._tolerance + _STILL_THERE
        if config.use_rotate_to_heading and self._reached_xy:
            v, w = 0.0, self._rotate(wrap_angle(float(path[-1, 2]) - pose.yaw), velocity[1], dt)
        elif config.use_rotate_to_heading and abs(bearing) > config.rotate_to_heading_min_angle:
            v, w = 0.0, self._rotate(bearing, velocity[1], dt)
        else:
            curvature = 2.0 * y / (x * x + y * y) if x * x + y * y > 0.001 else 0.0
            v = sign * self._regulate(
                curvature, costmap_pose or pose, local, ahead.length, costmap, velocity[0]
            )
            if self._cancelling and config.use_cancel_deceleration:
                v = sign * max(0.0, sign * velocity[0] - config.cancel_deceleration * dt)
            w = v * curvature
        self._stopped = self._cancelling and v == 0.0
        if costmap is None or not config.use_collision_detection:
            return v, w
        least = self._way_to_stop(velocity[0])
        if config.turn_before_collision and v > 0.0:
            turn = self._rotate(bearing, velocity[1], dt)
            return self._first_free(v, w, turn, costmap_pose or pose, distance, least, costmap)
        self._check(costmap_pose or pose, v, w, distance, least, costmap)
        return v, w

    def _curvature_point(self, local: Array) -> tuple[float, float]:
        """Return the point that curvature is taken at; beyond the goal, if that is asked for."""
        distance = self.config.curvature_lookahead_dist
        if self.config.interpolate_curvature_after_goal and len(local) > 1:
            along = local[-1] - local[-2]
            beyond = local[-1] + along / max(float(np.hypot(*along)), 1e-9) * 2.0 * distance
            local = np.vstack([local, beyond])
        return _lookahead_point(local, distance)

    def _lookahead(self, v: float) -> float:
        config = self.config
        if not config.use_velocity_scaled_lookahead_dist:
            return config.lookahead_dist
        return min(max(abs(v) * config.lookahead_time, config.min_lookahead_dist), config.max_lookahead_dist)

    def _rotate(self, angle: float, w_now: float, dt: float) -> float:
        """Return w for turning in place by `angle`: reachable from `w_now`, and able to stop in time."""
        return turn_rate(
            angle,
            w_now,
            dt,
            max_rate=self.config.rotate_to_heading_angular_vel,
            acceleration=self.config.max_angular_accel,
        )

    def _regulate(
        self,
        curvature: float,
        pose: Pose2,
        local: Array,
        length: float,
        costmap: Costmap | None,
        v_now: float,
    ) -> float:
        """Return the linear velocity: slower in turns, near obstacles and at the end."""
        config = self.config
        v = limit = self.desired_linear_vel
        if config.use_regulated_linear_velocity_scaling and curvature != 0.0:
            v = min(v, limit * abs(1.0 / curvature) / config.regulated_linear_scaling_min_radius)
        if config.use_cost_regulated_linear_velocity_scaling and costmap is not None:
            clearance = self._clearance(pose, local, costmap, self._way_to_stop(v_now))
            if clearance < config.cost_scaling_dist:
                v = min(v, limit * config.cost_scaling_gain * clearance / config.cost_scaling_dist)
        v = max(v, config.regulated_linear_scaling_min_speed)
        approach = config.approach_velocity_scaling_dist
        if length < approach:
            remaining = math.hypot(*local[-1])
            v = min(v, max(v * remaining / approach, config.min_approach_linear_velocity))
        return min(v, limit)

    def _first_free(
        self,
        v: float,
        w: float,
        turn: float,
        pose: Pose2,
        carrot_dist: float,
        least: float,
        costmap: Costmap,
    ) -> tuple[float, float]:
        """Return the command, or what may be done instead of it; raises NoValidControl if nothing may."""
        creep = self.config.creep_speed
        try:
            self._check(pose, v, w, carrot_dist, least, costmap)
        except NoValidControl:
            at = float(pose.x), float(pose.y), float(pose.yaw)
            if outline_cost(costmap.costs, self.footprint, *at, *costmap.frame) == LETHAL_OBSTACLE:
                ways = ((creep, w * creep / v), (0.0, _ESCAPE_TURN), (0.0, -_ESCAPE_TURN), (-creep, 0.0))
                for way in ways:
                    if escapes(costmap.costs, self.footprint, *at, *way, 0.05, 10, *costmap.frame):
                        return way
                raise
            for way in ((0.0, turn), (creep, w * creep / v)):
                if abs(way[0]) < 0.01 and abs(way[1]) < 0.05:
                    continue  # standing still leads nowhere
                with suppress(NoValidControl):
                    self._check(pose, *way, carrot_dist, least, costmap)
                    return way
            raise
        return v, w

    def _way_to_stop(self, v: float) -> float:
        """Return how far the robot still drives at least [m]."""
        config = self.config
        if config.max_linear_decel <= 0.0:
            return config.min_distance_to_obstacle
        way = abs(v) * config.reaction_time + v * v / (2.0 * config.max_linear_decel)
        return max(way, config.min_distance_to_obstacle)

    def _clearance(self, pose: Pose2, local: Array, costmap: Costmap, way: float) -> float:
        """Return how near the robot and the next `way` of its path come to an obstacle, from the costs."""
        points = [(pose.x, pose.y)]
        if way > 0.0:
            near = local[np.hypot(local[:, 0], local[:, 1]) < way]
            points += [tuple(point) for point in pose.apply(near[::2]).tolist()]
        costs = [costmap.cost_at(x, y) for x, y in points]
        cost = max((cost for cost in costs if cost not in (NO_INFORMATION, FREE_SPACE)), default=FREE_SPACE)
        if cost == FREE_SPACE:
            return math.inf
        decay = math.log(cost / (INSCRIBED_INFLATED_OBSTACLE - 1))
        return costmap.inscribed_radius - decay / costmap.cost_scaling_factor

    def _check(
        self, pose: Pose2, v: float, w: float, carrot_dist: float, least: float, costmap: Costmap
    ) -> None:
        """Project the command up to the carrot, a cell at a time (Nav2's CollisionChecker), or `least`."""
        if abs(v) < 0.01 and abs(w) > 0.01:
            step = 2.0 * math.asin(min(1.0, costmap.resolution / 2.0 / self._radius)) / abs(w)
        elif abs(v) >= 0.01:
            step = costmap.resolution / abs(v)
        else:
            return
        allowed = self.config.max_allowed_time_to_collision_up_to_carrot
        if least > 0.0 and abs(v) >= 0.01:
            allowed = max(allowed, least / abs(v))
            carrot_dist = max(carrot_dist, least)
        hit = steps_to_collision(
            costmap.costs,
            self.footprint,
            float(pose.x),
            float(pose.y),
            float(pose.yaw),
            float(v),
            float(w),
            step,
            carrot_dist,
            int(allowed / step),
            *costmap.frame,
        )
        if hit >= 0:
            raise NoValidControl(f"collision in {hit * step:.2f} s at {v:.2f} m/s, {w:.2f} rad/s")


def _lookahead_point(local: Array, distance: float) -> tuple[float, float]:
    """Return where the path, shape (n, 2) in the base frame, leaves the circle of radius `distance`."""
    far = np.hypot(local[:, 0], local[:, 1]) >= distance
    i = int(np.argmax(far))
    if not far[i]:
        return float(local[-1, 0]), float(local[-1, 1])
    if i == 0:
        return float(local[0, 0]), float(local[0, 1])
    (ax, ay), (bx, by) = local[i - 1].tolist(), local[i].tolist()
    dx, dy = bx - ax, by - ay
    a, b, c = dx * dx + dy * dy, ax * dx + ay * dy, ax * ax + ay * ay - distance * distance
    t = (-b + math.sqrt(b * b - a * c)) / a
    return ax + t * dx, ay + t * dy
