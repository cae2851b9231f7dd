"""Path following: Nav2's Regulated Pure Pursuit (Macenski, Singh, Martín, Ginés 2023, arXiv 2305.20026).

With what lies ahead of a command, and what to do instead where that is in the way.
"""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np

from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation.control.controller import Controller, Situation
from twin.navigation.control.path_handler import LocalPath, PathHandler, PathHandlerConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.control.rotation import turn_rate
from twin.navigation.costmaps.costmap import (
    FREE_SPACE,
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
    collision_step,
    footprint_cost,
    triple,
)
from twin.navigation.costmaps.footprint import radii
from twin.navigation.costmaps.kernels import escapes
from twin.navigation.failures import NoValidControl


class RegulatedPurePursuit(Controller):
    """Drives the arc to a point of the path ahead; plans nothing."""

    Config = RegulatedPurePursuitConfig
    config: RegulatedPurePursuitConfig

    @property
    def max_speed(self) -> float:
        """desired_linear_vel [m/s]."""
        return self.config.desired_linear_vel

    @property
    def reverses(self) -> bool:
        """Whether it drives backwards."""
        return self.config.allow_reversing

    def _build(self) -> None:
        config = self.config
        self._tolerance = config.xy_goal_tolerance
        self._collisions = CollisionCheck(config, self.footprint)
        self._handler = PathHandler(
            PathHandlerConfig.of(config), to_cusps=config.allow_reversing, prune_distance=math.inf
        )

    def set_plan(self, path: Array) -> None:
        """Follow another path; see `Controller.set_plan`."""
        self._handler.accept(path)
        super().set_plan(path)
        self._reached_xy = self._cancelling = self._stopped = False

    def reset(self) -> None:
        """Forget the path."""
        super().reset()
        self._handler.reset()
        self._reached_xy = self._cancelling = self._stopped = False

    def cancel(self) -> bool:
        """Brake along the path if use_cancel_deceleration; return whether the robot may be stopped."""
        self._cancelling = True
        return self._stopped or not self.config.use_cancel_deceleration

    def compute_velocity_commands(self, now: Situation) -> tuple[float, float]:
        """Return the command (v [m/s], w [rad/s]); see `Controller.compute_velocity_commands`."""
        config = self.config
        ahead = self._handler.local(now.pose)
        sign = -1.0 if ahead.reversing and config.allow_reversing else 1.0
        local = now.pose.inverse().apply(ahead.poses[:, :2])
        x, y = _lookahead_point(local, self._lookahead(now.velocity[0]))
        self.carrot = (now.pose @ Pose2(x, y, 0.0))[:2]
        distance = math.hypot(x, y)
        if config.use_fixed_curvature_lookahead:
            x, y = self._curvature_point(local)
        bearing = math.atan2(sign * y, sign * x)
        turn = self._turn_in_place(now, ahead, math.hypot(*local[-1]), bearing)
        if turn is None:
            curvature = 2.0 * y / (x * x + y * y) if x * x + y * y > 0.001 else 0.0
            v = sign * min(self._regulate(now, curvature, local, ahead.length), self._reachable(now, sign))
            if self._cancelling and config.use_cancel_deceleration:
                v = sign * max(0.0, sign * now.velocity[0] - config.cancel_deceleration * now.dt)
            w = v * curvature
        else:
            v, w = 0.0, turn
        self._stopped = self._cancelling and v == 0.0
        if now.costmap is None or not config.use_collision_detection:
            return v, w
        look = now.at, now.costmap, distance, self._collisions.way_to_stop(now.velocity[0])
        if config.turn_before_collision and v > 0.0:
            return self._collisions.first_free(v, w, self._turn_rate(bearing, now), *look)
        self._collisions.check(v, w, *look)
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

    def _turn_in_place(self, now: Situation, ahead: LocalPath, off: float, bearing: float) -> float | None:
        """Return the rate of a turn to the goal's heading, or to a carrot aside; None: drive.

        `off` is the distance to the local path's end [m], `bearing` the carrot's [rad].
        """
        self._reached_xy = self._is_there(self._reached_xy, off, at_end=ahead.ends_at_goal)
        if not self.config.use_rotate_to_heading:
            return None
        if self._reached_xy:
            assert self.path is not None
            return self._turn_rate(wrap_angle(float(self.path[-1, 2]) - now.pose.yaw), now)
        return (
            self._turn_rate(bearing, now) if abs(bearing) > self.config.rotate_to_heading_min_angle else None
        )

    def _turn_rate(self, angle: float, now: Situation) -> float:
        """Return w for turning in place by `angle`: reachable from the present one, able to stop in time."""
        return turn_rate(
            angle,
            now.velocity[1],
            now.dt,
            max_rate=self.config.rotate_to_heading_angular_vel,
            acceleration=self.config.max_angular_accel,
        )

    def _reachable(self, now: Situation, sign: float) -> float:
        """Return the speed that the robot can have when a command gets to its wheels [m/s]."""
        config = self.config
        if not config.max_linear_accel:
            return math.inf
        return max(0.0, sign * now.velocity[0]) + config.max_linear_accel * (config.reaction_time + now.dt)

    def _regulate(self, now: Situation, curvature: float, local: Array, length: float) -> float:
        """Return the linear velocity: slower in turns, near obstacles and at the end."""
        config = self.config
        v = limit = self.speed
        if config.use_regulated_linear_velocity_scaling and curvature != 0.0:
            v = min(v, limit * abs(1.0 / curvature) / config.regulated_linear_scaling_min_radius)
        if config.use_cost_regulated_linear_velocity_scaling and now.costmap is not None:
            way = self._collisions.way_to_stop(now.velocity[0])
            clearance = self._collisions.clearance(now.at, local, now.costmap, way)
            if clearance < config.cost_scaling_dist:
                v = min(v, limit * config.cost_scaling_gain * clearance / config.cost_scaling_dist)
        v = max(v, config.regulated_linear_scaling_min_speed)
        approach = config.approach_velocity_scaling_dist
        if length < approach:
            remaining = math.hypot(*local[-1])
            v = min(v, max(v * remaining / approach, config.min_approach_linear_velocity))
        return min(v, limit)


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


_ESCAPE_TURN = 0.5
"""Rate at which the robot turns away from what it nearly touches [rad/s]."""


class CollisionCheck:
    """Of a robot with a footprint of shape (n, 2) [m]."""

    def __init__(self, config: RegulatedPurePursuitConfig, footprint: Array) -> None:
        self._config = config
        self._footprint = footprint
        self._radius = max(radii(footprint)[1], 0.05)

    def way_to_stop(self, v: float) -> float:
        """Return how far the robot still drives at least [m]."""
        config = self._config
        if config.max_linear_decel <= 0.0:
            return config.min_distance_to_obstacle
        way = abs(v) * config.reaction_time + v * v / (2.0 * config.max_linear_decel)
        return max(way, config.min_distance_to_obstacle)

    def clearance(self, pose: Pose2, local: Array, costmap: Costmap, way: float) -> float:
        """Return how near the robot and the next `way` of its path come to an obstacle [m]."""
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

    def first_free(
        self, v: float, w: float, turn: float, pose: Pose2, costmap: Costmap, carrot: float, least: float
    ) -> tuple[float, float]:
        """Return the command, or what may be done instead of it; raises NoValidControl if nothing may.

        Args:
            v: Forwards [m/s].
            w: [rad/s]
            turn: The rate at which the robot could turn in place instead [rad/s].
            pose: Of the base, in the costmap's frame.
            costmap: Around it.
            carrot: Distance of the carrot [m].
            least: As `check` has it.
        """
        creep = self._config.creep_speed
        try:
            self.check(v, w, pose, costmap, carrot, least)
        except NoValidControl:
            if footprint_cost(costmap, self._footprint, pose) == LETHAL_OBSTACLE:
                ways = ((creep, w * creep / v), (0.0, _ESCAPE_TURN), (0.0, -_ESCAPE_TURN), (-creep, 0.0))
                for way in ways:
                    if escapes(costmap.costs, self._footprint, triple(pose), way, 0.05, 10, costmap.frame):
                        return way
                raise
            for way in ((0.0, turn), (creep, w * creep / v)):
                if abs(way[0]) < 0.01 and abs(way[1]) < 0.05:
                    continue  # standing still leads nowhere
                with suppress(NoValidControl):
                    self.check(*way, pose, costmap, carrot, least)
                    return way
            raise
        return v, w

    def check(self, v: float, w: float, pose: Pose2, costmap: Costmap, carrot: float, least: float) -> None:
        """Project a command up to the carrot, a cell at a time (Nav2's CollisionChecker), or `least` far [m].

        Raises:
            NoValidControl: it collides within max_allowed_time_to_collision_up_to_carrot.
        """
        if abs(v) < 0.01 and abs(w) > 0.01:
            step = 2.0 * math.asin(min(1.0, costmap.resolution / 2.0 / self._radius)) / abs(w)
        elif abs(v) >= 0.01:
            step = costmap.resolution / abs(v)
        else:
            return
        allowed = self._config.max_allowed_time_to_collision_up_to_carrot
        if least > 0.0 and abs(v) >= 0.01:
            allowed = max(allowed, least / abs(v))
            carrot = max(carrot, least)
        hit = collision_step(costmap, self._footprint, pose, (v, w), step, int(allowed / step), carrot)
        if hit >= 0:
            raise NoValidControl(f"collision in {hit * step:.2f} s at {v:.2f} m/s, {w:.2f} rad/s")
