"""Slows down or stops a command that leads into what the sensors see: nav2_collision_monitor."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.control.collision_monitor_config import (
    ActionType,
    CollisionMonitorConfig,
    MonitorPolygon,
)

_ESCAPE_S = 0.3
"""How far a command is looked ahead that may lead out of a collision."""
INVALID_SOURCE = "invalid source"
"""What the action's polygon is called while a sensor is silent."""


@dataclass(frozen=True)
class Action:
    """What became of a command."""

    velocity: tuple[float, float]
    """v [m/s], w [rad/s]."""
    action_type: ActionType | None = None
    polygon_name: str = ""
    room: float = field(default=math.inf, compare=False)
    """How far it is along the command to what is in the way [m]; 0 in a `stop` polygon."""


@dataclass(kw_only=True)
class CollisionMonitor:
    """Looks at one command at a time; of several polygons the slowest result holds.

    Source: nav2_collision_monitor, CollisionMonitor::process.
    """

    footprint: Array
    """Corners in the base frame, shape (n, 2) [m]."""
    config: CollisionMonitorConfig = field(default_factory=CollisionMonitorConfig)

    def process(self, velocity: tuple[float, float], points: Array | None) -> Action:
        """Return what may be driven.

        Args:
            velocity: The command: v [m/s], w [rad/s].
            points: What the sensors see, in the base frame, shape (n, 2) [m]; None: a sensor is silent.
        """
        if not self.config.enabled:
            return Action(velocity)
        if points is None:
            return Action((0.0, 0.0), "stop", INVALID_SOURCE)
        seen = np.ascontiguousarray(points, dtype=np.float64)
        action = Action(velocity)
        for polygon in self.config.polygons:
            if polygon.enabled and action.action_type != "stop":
                ratio = self._ratio(polygon, velocity, seen)
                safe = (ratio * velocity[0], ratio * velocity[1])
                if math.hypot(*safe) < math.hypot(*action.velocity) or (
                    polygon.action_type == "stop" and ratio == 0.0
                ):
                    action = Action(
                        safe, polygon.action_type, polygon.name, _room(polygon, ratio, velocity[0])
                    )
        return action

    def _ratio(self, polygon: MonitorPolygon, velocity: tuple[float, float], points: Array) -> float:
        """Return what a polygon multiplies the command with."""
        v, w = velocity
        corners = np.array(polygon.points) if polygon.points else self.footprint
        if polygon.action_type == "approach":
            time = time_to_collision(
                points,
                corners,
                float(v),
                float(w),
                polygon.simulation_time_step,
                polygon.time_before_collision,
                polygon.min_points,
            )
            if time == 0.0 and self._escapes(corners, velocity, points):
                return 1.0
            return 1.0 if time < 0.0 else min(1.0, time / polygon.time_before_collision)
        if time_to_collision(points, corners, 0.0, 0.0, 1.0, -1.0, polygon.min_points) < 0.0:
            return 1.0
        if polygon.action_type == "stop":
            return 0.0
        if polygon.action_type == "slowdown":
            return polygon.slowdown_ratio
        # One ratio for both keeps the curvature.
        linear = polygon.linear_limit / abs(v) if v else 1.0
        angular = polygon.angular_limit / abs(w) if w else 1.0
        return min(1.0, linear, angular)

    def _escapes(self, corners: Array, velocity: tuple[float, float], points: Array) -> bool:
        """Whether a command leads out of points that are in the polygon already: else the robot is caught."""
        v, w = (float(value) for value in velocity)
        before = count_inside(points, corners, 0.0, 0.0, 0.0)
        turned = w * _ESCAPE_S
        after = count_inside(
            points,
            corners,
            v * _ESCAPE_S * math.cos(0.5 * turned),
            v * _ESCAPE_S * math.sin(0.5 * turned),
            turned,
        )
        return after < before


def _room(polygon: MonitorPolygon, ratio: float, v: float) -> float:
    if polygon.action_type == "approach":
        return ratio * polygon.time_before_collision * abs(v)
    return 0.0 if polygon.action_type == "stop" else math.inf


@jit
def _reach(corners: Array) -> float:
    """Return the distance of the farthest corner, shape (n, 2), and a trifle [m]."""
    squared = 0.0
    for i in range(corners.shape[0]):
        squared = max(squared, corners[i, 0] ** 2 + corners[i, 1] ** 2)
    return math.sqrt(squared) * (1.0 + 1e-9)


@jit
def count_inside(points: Array, corners: Array, x: float, y: float, yaw: float) -> int:
    """Return how many points, shape (n, 2), are in a polygon, shape (m, 2), moved to a pose."""
    c, s, inside, n = math.cos(yaw), math.sin(yaw), 0, corners.shape[0]
    reach = _reach(corners) ** 2  # most points are farther away than any corner
    for k in range(points.shape[0]):
        dx, dy = points[k, 0] - x, points[k, 1] - y
        if dx * dx + dy * dy > reach:
            continue
        px, py = c * dx + s * dy, -s * dx + c * dy
        odd, j = False, n - 1
        for i in range(n):
            if (corners[i, 1] > py) != (corners[j, 1] > py) and px < (corners[j, 0] - corners[i, 0]) * (
                py - corners[i, 1]
            ) / (corners[j, 1] - corners[i, 1]) + corners[i, 0]:
                odd = not odd
            j = i
        if odd:
            inside += 1
    return inside


@jit
def time_to_collision(
    points: Array, corners: Array, v: float, w: float, dt: float, horizon: float, min_points: int
) -> float:
    """Return when so many points are in a polygon that drives on at (v, w) [s]; -1: not within `horizon`.

    0 if they are inside now. A step's result is the time at its beginning, as Nav2's getCollisionTime.

    Args:
        points: In the base frame, shape (n, 2) [m].
        corners: Of the polygon, in the base frame, shape (n, 2) [m].
        v: [m/s]
        w: [rad/s]
        dt: Step of the projection [s].
        horizon: How far is looked ahead [s]; negative: only at the present.
        min_points: How many points make a collision.
    """
    # What is farther away than the polygon comes is never in it.
    far = _reach(corners) + abs(v) * (max(horizon, 0.0) + 2.0 * dt)
    near, count = np.empty_like(points), 0
    for k in range(points.shape[0]):
        if points[k, 0] ** 2 + points[k, 1] ** 2 <= far**2:
            near[count, 0], near[count, 1] = points[k, 0], points[k, 1]
            count += 1
    near = near[:count]
    x, y, yaw, time = 0.0, 0.0, 0.0, -dt
    while count_inside(near, corners, x, y, yaw) < min_points:
        time += dt
        if time > horizon + 1e-9:
            return -1.0
        x += v * dt * math.cos(yaw)
        y += v * dt * math.sin(yaw)
        yaw += w * dt
    return max(time, 0.0)
