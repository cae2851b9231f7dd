"""The robots of a worker, in the worker."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from twin.bridge.workers.part import Act, Part
from twin.nodes.missions.mission_node import MissionNode
from twin.runtime.stacks.missions import Missions
from twin.runtime.workers.shared_state import SharedState
from twin.runtime.workers.stand_ins import Belief, belief_of
from twin.sensors.lidar import LidarReading

if TYPE_CHECKING:
    from twin.runtime.run import Run
    from twin.runtime.stacks.robot import RobotStack


class Done(NamedTuple):
    """What a worker answers to a tick."""

    acts: list[Act]
    due_ns: int
    orders: dict[str, Any]
    """By robot: what its actuators are to do, if that has changed."""
    missions: dict[str, tuple[str, bool, bool | None, str]]
    """By robot: state, done, succeeded and reason of a mission, if they have changed."""


class RobotsHere:
    """The robots of a worker, in the worker."""

    def __init__(self, run: Run, state: SharedState, stacks: Sequence[RobotStack], index: int) -> None:
        self._run, self._state, self._stacks = run, state, stacks
        self._part = Part(run.bus, [stack.context.namespace for stack in stacks], index)
        names = {stack.name for stack in stacks}
        self._missions = {name: node for name, node in missions_of(run).items() if name in names}
        self._lidars: dict[tuple[str, int], Any] = {
            (stack.name, number): sensor.sensor
            for stack in stacks
            for number, sensor in enumerate(stack.sensors)
        }
        self._told: dict[tuple[str, str], Any] = {}

    def tick(self, step_count: int, entries: Sequence[Act]) -> Done:
        """Run the nodes once."""
        run, world = self._run, self._run.world
        self._state.take(world, step_count)
        run.parts.clock.now_ns = world.time_ns
        self._part.receive(entries)
        run.bus.spin()
        hardware = {stack.name: stack.handle.hardware.orders for stack in self._stacks}
        missions = {name: (m.state, m.done, m.succeeded, m.reason) for name, m in self._missions.items()}
        return Done(
            self._part.take(),
            self._part.due_ns,
            self._changed("orders", hardware),
            self._changed("missions", missions),
        )

    def scan(self, step_count: int, sensors: Sequence[tuple[str, int]]) -> list[LidarReading]:
        """Return what lidars see now."""
        world = self._run.world
        self._state.take(world, step_count)
        world.refresh_poses()
        return [self._lidars[sensor].sample(world.time_ns) for sensor in sensors]

    def observe(self) -> tuple[dict[str, Belief], float]:
        """Return what the robots believe, and the CPU time of this process [s]."""
        return {stack.name: belief_of(stack) for stack in self._stacks}, time.process_time()

    def _changed(self, what: str, now: dict[str, Any]) -> dict[str, Any]:
        new = {name: value for name, value in now.items() if self._told.get((what, name)) != value}
        self._told |= {(what, name): value for name, value in new.items()}
        return new


def missions_of(run: Run) -> dict[str, MissionNode]:
    """Return the missions by robot."""
    mission = run.parts.mission
    if isinstance(mission, Missions):
        return dict(mission.of)
    if not isinstance(mission, MissionNode):
        return {}
    names = {stack.context.namespace: stack.name for stack in run.parts.stacks.values()}
    return {names[mission.node.group]: mission}
