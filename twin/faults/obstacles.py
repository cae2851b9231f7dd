"""What gets into the way of robots."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated

from twin.faults.fault import Effect, Fault, FaultContext, Robot, refuse
from twin.geometry import Pose2
from twin.parameters import Metres, MetresPerSecond, NotNegative, Positive, Seconds
from twin.scenario.faults import LastingRobotFault
from twin.scenario.fields import PoseConfig
from twin.scenario.world import Length, Obstacle

_IN_THE_WAY = 2.0
"""So near to a robot's base something is in its way [m]."""


@dataclass(frozen=True, kw_only=True)
class ObstacleConfig(LastingRobotFault, ABC):
    """Something in the way."""

    pose: PoseConfig | None = None
    """Where its footprint's centre stands, in the world ..."""
    ahead: Annotated[Metres, Positive] | None = None
    """... or so far ahead of the robot's base, turned as the robot is [m]."""

    @abstractmethod
    def obstacle(self, name: str) -> Obstacle:
        """Return it as the world has obstacles."""


class InTheWay(Fault):
    """Something stands, or walks, where nothing was, and is gone at the end."""

    def __init__(self, name: str, config: ObstacleConfig, context: FaultContext) -> None:
        super().__init__(name, config, context)
        if (config.pose is None) == (config.ahead is None):
            raise refuse("", f"give the {name} either a pose, or how far ahead of the robot it is")
        if config.ahead is not None and getattr(config, "route", None) is not None:
            raise refuse("route", f"a {name} that walks along a route starts at a pose")
        robots = context.robots
        if config.ahead is not None and config.robot is None and len(robots) > 1:
            raise refuse("ahead", f"name the robot of which it is ahead; valid: {', '.join(robots)}")
        self._robot: Robot = robots[config.robot] if config.robot else next(iter(robots.values()))
        self.text, self.end_text = f"{name} in the way", f"{name} is gone"
        self._nearest = math.inf

    def begin(self) -> None:
        """Come."""
        pose, ahead = None, self.config.ahead
        if ahead is not None:
            pose = self.context.world.pose(self._robot.handle.base).to_pose2() @ Pose2(ahead, 0.0, 0.0)
        self.context.obstacles.come(self.name, pose)

    def end(self) -> None:
        """Go."""
        self.context.obstacles.leave(self.name)

    def update(self) -> None:
        """See how near robots come."""
        world, obstacles = self.context.world, self.context.obstacles
        for robot in self.context.robots.values():
            gap = obstacles.gap(self.name, world.pose(robot.handle.base).to_pose2())
            self._nearest = min(self._nearest, gap)

    @property
    def effect(self) -> Effect:
        """Whether it was in somebody's way."""
        return Effect(self._nearest < _IN_THE_WAY, f"{self._nearest:.3g} m from the nearest robot's base")


class Pallet(InTheWay):
    """A pallet, or another box, stands in the way."""

    @dataclass(frozen=True, kw_only=True)
    class Config(ObstacleConfig):
        """A box in the way; it cannot be pushed."""

        size: tuple[Length, Length, Length] = (0.8, 1.2, 1.0)
        """Extent along its x, y and z [m]."""

        def obstacle(self, name: str) -> Obstacle:
            """Return the box."""
            return Obstacle(name=name, pose=self.pose or PoseConfig(), size=self.size)


class Person(InTheWay):
    """A person stands or walks in the way."""

    @dataclass(frozen=True, kw_only=True)
    class Config(ObstacleConfig):
        """A person who stands, or walks to and fro and gives way to robots."""

        route: tuple[tuple[Metres, Metres], ...] | None = None
        """Points [x, y] along which they walk from their pose, and back again; absent: they stand."""
        speed: Annotated[MetresPerSecond, Positive] = 1.0
        """Of walking [m/s]."""
        yields_within: Length = 1.0
        """They stop before a robot whose base is this near, or any part 0.3 m, now or soon [m] ..."""
        patience: Annotated[Seconds, NotNegative] = 3.0
        """... and turn back when that has lasted so long [s]."""

        def obstacle(self, name: str) -> Obstacle:
            """Return the person as a box."""
            return Obstacle(
                name=name,
                pose=self.pose or PoseConfig(),
                size=(0.4, 0.5, 1.75),
                route=self.route,
                speed=self.speed,
                yields_within=self.yields_within,
                patience=self.patience,
            )
