"""Drives that are weak, dead or late."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from twin.faults.fault import Effect, FaultContext, FaultOfRobot, refuse, some
from twin.faults.wheels import wheels_of
from twin.parameters import Fraction, Positive, Seconds, Share
from twin.scenario.faults import LastingRobotFault

_AT_LIMIT = 0.999
"""Of what a drive can do."""


class WeakDrives(FaultOfRobot):
    """Drives can do only a share of what they should."""

    joints: Sequence[str] = ()
    share = 0.0
    """Of the largest effort."""

    def __init__(self, name: str, config: Any, context: FaultContext) -> None:
        super().__init__(name, config, context)
        self._limited = self._ticks = 0

    def begin(self) -> None:
        """Weaken them."""
        for joint in self.joints:
            self.hardware.weaken(joint, self.share, self)

    def end(self) -> None:
        """Let them be strong again."""
        for joint in self.joints:
            self.hardware.weaken(joint, None, self)

    def update(self) -> None:
        """See whether they did all they could."""
        self._ticks += 1
        self._limited += any(self._is_at_limit(joint) for joint in self.joints)

    @property
    def effect(self) -> Effect:
        """In how many ticks they did all they could, and less than was asked for."""
        return Effect(self._limited > 0, f"drives at their limit in {self._limited} of {self._ticks} ticks")

    def _is_at_limit(self, joint: str) -> bool:
        strongest = self.hardware.strongest(joint)
        if strongest == 0.0:
            return self.hardware.ordered(joint) != 0.0
        return abs(self.hardware.exerted(joint)) >= _AT_LIMIT * strongest


class WeakMotor(WeakDrives):
    """A motor is weaker than it should be."""

    value = "factor"

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """A motor that is weaker than it should be."""

        factor: Annotated[float, Fraction]
        """Of its largest torque or force that is left."""
        joint: str | None = None
        """Which it moves; absent: all driven wheels."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        robot, hardware = self.robot.name, self.hardware
        valid = hardware.commanded_joints if config.joint else wheels_of(self)
        self.joints = some("motor at joint", config.joint, valid, "joint", robot)
        endless = [joint for joint in self.joints if not math.isfinite(hardware.strongest(joint))]
        if endless and config.factor > 0.0:
            raise refuse(
                "joint" if config.joint else "",
                f"the motor of '{endless[0]}' of robot '{robot}' has no limit",
            )
        self.share = config.factor
        self.text = f"{', '.join(self.joints)} of {robot}: {config.factor:g} times the force"


class FlatBattery(WeakDrives):
    """The battery is low: no motor has its full force; when it is flat, none has any."""

    value = "voltage"

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """A battery that is low; sensors and computers run on."""

        voltage: Annotated[Share, Fraction] = 0.0
        """Of the nominal one; what motors can do falls with it. 0: motors are off, and turn freely."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        self.joints = some("motor", None, self.hardware.commanded_joints, "", self.robot.name)
        if config.voltage > 0.0:
            self.joints = [joint for joint in self.joints if math.isfinite(self.hardware.strongest(joint))]
        self.share = config.voltage
        self.text = f"the battery of {self.robot.name} is down to {100.0 * config.voltage:g} %"


class DroppedGood(WeakDrives):
    """The gripper lets go of what it holds."""

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """A gripper that lets go; best with `when: {grasped: ...}`."""

        duration: Annotated[Seconds, Positive] = 1.0
        """How long the gripper has no force [s]."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        manipulator = self.robot.manipulator
        if manipulator is None:
            raise refuse("", f"robot '{self.robot.name}' has no gripper")
        self.joints = [manipulator.gripper_joint]
        self.text = f"the gripper of {self.robot.name} lets go"
        self._had: frozenset[str] = frozenset()
        self._lost: frozenset[str] = frozenset()

    def begin(self) -> None:
        """Let go."""
        self._had = self._holds()
        super().begin()

    def update(self) -> None:
        """See what has slipped away."""
        self._lost |= self._had - self._holds()

    @property
    def effect(self) -> Effect:
        """What was dropped."""
        what = ", ".join(sorted(self._lost)) or "nothing"
        return Effect(bool(self._lost), f"{what} was dropped" if self._had else "nothing was held")

    def _holds(self) -> frozenset[str]:
        return frozenset(good for good, robot in self.context.held().items() if robot == self.robot.name)


class Latency(FaultOfRobot):
    """Commands take longer from the computer to the motors."""

    value = "time"

    @dataclass(frozen=True, kw_only=True)
    class Config(LastingRobotFault):
        """Commands that take longer to the motors."""

        time: Annotated[Seconds, Positive]
        """By how much, beyond `command_latency` [s]; a whole number of control periods."""

    def __init__(self, name: str, config: Config, context: FaultContext) -> None:
        super().__init__(name, config, context)
        period_ns = context.control_period_ns
        if round(config.time * 1e9) % period_ns:
            period = f"control periods ({period_ns / 1e6:g} ms)"
            raise refuse("time", f"the latency ({config.time * 1e3:g} ms) must be a whole number of {period}")
        self.text = f"commands of {self.robot.name} take {config.time * 1e3:g} ms longer"
        self._late = self._ticks = 0

    def begin(self) -> None:
        """Hold commands back."""
        self.hardware.delay_commands(self.config.time, self)

    def end(self) -> None:
        """Hold them back no more."""
        self.hardware.delay_commands(None, self)

    def update(self) -> None:
        """See whether motors do what is past."""
        self._ticks += 1
        self._late += self.hardware.is_late

    @property
    def effect(self) -> Effect:
        """In how many ticks a motor did something else than what was commanded."""
        return Effect(self._late > 0, f"motors late in {self._late} of {self._ticks} ticks")
