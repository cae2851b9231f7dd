"""What lies ahead of a command of regulated pure pursuit, and what to do instead where that is in the way."""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
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
