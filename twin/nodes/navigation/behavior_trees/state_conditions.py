"""Nav2's conditions on the robot's state: transforms, battery, a bump (plugins/condition)."""

from __future__ import annotations

from twin.bridge.msgs import BatteryState
from twin.navigation.behavior_trees.node import NodeSetup
from twin.navigation.behavior_trees.ports import Port, inputs
from twin.nodes.navigation.behavior_trees.conditions import NavigatorCondition

_BRAKE_LIMIT = -10.0
"""IsStuck's, fixed in Nav2 too [m/s²]."""


class InitialPoseReceived(NavigatorCondition):
    """Whether the blackboard says that an initial pose was received."""

    PORTS = inputs(initial_pose_received="bool")

    def holds(self) -> bool:
        """Look."""
        return bool(self.get_or_entry("initial_pose_received"))


class TransformAvailable(NavigatorCondition):
    """Whether two frames are connected; once they were, for ever."""

    PORTS = (Port("child", required=True), Port("parent", required=True))
    _was_found = False

    def holds(self) -> bool:
        """Look it up."""
        if not self._was_found:
            found = self.context.robot_pose.relative(self.get("parent"), self.get("child"))
            self._was_found = found is not None
        return self._was_found


class _Battery(NavigatorCondition):
    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._battery = self.context.latest(BatteryState, self.get("battery_topic"))


class IsBatteryLow(_Battery):
    """Whether the battery's percentage (0 to 1), or voltage, is as low as `min_battery`."""

    PORTS = (
        Port("min_battery", "double", required=True),
        *inputs(battery_topic=("string", "battery_status"), is_voltage=("bool", False)),
    )

    def holds(self) -> bool:
        """Look; false before the first message."""
        state = self._battery.message
        if state is None:
            return False
        level = state.voltage if self.get("is_voltage") else state.percentage
        return bool(level <= self.get("min_battery"))


class IsBatteryCharging(_Battery):
    """Whether the battery is being charged."""

    PORTS = inputs(battery_topic=("string", "battery_status"))

    def holds(self) -> bool:
        """Look; false before the first message."""
        state = self._battery.message
        charging = BatteryState.POWER_SUPPLY_STATUS_CHARGING
        return state is not None and state.power_supply_status == charging


class IsStuck(NavigatorCondition):
    """Whether the robot has just lost speed as it can only by a bump."""

    def __init__(self, setup: NodeSetup) -> None:
        super().__init__(setup)
        self._odometer = self.context.odometer

    def holds(self) -> bool:
        """Look at odometry."""
        return self._odometer.acceleration < _BRAKE_LIMIT
