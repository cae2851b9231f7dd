"""How fast wheels slide over the floor: the truth, for checks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import mujoco
import numpy as np

if TYPE_CHECKING:
    from twin.sim.world import World


class SlipMeter:
    """Looks at the lowest point of each driven wheel, which stands still if it rolls."""

    def __init__(self, world: World) -> None:
        """Bind to a world."""
        self._world = world
        self._wheels: dict[str, list[int]] = {}
        self._radius: dict[str, float] = {}
        self._velocity = np.zeros(6)
        for name, robot in world.robots.items():
            drive = robot.description.drive
            if drive is None:
                continue
            links = [robot.description.joints[j].child for j in (*drive.left_joints, *drive.right_joints)]
            self._wheels[name] = [world.model.body(robot.body(link)).id for link in links]
            self._radius[name] = drive.wheel_radius

    def slip(self, robot: str) -> float | None:
        """Return the largest speed of these points along the floor [m/s]; None without driven wheels."""
        if robot not in self._wheels:
            return None
        self._world.refresh_motion()
        return max(self._slide(wheel, self._radius[robot]) for wheel in self._wheels[robot])

    def _slide(self, wheel: int, radius: float) -> float:
        model, data, velocity = self._world.model, self._world.data, self._velocity
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, wheel, velocity, 0)
        turning_x, turning_y, _, x, y, _ = velocity.tolist()
        # of the point at (0, 0, -radius): v + omega x r
        return math.hypot(x - turning_y * radius, y + turning_x * radius)
