"""Publishes what is left in a robot's battery on `battery_state`, as drivers of real ones do."""

from __future__ import annotations

import math

from twin.bridge.bus import Bus
from twin.bridge.msgs import BatteryState, Header, new, stamp
from twin.sim.battery import Battery, Supply

STATUS = {
    Supply.DISCHARGING: BatteryState.POWER_SUPPLY_STATUS_DISCHARGING,
    Supply.CHARGING: BatteryState.POWER_SUPPLY_STATUS_CHARGING,
    Supply.FULL: BatteryState.POWER_SUPPLY_STATUS_FULL,
    Supply.IDLE: BatteryState.POWER_SUPPLY_STATUS_NOT_CHARGING,
}
_AMPERE_HOUR = 3600.0
"""[C]"""


class BatteryStateBroadcasterNode:
    """`/battery_state_broadcaster`: publishes `battery_state`; who simulates the battery says when."""

    def __init__(self, bus: Bus, *, frame: str, namespace: str = "") -> None:
        """Make the node; `frame` is of the link that carries the battery."""
        self.node = bus.create_node("battery_state_broadcaster", namespace)
        self._frame = frame
        self._publisher = self.node.create_publisher(BatteryState, "battery_state", 10)

    def publish(self, battery: Battery) -> None:
        """Tell its state, stamped with the present time; what nobody measures is NaN, as the message asks."""
        capacity = battery.config.capacity / _AMPERE_HOUR
        self._publisher.publish(
            new(
                BatteryState,
                header=Header(stamp=stamp(self.node.now_ns), frame_id=self._frame),
                voltage=battery.voltage,
                temperature=math.nan,
                current=0.0 - battery.current,  # into the battery, and never -0
                charge=battery.charge / _AMPERE_HOUR,
                capacity=capacity,
                design_capacity=capacity,
                percentage=battery.share,
                power_supply_status=STATUS[battery.supply],
                power_supply_health=BatteryState.POWER_SUPPLY_HEALTH_GOOD,
                power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_UNKNOWN,
                present=True,
                location=battery.config.battery_name,
            ),
            frozen=True,
        )
