"""How wrong a robot is about where it is."""

from __future__ import annotations

import math
from collections.abc import Sequence

from twin.geometry import Pose2, wrap_angle
from twin.parameters.units import SECONDS
from twin.scenario.observation import CheckContext, RobotObservation
from twin.scenario.signals.signal import RobotSignal


class LocalisationError(RobotSignal):
    """Distance of the pose that is believed in `map` from the true one."""

    unit = "m"

    def of(self, robot: RobotObservation, time_s: float) -> float | None:
        """Return it [m]; None while nobody localises."""
        if robot.estimate is None:
            return None
        error = math.hypot(robot.estimate.x - robot.pose.xyz[0], robot.estimate.y - robot.pose.xyz[1])
        return error if math.isfinite(error) else math.inf


class LocalisationRms(LocalisationError):
    """Root mean square of that distance over all observations from a time on."""

    takes = (("after", SECONDS),)
    _squares, _count = 0.0, 0

    def __init__(self, robot: str | None, arguments: Sequence[float | str], context: CheckContext) -> None:
        super().__init__(robot, arguments, context)
        self._after = float(arguments[0])

    def of(self, robot: RobotObservation, time_s: float) -> float | None:
        """Return it [m]; None before that time."""
        error = super().of(robot, time_s)
        if error is not None and time_s >= self._after:
            self._squares += error * error
            self._count += 1
        return math.sqrt(self._squares / self._count) if self._count else None


class HeadingError(RobotSignal):
    """Angle between the heading that is believed in `map` and the true one."""

    unit = "rad"

    def of(self, robot: RobotObservation, time_s: float) -> float | None:
        """Return it [rad]; None while nobody localises."""
        if robot.estimate is None:
            return None
        error = abs(wrap_angle(robot.estimate.yaw - robot.pose.to_pose2().yaw))
        return error if math.isfinite(error) else math.inf


class OdometryDrift(RobotSignal):
    """Distance of where dead reckoning has the base from where it is, both seen from the start."""

    unit = "m"
    _start: tuple[Pose2, Pose2] | None = None

    def of(self, robot: RobotObservation, time_s: float) -> float | None:
        """Return it [m]; None without odometry."""
        if robot.odometry is None:
            return None
        now = (robot.pose.to_pose2(), robot.odometry)
        self._start = self._start or now
        true, reckoned = (start.inverse() @ end for start, end in zip(self._start, now, strict=True))
        return true.distance(reckoned)
