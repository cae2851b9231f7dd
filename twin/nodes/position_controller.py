"""`/position_controller`: targets for single joints, as ros2_controllers' forward command controller."""

from __future__ import annotations

from collections.abc import Sequence

from twin.bridge.bus import Bus
from twin.bridge.msgs import Float64MultiArray
from twin.nodes.hardware import HardwareInterface


class PositionControllerNode:
    """Takes `position_controller/commands`: one value per joint, in the order of `joints`."""

    def __init__(
        self, bus: Bus, hardware: HardwareInterface, joints: Sequence[str], *, namespace: str = ""
    ) -> None:
        self.node = bus.create_node("position_controller", namespace)
        self.joints = tuple(joints)
        self._hardware = hardware
        self.node.create_subscription(Float64MultiArray, "position_controller/commands", self._on_commands, 1)

    def _on_commands(self, message: Float64MultiArray) -> None:
        if len(message.data) != len(self.joints):
            self.node.get_logger().error(
                f"{len(message.data)} commands for the {len(self.joints)} joints {', '.join(self.joints)}"
            )
            return
        for joint, value in zip(self.joints, message.data.tolist(), strict=True):
            self._hardware.command(joint, value)
