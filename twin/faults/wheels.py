"""Odometry that is wrong: encoders that miscount, wheels of another size, or elsewhere, than all believe."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from twin.faults.fault import Effect, FaultContext, FaultOfRobot, one_of, refuse, some
from twin.parameters import Metres, Positive, Radians
from twin.scenario.faults import LastingRobotFault, RobotFault

_LEAST_RAD, _LEAST_M = 1e-3, 1e-4
"""Less is no effect."""


class TurningWheels(FaultOfRobot):
    """Something is wrong by a factor for as long as wheels turn."""

    joints: Sequence[str] = ()
    _last: Sequence[float] = ()
    angle = 0.0
    """How far the joints have turned since the begin, there and back, all together [rad]."""

    @abstractmethod
    def alter(self, joint: str, factor: float | None) -> None:
        """Let a joint be wrong by a factor; None: as it was."""

    def begin(self) -> None:
        """Let all be wrong."""
        self._last = self._angles()
        for joint in self.joints:
            self.alter(joint, self.config.factor)

    def end(self) -> None:
        """Let all be right, from here."""
        for joint in self.joints:
            self.alter(joint, None)

    def update(self) -> None:
        """Add up how far the joints turn."""
        now = self._angles()
        self.angle += math.fsum(abs(a - b) for a, b in zip(now, self._last, strict=True))
        self._last = now

    def _angles(self) -> list[float]:
        return [self.hardware.angle(joint) for joint in self.joints]


class Encoder(TurningWheels):
    """The encoder of a wheel counts wrongly."""

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """The encoder of a wheel counts wrongly."""

        joint: str
        """The wheel's joint."""
        factor: float
        """Of what it should count: -1 the wrong way, 0 nothing, 1.02 two percent too much."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        joint, robot = config.joint, self.robot.name
        one_of("encoder at joint", joint, self.hardware.encoders, "joint", robot)
        self.text = f"the encoder of {robot}'s {joint} counts {config.factor:g} times what it should"
        self.joints = [joint]

    def alter(self, joint: str, factor: float | None) -> None:
        """Count wrongly."""
        self.hardware.misread(joint, factor, self)

    @property
    def effect(self) -> Effect:
        """How much was counted wrongly."""
        wrong = self.angle * abs(1.0 - self.config.factor)
        return Effect(wrong > _LEAST_RAD, f"{self.config.joint}: {wrong:.3f} rad counted wrongly")


class OdometryJump(FaultOfRobot):
    """The wheels' encoders miscount at once, as if the robot had driven."""

    @dataclass(frozen=True, kw_only=True)
    class Config(RobotFault):
        """The wheels' encoders miscount at once, as if the robot had driven."""

        distance: Metres = 0.0
        """As if straight ahead by so much [m] ..."""
        yaw: Radians = 0.0
        """... while it turned by so much [rad]."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        drive = self.robot.drive
        if drive is None:
            raise refuse("", f"robot '{self.robot.name}' has no drive whose odometry could jump")
        half_track = drive.controller.track / 2.0
        self._angles: dict[str, float] = {}
        for joints, side in ((drive.config.left_joints, -1.0), (drive.config.right_joints, 1.0)):
            angle = (config.distance + side * config.yaw * half_track) / drive.config.drive.wheel_radius
            self._angles.update(dict.fromkeys(joints, angle))
        self.text = f"odometry of {self.robot.name} jumps"

    def begin(self) -> None:
        """Miscount."""
        for joint, angle in self._angles.items():
            self.hardware.miscount(joint, angle)

    @property
    def effect(self) -> Effect:
        """What was counted and not driven."""
        most = max(map(abs, self._angles.values()))
        return Effect(most > _LEAST_RAD, f"wheels counted up to {most:.3f} rad that they did not turn")


class WheelRadius(TurningWheels):
    """Wheels are smaller, or larger, than odometry and controllers reckon with."""

    value = "factor"

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """Wheels of another size than all believe; the robot's height stays."""

        factor: Annotated[float, Positive]
        """True radius, of the one that odometry and controllers reckon with."""
        joint: str | None = None
        """Of the wheel; absent: all driven wheels."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        self.joints = some("driven wheel", config.joint, wheels_of(self), "joint", self.robot.name)
        drive = self.robot.drive
        self._radius = drive.config.drive.wheel_radius if drive is not None else math.nan
        self.text = f"wheels of {self.robot.name} are {config.factor:g} times as large as believed"

    def alter(self, joint: str, factor: float | None) -> None:
        """Change a wheel."""
        self.hardware.resize_wheel(joint, factor, self)

    @property
    def effect(self) -> Effect:
        """How much of the way odometry misjudges."""
        wrong = self.angle / len(self.joints) * self._radius * abs(1.0 - 1.0 / self.config.factor)
        return Effect(wrong > _LEAST_M, f"{wrong:.4f} m of each wheel's way misjudged")


class Track(FaultOfRobot):
    """Wheels stand nearer together, or further apart, than odometry and controllers reckon with."""

    value = "factor"

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """Wheels that stand otherwise than all believe."""

        factor: Annotated[float, Positive]
        """True distance of left and right wheels, of the one that odometry and controllers reckon with."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        some("driven wheel", None, wheels_of(self), "", self.robot.name)
        self.text = f"the track of {self.robot.name} is {config.factor:g} times as wide as believed"
        self._yaw = self._angle = 0.0

    def begin(self) -> None:
        """Mount the wheels elsewhere."""
        self._yaw = self._heading()
        self._mount(self.config.factor)

    def end(self) -> None:
        """Mount them as before."""
        self._mount(None)

    def update(self) -> None:
        """Add up how far the robot turns."""
        yaw = self._heading()
        self._angle += abs(math.remainder(yaw - self._yaw, 2.0 * math.pi))
        self._yaw = yaw

    @property
    def effect(self) -> Effect:
        """How much of the turning odometry misjudges."""
        wrong = self._angle * abs(self.config.factor - 1.0)
        return Effect(wrong > _LEAST_RAD, f"{math.degrees(wrong):.2f} deg of turning misjudged")

    def _heading(self) -> float:
        return self.context.world.pose(self.robot.handle.base).to_pose2().yaw

    def _mount(self, factor: float | None) -> None:
        handle = self.robot.handle
        self.context.world.alterations.scale_track(handle.name, handle.description, factor, self)


def wheels_of(fault: FaultOfRobot) -> list[str]:
    """Return the joints of a robot's driven wheels."""
    handle = fault.robot.handle
    return [*fault.context.world.alterations.wheels(handle.name, handle.description)]
