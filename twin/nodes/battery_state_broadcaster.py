"""Publishes what is left in a robot's battery on `battery_state`, as drivers of real ones do."""

from __future__ import annotations

import math
from dataclasses import dataclass

from twin.bridge.bus import Bus
from twin.bridge.msgs import BatteryState, Header, new, stamp


@dataclass(frozen=True, kw_only=True)
class BatteryReading:
    """What a battery's electronics tell."""

    voltage: float
    """At its poles [V]."""
    current: float
    """Into it [A]; negative while it is drained, as in ROS."""
    charge: float
    """That is left [Ah]."""
    capacity: float
    """[Ah]"""
    status: int
    """One of BatteryState.POWER_SUPPLY_STATUS_*."""


class BatteryStateBroadcasterNode:
    """`/battery_state_broadcaster`: publishes `battery_state`; who has the battery says when."""

    def __init__(self, bus: Bus, *, name: str, frame: str, namespace: str = "") -> None:
        """Make the node; `name` is the battery's, `frame` that of the link that carries it."""
        self.node = bus.create_node("battery_state_broadcaster", namespace)
        self._name, self._frame = name, frame
        self._publisher = self.node.create_publisher(BatteryState, "battery_state", 10)

    def publish(self, reading: BatteryReading) -> None:
        """Tell its state, stamped with the present time; what nobody measures is NaN, as the message asks."""
        self._publisher.publish(
            new(
                BatteryState,
                header=Header(stamp=stamp(self.node.now_ns), frame_id=self._frame),
                voltage=reading.voltage,
                temperature=math.nan,
                current=reading.current,
                charge=reading.charge,
                capacity=reading.capacity,
                design_capacity=reading.capacity,
                percentage=reading.charge / reading.capacity,
                power_supply_status=reading.status,
                power_supply_health=BatteryState.POWER_SUPPLY_HEALTH_GOOD,
                power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_UNKNOWN,
                present=True,
                location=self._name,
            ),
            frozen=True,
        )
