"""What a robot touches, and how near it comes to that."""

from __future__ import annotations

from collections.abc import Sequence

from twin.scenario.observation import CheckContext, Observation, RobotObservation
from twin.scenario.signals.signal import RobotSignal, Signal


class Clearance(RobotSignal):
    """Smallest distance of the robot's shapes from everything but itself and the floor; at most 5 m."""

    unit = "m"
    needs = "clearance"

    def of(self, robot: RobotObservation, time_s: float) -> float | None:
        """Return it [m]."""
        return robot.clearance


class ContactForce(Signal):
    """Hardest contact of the robot, and of what it carries, since the last observation; 0 without one."""

    unit = "N"

    def __init__(self, robot: str | None, arguments: Sequence[float | str], context: CheckContext) -> None:
        super().__init__(robot, arguments, context)
        self._robot, self._robots = context.robot(robot), context.robots

    def value(self, observation: Observation) -> float:
        """Return it [N]."""
        both = [view for c in observation.contacts for view in (c, c.by_the_other(self._robots)) if view]
        return max((contact.force_N for contact in both if contact.robot == self._robot), default=0.0)
