"""The guard before a robot that moves: its wheels, not only its topics, do as it says."""

from __future__ import annotations

import statistics
from typing import Any

from twin.bridge.graph import Graph
from twin.bridge.msgs import Odometry
from twin.bridge.wire.session import SessionConfig
from twin.live.guard.client import GuardClient
from twin.live.guard.gate import GateConfig, Velocity
from twin.live.guard.limits import drive_limits
from twin.live.guard.node import GuardNode
from twin.live.guard.request import Request
from twin.live.perturbations import perturbed
from twin.live.plant import Plant
from twin.scenario.schema import load

LOSS = "loss=20%"
"""Of all that is said, by whomever."""


def test_a_stop_gets_through_a_link_that_loses_messages_and_holds() -> None:
    scenario, error = perturbed(load("diff_bot_figure8"), LOSS)
    with Plant(scenario, error=error, network=SessionConfig(), pace=None, start_ns=10**18) as robots:
        bus, world = robots.run.run.bus, robots.run.run.world
        linear, angular = drive_limits("diff_bot")
        config = GateConfig(linear=linear, angular=angular)
        GuardNode(bus, Graph.watch(bus), config, monotonic_ns=lambda: world.time_ns)
        node = bus.create_node("mirror")
        client = GuardClient(node, monotonic_ns=lambda: world.time_ns)
        speeds: list[float] = []
        node.create_subscription(Odometry, "/odom", lambda m: speeds.append(m.twist.twist.linear.x), 10)
        node.create_timer(50_000_000, lambda: client.send(Velocity(0.4)))

        def go_on(seconds: float, until: Any = lambda: False) -> float:
            """Return how long it took [s]; simulated."""
            start_ns = world.time_ns
            robots.advance(lambda: world.time_ns - start_ns >= seconds * 1e9 or until())
            return (world.time_ns - start_ns) * 1e-9

        go_on(1.0)
        assert max(speeds) < 0.01, "it waits for a release"

        def accepted(request: Request | None) -> float:
            return go_on(5.0, lambda: request is not None and request.is_accepted)

        times = []
        for _ in range(10):
            assert accepted(client.release()) < 2.0
            assert go_on(5.0, lambda: speeds[-1] > 0.39) < 5.0
            stop = client.stop()
            times.append(go_on(1.0, lambda: speeds[-1] < 0.37))
            assert accepted(stop) < 1.0
            go_on(1.0)
            assert abs(speeds[-1]) < 0.01
            assert client.status is not None
            assert client.status.stopped_by == "/mirror"
        assert statistics.median(times) < 0.1
        assert max(times) < 0.4
        assert len(speeds) < 0.9 * world.time_ns / 20e6, "messages were lost"
