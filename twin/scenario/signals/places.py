"""How far a robot's base truly is from places."""

from __future__ import annotations

import math
from collections.abc import Sequence

from twin.geometry import Pose2, wrap_angle
from twin.parameters import Metres, Radians
from twin.parameters.units import unit_of
from twin.scenario.observation import CheckContext, RobotObservation, outside_distance
from twin.scenario.signals.signal import RobotSignal, text_argument

_M, _RAD = unit_of(Metres), unit_of(Radians)


class DistanceTo(RobotSignal):
    """Distance of the base from a point of the floor."""

    unit = "m"
    takes = (("x", _M), ("y", _M))

    def __init__(self, robot: str | None, arguments: Sequence[float | str], context: CheckContext) -> None:
        super().__init__(robot, arguments, context)
        self._point = tuple(map(float, arguments))

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [m]."""
        return math.dist(robot.pose.xyz[:2].tolist(), self._point)


class DistanceToCircle(RobotSignal):
    """Distance of the base from a circle on the floor, inside or outside."""

    unit = "m"
    takes = (("x", _M), ("y", _M), ("radius", _M))

    def __init__(self, robot: str | None, arguments: Sequence[float | str], context: CheckContext) -> None:
        super().__init__(robot, arguments, context)
        self._x, self._y, self._radius = map(float, arguments)

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [m]."""
        x, y, _ = robot.pose.xyz
        return abs(math.hypot(x - self._x, y - self._y) - self._radius)


class DistanceToZone(RobotSignal):
    """How far the base's origin is outside of a zone of the arena; 0 inside."""

    unit = "m"
    takes = (("zone", None),)

    def __init__(self, robot: str | None, arguments: Sequence[float | str], context: CheckContext) -> None:
        super().__init__(robot, arguments, context)
        self._zone = context.zone(text_argument(arguments))

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [m]."""
        return outside_distance(self._zone, robot.pose)


class DistanceToStart(RobotSignal):
    """Distance of the base from where it was first seen."""

    unit = "m"
    _start: Pose2 | None = None

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [m]."""
        here = robot.pose.to_pose2()
        self._start = self._start or here
        return self._start.distance(here)


class TurnedFromStart(RobotSignal):
    """Angle between the base's heading and its first one, never negative."""

    unit = "rad"
    _start: float | None = None

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [rad]."""
        yaw = robot.pose.to_pose2().yaw
        self._start = yaw if self._start is None else self._start
        return abs(wrap_angle(yaw - self._start))


class DistanceToGoal(RobotSignal):
    """Distance of the base from the goal that its navigator drives to, else from the last one."""

    unit = "m"

    def of(self, robot: RobotObservation, time_s: float) -> float | None:
        """Return it [m], once there is a goal."""
        return None if robot.goal is None else robot.pose.to_pose2().distance(robot.goal)


class TurnedFrom(RobotSignal):
    """Angle between the base's heading and another one, never negative."""

    unit = "rad"
    takes = (("yaw", _RAD),)

    def __init__(self, robot: str | None, arguments: Sequence[float | str], context: CheckContext) -> None:
        super().__init__(robot, arguments, context)
        self._yaw = float(arguments[0])

    def of(self, robot: RobotObservation, time_s: float) -> float:
        """Return it [rad]."""
        return abs(wrap_angle(robot.pose.to_pose2().yaw - self._yaw))
