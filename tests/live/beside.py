"""Robots of this process as the physical ones of a mirror: tick by tick, however busy the machine is."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from twin.bridge.node import Node
from twin.bridge.topics import Publisher, Sample, Subscription
from twin.bridge.wire.session import SessionConfig
from twin.live.mirror.followed_clock import FollowedClock
from twin.live.mirror.robot_clocks import RobotClocks
from twin.live.mirror.source import ClockChange, ClockReading, Source
from twin.live.perturbations import perturbed
from twin.live.plant import Plant
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import Scenario

START_NS = 1_700_000_000_000_000_000
BOUND_S = 1e-3
_NOT_CARRIED = ("/clock", "/rosout", "/parameter_events", "/diagnostics")


def plant(scenario: Scenario, perturb: str = "", **options: Any) -> Plant:
    """Return robots that are ticked by somebody."""
    changed, error = perturbed(scenario, perturb)
    return Plant(changed, error=error, network=SessionConfig(), pace=None, start_ns=START_NS, **options)


class Beside(Source):
    """Carries messages between a mirror and plants, each of which has a bus of its own, both ways."""

    is_live = True

    def __init__(self, *plants: Plant, delay_s: float = 0.0) -> None:
        self.delay_ns = round(delay_s * 1e9)
        self.plants: list[Plant] = list(plants)
        self.is_cut = False
        self.alters: Callable[[str, Any], None] = lambda topic, message: None
        """Is shown what robots say, on its way, and may change it."""
        self._nodes: dict[int, Node] = {}
        """Of the cable's end at each plant."""
        self._publishers: dict[tuple[int, str], Publisher[Any]] = {}
        self._queue: list[tuple[int, int, Callable[[], None]]] = []
        self._count = 0

    @property
    def start_ns(self) -> int:
        return START_NS

    def reading(self, robot: str) -> ClockReading:
        return ClockReading(bound_s=BOUND_S)

    def begin(self, run: OpenRun, clock: FollowedClock) -> None:
        self._run, self._clock = run, clock
        self._node = run.run.bus.create_node("cable")
        run.run.bus.forget(self._node)  # it is no part of the mirror: what it says is not said from here
        stacks = run.run.parts.stacks
        spaces = {name: stack.context.namespace for name, stack in stacks.items()}
        self._clocks = RobotClocks(clock, spaces) if len(stacks) > 1 else None
        run.run.bus.tap(self._down)
        plants, self.plants = self.plants, []
        for each in plants:
            self.start(each)

    def after_tick(self) -> Sequence[ClockChange]:
        for each in self.plants:
            each.advance(lambda: True)
        now_ns = self._run.run.world.time_ns
        while self._queue and self._queue[0][0] <= now_ns:
            heapq.heappop(self._queue)[2]()
        if not self.plants:
            return ()
        if self._clocks is None:
            set_by_ns = self._clock.follow(self.plants[0].clock.now_ns, 0)
            return (ClockChange(what="clock", set_by_ns=set_by_ns),) if set_by_ns else ()
        self._clock.follow(START_NS + now_ns, 0)
        changes: list[ClockChange] = []
        for robots in self.plants:
            for name in robots.names:
                changes += self._clocks.follow(name, now_ns, robots.clock.now_ns, round(BOUND_S * 1e9))
        return changes

    def start(self, robots: Plant) -> None:
        """Connect robots, from now on."""
        bus = robots.run.run.bus
        self.plants.append(robots)
        self._nodes[id(robots)] = bus.create_node("cable")
        bus.tap(partial(self._up, robots))
        for end in [end for node in bus.nodes for end in node.endpoints]:
            if isinstance(end, Publisher) and end.is_latched:
                for sample in end.retained(100):
                    self._up(robots, sample)

    def kill(self, robots: Plant) -> None:
        """End robots as a cut of their power would."""
        self.plants.remove(robots)
        robots.close()

    def close(self) -> None:
        for each in self.plants:
            each.close()

    def _up(self, robots: Plant, sample: Sample[Any]) -> None:
        if sample.publisher.node is self._nodes[id(robots)] or sample.topic in _NOT_CARRIED:
            return
        self._carry(self._node, id(robots), sample, self._comes_in)

    def _comes_in(self, topic: str, message: Any) -> None:
        self.alters(topic, message)
        if self._clocks is not None:
            self._clocks.stamp_anew(topic, message)

    def _down(self, sample: Sample[Any]) -> None:
        if sample.publisher.node is self._node or sample.topic.startswith("/twin/"):
            return
        for robots in self.plants:
            ends = [end for node in robots.run.run.bus.nodes for end in node.endpoints]
            if any(isinstance(end, Subscription) and end.name == sample.topic for end in ends):
                self._carry(self._nodes[id(robots)], -id(robots), sample)

    def _carry(
        self,
        node: Node,
        way: int,
        sample: Sample[Any],
        comes_in: Callable[[str, Any], None] = lambda topic, message: None,
    ) -> None:
        if self.is_cut:
            return
        publisher = self._publishers.get((way, sample.topic))
        if publisher is None:
            said = sample.publisher
            publisher = node.create_publisher(said.codec.cls, said.name, said.qos)
            self._publishers[way, sample.topic] = publisher
        message = publisher.codec.decode(sample.payload)
        comes_in(sample.topic, message)
        self._count += 1
        due_ns = self._run.run.world.time_ns + self.delay_ns
        say = partial(publisher.publish, message, frozen=True)
        heapq.heappush(self._queue, (due_ns, self._count, say))
