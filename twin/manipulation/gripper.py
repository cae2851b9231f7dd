"""What a two-finger gripper can tell from its own joint: moving, stalled on something, or closed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

GripperState = Literal["moving", "stalled", "reached"]


@dataclass(frozen=True, kw_only=True)
class GripperConfig:
    """Parameters of ros2_controllers' `gripper_action_controller`, with its names."""

    goal_tolerance: float = 0.003
    """The goal is reached when nearer than this [m]."""
    stall_velocity_threshold: float = 0.002
    """Slower than this is standing still [m/s]."""
    stall_timeout: float = 0.3
    """Standing still away from the goal for this long is a stall [s]."""


class GripperMonitor:
    """Follows one move of the gripper."""

    def __init__(self, config: GripperConfig, goal: float) -> None:
        self.config = config
        self.goal = goal
        self._still = 0.0

    def update(self, position: float, velocity: float, dt: float) -> GripperState:
        """Take the finger's measured position [m] and velocity [m/s], `dt` [s] after the last ones."""
        if abs(velocity) > self.config.stall_velocity_threshold:
            self._still = 0.0
            return "moving"
        self._still += dt
        if self._still < self.config.stall_timeout:
            return "moving"
        return "reached" if abs(position - self.goal) <= self.config.goal_tolerance else "stalled"
