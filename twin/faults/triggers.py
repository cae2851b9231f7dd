"""What faults wait for, by the truth of the simulator."""

from __future__ import annotations

from collections.abc import Callable, Collection
from fnmatch import fnmatchcase

from twin.errors import nearest
from twin.faults.fault import FaultContext, Robot, refuse
from twin.geometry import Pose2
from twin.scenario.faults import When
from twin.scenario.observation import Zone

Waiting = Callable[[], bool]
"""Asked once a tick; returns whether it has come."""


def waiting(when: When, robot: str | None, context: FaultContext, begun: Collection[str]) -> Waiting:
    """Return what a fault waits for.

    Args:
        when: As the scenario says.
        robot: Whose way and gripper count; None: any robot's.
        context: The run.
        begun: Names of the faults that have begun, which grows.

    Raises:
        Faults: The arena lacks the zone.
    """
    robots = [context.robots[robot]] if robot is not None else list(context.robots.values())

    def pose(robot: Robot) -> Pose2:
        return context.world.pose(robot.handle.base).to_pose2()

    if (near := when.near) is not None:
        middle = Pose2(near.x, near.y, 0.0)
        return lambda: any(pose(robot).distance(middle) <= near.within for robot in robots)
    if when.zone is not None:
        if when.zone not in context.zones:
            valid = nearest(when.zone, context.zones) if context.zones else "the world has no zones"
            raise refuse("when", f"the world has no zone '{when.zone}'; {valid}")
        zone = context.zones[when.zone]
        return lambda: any(_is_in(pose(robot), zone) for robot in robots)
    if (pattern := when.mission_state) is not None:
        return lambda: fnmatchcase(context.mission_state(), pattern)
    if (good := when.grasped) is not None:
        names = {robot.name for robot in robots}
        return lambda: any(fnmatchcase(held, good) and by in names for held, by in context.held().items())
    if (far := when.driven) is not None:
        ways = [_Way(pose(robot)) for robot in robots]
        return lambda: max(way.to(pose(it)) for way, it in zip(ways, robots, strict=True)) >= far
    other = when.fault
    return lambda: other in begun


def _is_in(pose: Pose2, zone: Zone) -> bool:
    inside = zone.T_zone_world @ pose
    return abs(inside.x) <= zone.size[0] / 2.0 and abs(inside.y) <= zone.size[1] / 2.0


class _Way:
    """How far something has come."""

    def __init__(self, start: Pose2) -> None:
        self._last, self._length = start, 0.0

    def to(self, pose: Pose2) -> float:
        """Go on to a pose; return the length of the way so far [m]."""
        self._length += pose.distance(self._last)
        self._last = pose
        return self._length
