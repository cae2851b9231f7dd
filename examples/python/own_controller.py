"""A controller of one's own in Nav2's place: `python examples/python/own_controller.py` drives with it.

In a scenario file it is `controller: {plugin: own_controller.py:Pursuit, speed: 0.3}` under `navigation`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

import twin
from twin.navigation.control.controller import Controller, Situation
from twin.parameters import Metres, MetresPerSecond, Positive


@dataclass(frozen=True, kw_only=True)
class PursuitConfig:
    """Parameters of `Pursuit`."""

    speed: Annotated[MetresPerSecond, Positive] = 0.3
    """Where the path is straight."""
    lookahead: Annotated[Metres, Positive] = 0.4
    """Distance of the point that it steers for."""


class Pursuit(Controller):
    """Pure pursuit in a dozen lines: an arc to a point of the path ahead; it looks at no obstacles."""

    Config = PursuitConfig

    @property
    def max_speed(self) -> float:
        """The speed that percentages of a speed limit are of [m/s]."""
        return self.config.speed

    def compute_velocity_commands(self, now: Situation) -> tuple[float, float]:
        """Turn towards the point first, if it is not ahead; slow down before the end."""
        ahead = self.path[:, :2] - (now.pose.x, now.pose.y)
        distance = np.hypot(*ahead.T)
        rest = distance[np.argmin(distance) :]
        far = np.flatnonzero(rest >= self.config.lookahead)
        target = int(np.argmin(distance)) + (int(far[0]) if len(far) else len(rest) - 1)
        x, y = ahead[target]
        bearing = math.remainder(math.atan2(y, x) - now.pose.yaw, 2.0 * math.pi)
        if distance[-1] < 0.05:
            return 0.0, math.remainder(self.path[-1, 2] - now.pose.yaw, 2.0 * math.pi)
        if abs(bearing) > 0.8:
            return 0.0, math.copysign(0.8, bearing)
        v = min(self.speed, max(0.05, float(distance[-1])))
        return v, 2.0 * v * math.sin(bearing) / max(float(distance[target]), 0.1)


def main() -> None:
    """Send one goal, and look at how it went."""
    controller = {"plugin": f"{Path(__file__).name}:Pursuit", "speed": 0.4}
    overrides = {"robots.0.navigation": {"controller": controller}}
    with twin.Simulation(Path(__file__).with_name("rover.yaml"), overrides=overrides) as simulation:
        pose = {"header": {"frame_id": "map"}, "pose": {"position": {"x": 1.5, "y": 1.5}}}
        goal = simulation.send_goal("/navigate_to_pose", {"pose": pose})
        simulation.run_until(lambda: goal.done, timeout=30.0)
        x, y, _ = simulation.truth.pose("rover").xyz
        print(f"succeeded: {goal.succeeded}, at x {x:.2f} m, y {y:.2f} m after {simulation.time:.1f} s")


if __name__ == "__main__":
    main()
