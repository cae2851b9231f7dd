from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.web.rosbridge.access import ROLES
from twin.web.rosbridge.bridge import Bridge, BridgeConfig


class Client:
    """A client of a bridge, without a socket."""

    def __init__(self, world: World, role: str, known_as: str = "") -> None:
        self.frames: list[str | bytes] = []
        self.world = world
        self.session = world.bridge.join(
            known_as or "test",
            ROLES[role],
            lambda frame, topic: self.frames.append(frame),
            is_known=bool(known_as),
        )

    def tell(self, op: str, **fields: Any) -> list[dict[str, Any]]:
        """Send a message, let the graph work, and return what came back."""
        self.session.handle({"op": op, **fields})
        self.world.spin()
        return self.heard()

    def heard(self) -> list[dict[str, Any]]:
        """Return what came since the last time."""
        frames, self.frames = self.frames, []
        return [json.loads(frame) for frame in frames]


class World:
    """A bridge on a bus of its own, whose time the test makes."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.now_s = 100.0
        self.lines: list[dict[str, Any]] = []
        self.graph = Graph.watch(bus)
        config = BridgeConfig(audit=lambda line: self.lines.append(json.loads(line)))
        self.bridge = Bridge(bus, self.graph, config, lambda: self.now_s)

    def client(self, role: str = "engineer", known_as: str = "") -> Client:
        return Client(self, role, known_as)

    def spin(self, seconds: float = 0.0) -> None:
        """Let time pass, and everybody work."""
        self.now_s += seconds
        self.bus.clock.now_ns += round(seconds * 1e9)
        for _ in range(8):
            self.bus.admit()
            self.bus.spin()
            self.bridge.update()

    def listen(self, kind: Any, topic: str) -> list[Any]:
        """Return a list that fills with what is said on a topic."""
        heard: list[Any] = []
        callback: Callable[[Any], None] = heard.append
        self.bus.create_node(f"listener_{self.bus.next_id()}").create_subscription(kind, topic, callback, 100)
        return heard


@pytest.fixture
def world() -> Iterator[World]:
    with Bus.open(Clock()) as bus:
        bus.clock.now_ns = 5_000_000_000
        made = World(bus)
        yield made
        made.graph.close()
