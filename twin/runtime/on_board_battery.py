"""A robot's battery in a run: what drains it, where it is charged, and what happens when it is empty."""

from __future__ import annotations

import math
from collections.abc import Sequence

from twin.bridge.msgs import BatteryState
from twin.geometry import Pose2, wrap_angle
from twin.navigation.docking.docks import DockDatabase
from twin.nodes.battery_state_broadcaster import BatteryReading, BatteryStateBroadcasterNode
from twin.periods import next_due, period_of
from twin.sim.battery import Battery, BatteryConfig, Supply
from twin.sim.robot import RobotHandle
from twin.sim.world import World

_TURNED = math.radians(20.0)
"""Contacts of a charger touch up to such an angle; docking ends far below it."""
_ENOUGH = 0.01
"""Share of its capacity from which on an empty battery powers motors again."""
_AMPERE_HOUR = 3600.0
"""[C]"""
_STATUS = {
    Supply.DISCHARGING: BatteryState.POWER_SUPPLY_STATUS_DISCHARGING,
    Supply.CHARGING: BatteryState.POWER_SUPPLY_STATUS_CHARGING,
    Supply.FULL: BatteryState.POWER_SUPPLY_STATUS_FULL,
    Supply.IDLE: BatteryState.POWER_SUPPLY_STATUS_NOT_CHARGING,
}
_STANDS = 0.02
"""A robot that is slower than this [m/s] stands."""


class OnBoardBattery:
    """Ticked after the physics, in the process of the physics: a worker knows of no work.

    Charging goes by the truth: where the robot's base really is, and where the docks are in the world. Frame
    `map` is the world's.
    """

    def __init__(
        self,
        world: World,
        handle: RobotHandle,
        node: BatteryStateBroadcasterNode,
        config: BatteryConfig,
        *,
        base: str,
        chargers: Sequence[Pose2],
    ) -> None:
        """Bind to a world before its first step.

        Args:
            world: Of the robot; it measures work from now on.
            handle: The robot.
            node: What tells of it.
            config: Of the battery.
            base: The link that stands at a dock's pose.
            chargers: Those poses.
        """
        world.measure_work()
        self.battery = Battery(config)
        self._world, self._handle, self._node, self._chargers = world, handle, node, chargers
        self._base = handle.body(base if base in handle.description.links else handle.description.root)
        self._period = period_of(config.update_rate)
        self._now_ns = self._due_ns = 0
        self._work = 0.0
        self._place = world.pose(self._base).to_pose2()
        self._drains = config.start_draining
        self._is_off = False
        self._switch()

    def update(self) -> None:
        """Account for the time since the last call, and publish when that is due."""
        world, hardware = self._world, self._handle.hardware
        step_ns, work = world.time_ns - self._now_ns, world.work(self._handle.name)
        self._drains = self._drains or any(map(hardware.ordered, hardware.commanded_joints))
        load = (
            self.battery.config.power_load + (work - self._work) / (step_ns * 1e-9) if self._drains else 0.0
        )
        self.battery.advance(step_ns, load, charges=self._stands_at_charger(step_ns))
        self._now_ns, self._work = world.time_ns, work
        self._switch()
        if self._now_ns >= self._due_ns:
            self._due_ns = next_due(self._period, self._now_ns)
            self._node.publish(reading_of(self.battery))

    def _switch(self) -> None:
        """Take the motors' power while the battery is empty, as the fault `flat_battery` does."""
        if self._is_off == (self.battery.is_empty or (self._is_off and self.battery.share < _ENOUGH)):
            return
        self._is_off, hardware = not self._is_off, self._handle.hardware
        for joint in hardware.commanded_joints:
            hardware.weaken(joint, 0.0 if self._is_off else None, self)
        log = self._node.node.get_logger()
        if self._is_off:
            log.error("the battery is empty: motors are off, and turn freely")
        else:
            log.info("the battery is being charged: motors are on")

    def _stands_at_charger(self, step_ns: int) -> bool:
        if not self._chargers:
            return False
        place, before = self._world.pose(self._base).to_pose2(), self._place
        self._place = place
        reach = self.battery.config.charger_reach
        return place.distance(before) < _STANDS * step_ns * 1e-9 and any(
            place.distance(dock) <= reach and abs(wrap_angle(place.yaw - dock.yaw)) <= _TURNED
            for dock in self._chargers
        )


def reading_of(battery: Battery) -> BatteryReading:
    """Return what the battery's electronics tell."""
    return BatteryReading(
        voltage=battery.voltage,
        current=0.0 - battery.current,  # never -0
        charge=battery.charge / _AMPERE_HOUR,
        capacity=battery.config.capacity / _AMPERE_HOUR,
        status=_STATUS[battery.supply],
    )


def charger_poses(docks: DockDatabase, frame: str) -> list[Pose2]:
    """Return where a base stands at each charger in the world, whose frame is called `frame`."""
    known = (dock for dock in docks.docks.values() if dock.frame == frame)
    return [dock.pose for dock in known if docks.type_of(dock.type).is_charger]
