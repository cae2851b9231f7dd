"""How a robot's base truly moves. Derivatives are differences between two observations."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from twin.geometry import Array, matrix_from_quat_wxyz, wrap_angle
from twin.scenario.observation import CheckContext, RobotObservation
from twin.scenario.signals.signal import RobotSignal

_LEAST = 0.1
"""A path that is shorter has no efficiency yet [m]."""


class X(RobotSignal):
    """True position of the base along x."""

    unit = "m"

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [m]."""
        return float(robot.pose.xyz[0])


class Y(RobotSignal):
    """True position of the base along y."""

    unit = "m"

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [m]."""
        return float(robot.pose.xyz[1])


class Z(RobotSignal):
    """True height of the base."""

    unit = "m"

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [m]."""
        return float(robot.pose.xyz[2])


class Yaw(RobotSignal):
    """True heading of the base, from -180 to 180 degrees."""

    unit = "rad"

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [rad]."""
        return robot.pose.to_pose2().yaw


class Tilt(RobotSignal):
    """Angle between the base's z axis and the vertical."""

    unit = "rad"

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [rad]."""
        return math.acos(max(-1.0, min(1.0, float(matrix_from_quat_wxyz(robot.pose.quat_wxyz)[2, 2]))))


class Speed(RobotSignal):
    """True speed of the base on the floor."""

    unit = "m/s"

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [m/s]."""
        return robot.speed


class TurnRate(RobotSignal):
    """True rate at which the base turns, to the left positive."""

    unit = "rad/s"
    _last: tuple[float, float] | None = None

    def of(self, robot: RobotObservation, time_s: float) -> float | None:
        """Return it [rad/s]."""
        yaw, last = robot.pose.to_pose2().yaw, self._last
        self._last = (time_s, yaw)
        if last is None or time_s <= last[0]:
            return None
        return wrap_angle(yaw - last[1]) / (time_s - last[0])


class _Derivative(RobotSignal):
    """The size of a derivative of the position on the floor."""

    order: int

    def __init__(self, robot: str | None, arguments: Sequence[float | str], context: CheckContext) -> None:
        super().__init__(robot, arguments, context)
        self._last: list[tuple[float, Array]] = []
        """Time [s] and value of the position and its derivatives, as far as they are known."""

    def of(self, robot: RobotObservation, time_s: float) -> float | None:
        """Return it; None for the first observations."""
        value: Array = np.array(robot.pose.xyz[:2])
        if self._last and time_s <= self._last[0][0]:
            return None
        now = [(time_s, value)]
        for then, before in self._last:
            value = (value - before) / (time_s - then)
            now.append((time_s, value))
        self._last = now[: self.order]
        return float(np.hypot(*value)) if len(now) > self.order else None


class Acceleration(_Derivative):
    """Size of the base's true acceleration on the floor, in curves too."""

    unit, order = "m/s²", 2


class Jerk(_Derivative):
    """Size of the change of that acceleration."""

    unit, order = "m/s³", 3


class DrivenDistance(RobotSignal):
    """Length of the base's true path so far."""

    unit = "m"
    _distance = 0.0
    _last: tuple[float, float] | None = None

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [m]."""
        here = (float(robot.pose.xyz[0]), float(robot.pose.xyz[1]))
        self._distance += math.dist(self._last or here, here)
        self._last = here
        return self._distance


class PathEfficiency(DrivenDistance):
    """Straight distance from the start as a part of the path's length; 1 is a straight line."""

    unit = ""
    _start: tuple[float, float] | None = None

    def of(self, robot: RobotObservation, time_s: float) -> float | None:  # type: ignore[override]
        """Return it, once the robot has left its start."""
        driven = super().of(robot, time_s)
        self._start = self._start or self._last
        assert self._start is not None
        assert self._last is not None
        return math.dist(self._start, self._last) / driven if driven >= _LEAST else None
