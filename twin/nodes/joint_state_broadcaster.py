"""Publishes what the encoders measure on `joint_states` (ros2_controllers' `joint_state_broadcaster`)."""

from __future__ import annotations

from twin.bridge.bus import Bus
from twin.bridge.msgs import Header, JointState, stamp
from twin.nodes.hardware import HardwareInterface


class JointStateBroadcasterNode:
    """`/joint_state_broadcaster`: publishes `joint_states`."""

    def __init__(self, bus: Bus, hardware: HardwareInterface, *, period_ns: int, namespace: str = "") -> None:
        self.node = bus.create_node("joint_state_broadcaster", namespace)
        self._hardware = hardware
        self._names = list(hardware.joint_names)
        self._publisher = self.node.create_publisher(JointState, "joint_states", 10)
        self.node.create_timer(period_ns, self._publish)

    def _publish(self) -> None:
        reading = self._hardware.read()
        header = Header(stamp=stamp(self.node.now_ns), frame_id="")
        self._publisher.publish(
            JointState(
                header=header,
                name=self._names,
                position=reading.position,
                velocity=reading.velocity,
                effort=reading.effort,
            ),
            frozen=True,
        )
