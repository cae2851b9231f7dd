"""What controllers need of a robot's joints; what ros2_control calls the hardware interface."""

from __future__ import annotations

from typing import Protocol

from twin.geometry import Array


class JointReading(Protocol):
    """Measured joint states, one entry per joint name."""

    @property
    def position(self) -> Array:
        """[rad] or [m], shape (joints,)."""

    @property
    def velocity(self) -> Array:
        """[rad/s] or [m/s], shape (joints,)."""

    @property
    def effort(self) -> Array:
        """[Nm] or [N], shape (joints,)."""


class HardwareInterface(Protocol):
    """Joints that can be read and commanded: `twin.sim.hardware`, or a physical robot's driver."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Order of a reading."""

    def read(self) -> JointReading:
        """Return what the encoders say now."""

    def command(self, joint: str, value: float) -> None:
        """Set the target of one joint, in the unit of its command interface."""

    def limit_effort(self, joint: str, effort: float) -> None:
        """Let one joint press with no more than `effort` [N or Nm], nor with more than its own limit."""
