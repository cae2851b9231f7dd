"""What a robot spends, and what its wheels lose."""

from __future__ import annotations

from twin.scenario.observation import RobotObservation
from twin.scenario.signals.signal import RobotSignal


class Energy(RobotSignal):
    """Mechanical work of the actuators so far: force times true velocity of each joint, where positive."""

    unit = "J"
    needs = "work_J"

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [J]."""
        return robot.work_J


class Slip(RobotSignal):
    """Speed at which a driven wheel slides over the floor; the worst wheel's."""

    unit = "m/s"
    needs = "slip"

    def of(self, robot: RobotObservation, time_s: float) -> float | None:
        """Return it [m/s]; None for a robot without driven wheels."""
        return robot.slip
