"""Robots and parts of the world that are heavier, or elsewhere, than all believe."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from twin.faults.fault import Effect, Fault, FaultContext, FaultOfRobot, refuse, some
from twin.parameters import Positive
from twin.scenario.faults import FaultConfig, LastingRobotFault, RobotFault
from twin.scenario.fields import PoseConfig

_HERE = PoseConfig()


class Mass(FaultOfRobot):
    """A robot, or a part of it, is heavier or lighter than its file says."""

    value = "factor"

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """A robot that is heavier or lighter than its file says."""

        factor: Annotated[float, Positive]
        """Of mass and inertia."""
        link: str | None = None
        """Which part; absent: all."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        handle = self.robot.handle
        links = some("link", config.link, list(handle.description.links), "link", self.robot.name)
        self._bodies = [handle.body(link) for link in links]
        self.text = f"{config.link or 'all'} of {self.robot.name} is {config.factor:g} times as heavy"
        self._came = 0.0

    def begin(self) -> None:
        """Load it."""
        self._came = self.context.world.alterations.scale_mass(self._bodies, self.config.factor, self)

    def end(self) -> None:
        """Unload it."""
        self.context.world.alterations.scale_mass(self._bodies, None, self)

    @property
    def effect(self) -> Effect:
        """How much it was."""
        return Effect(abs(self._came) > 1e-6, f"{self._came:+.4g} kg")


class Kidnapping(FaultOfRobot):
    """Somebody lifts the robot and puts it down elsewhere: its wheels do not turn."""

    @dataclass(frozen=True, kw_only=True)
    class Config(RobotFault):
        """Somebody lifts the robot and puts it down elsewhere: its wheels do not turn."""

        to: PoseConfig
        """Where, in the world; its base stands there."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        robot = self.robot
        if not robot.handle.is_free:
            raise refuse("", f"robot '{robot.name}' cannot be carried away: its base is not free")
        self.text = f"{robot.name} is carried to ({config.to.x:g}, {config.to.y:g})"
        self._came = self._turned = 0.0

    def begin(self) -> None:
        """Carry it."""
        to, handle = self.config.to.pose, self.robot.handle
        here = self.context.world.pose(handle.base).to_pose2()
        self._came, self._turned = here.distance(to), abs(math.remainder(to.yaw - here.yaw, 2.0 * math.pi))
        handle.carry(self.robot.standing(to))

    @property
    def effect(self) -> Effect:
        """How far it was carried."""
        turned = math.degrees(self._turned)
        return Effect(
            self._came > 1e-3 or turned > 0.1, f"carried {self._came:.3g} m and turned {turned:.3g} deg"
        )


class Displacement(Fault):
    """A part of the arena stands elsewhere than on its map, from the start; its goods stand on it."""

    @dataclass(frozen=True, kw_only=True)
    class Config(FaultConfig):
        """A part of the arena stands elsewhere than on its map, from the start; its goods stand on it."""

        name: str
        """Name of a rack, pallet, pillar or obstacle of the arena."""
        by: PoseConfig
        """How far it was moved, along the axes of `map`, and turned."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        if config.at or config.when is not None:
            raise refuse(
                "when" if config.when is not None else "at", "a displacement is there from the start"
            )
        self.text = ""

    def begin(self) -> None:
        """Do nothing: the world is built so."""

    @property
    def effect(self) -> Effect:
        """How far it was moved."""
        by = self.config.by
        turned = math.degrees(by.yaw)
        text = f"{self.config.name} moved {math.hypot(by.x, by.y):.3g} m and turned {turned:.3g} deg"
        return Effect(by != _HERE, text)
