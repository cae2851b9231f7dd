"""`/gripper_controller`: opens and closes the fingers (ros2_controllers' `gripper_action_controller`)."""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import Any

from twin.bridge.action_types import GripperCommand
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.msgs import new
from twin.manipulation.gripper import GripperConfig, GripperMonitor
from twin.nodes.hardware import HardwareInterface


class GripperControllerNode:
    """Commands the finger joint and tells how the move ended: `reached_goal` or `stalled` on something.

    `max_effort` is of the finger joint, and of each that mimics it: what a finger presses with [N]. If it is
    0, as in an empty message, the joint's limit holds alone.
    """

    def __init__(
        self,
        bus: Bus,
        hardware: HardwareInterface,
        joint: str,
        *,
        period_ns: int = 20_000_000,
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node("gripper_controller", namespace)
        self.config = GripperConfig()
        self._hardware = hardware
        self._joint = joint
        self._index = hardware.joint_names.index(joint)
        self._dt = period_ns * 1e-9
        ActionServer(self.node, GripperCommand, "gripper_controller/gripper_cmd", self._execute)

    def _execute(self, goal: GoalHandle) -> Generator[None, None, Any]:
        target = float(goal.request.command.position)
        monitor = GripperMonitor(self.config, target)
        wanted = float(goal.request.command.max_effort)
        self._hardware.limit_effort(self._joint, wanted if wanted > 0.0 else math.inf)
        self._hardware.command(self._joint, target)
        while True:
            yield
            reading = self._hardware.read()
            position = float(reading.position[self._index])
            state = monitor.update(position, float(reading.velocity[self._index]), self._dt)
            if goal.is_cancel_requested:
                self._hardware.command(self._joint, position)
                goal.canceled()
            elif state == "moving":
                continue
            return new(
                GripperCommand.Result,
                position=position,
                effort=abs(float(reading.effort[self._index])),
                stalled=state == "stalled",
                reached_goal=state == "reached",
            )
