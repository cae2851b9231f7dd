"""`twin guard` as a program of its own, its robot and its clients elsewhere; by the wall clock."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from typing import Any

import pytest

from tests.cable import Cable
from tests.processes import program
from twin.bridge import live
from twin.bridge.msgs import DiagnosticArray, Twist, ns
from twin.live.guard.client import GuardClient
from twin.live.guard.gate import Velocity

LONG_S = 100.0


@pytest.fixture
def robot(endpoint: str) -> Iterator[live.LiveBus]:
    """Listens to what it is told, and is where the others meet."""
    with live.join((), listen=[endpoint]) as process:
        yield process


def test_a_cable_is_cut_in_the_middle_of_a_command(robot: live.LiveBus, endpoint: str) -> None:
    told: list[float] = []
    said: list[DiagnosticArray] = []
    node = robot.bus.create_node("robot")
    node.create_subscription(Twist, "/cmd_vel", lambda message: told.append(message.linear.x), 100)
    node.create_subscription(DiagnosticArray, "/guard/acknowledged", said.append, 1000)
    words = ["guard", "--connect", endpoint, "--released", "--max-age", "0.5"]
    with program(*words), closing(Cable(endpoint)) as cable, live.join([cable.endpoint]) as far:
        client = GuardClient(far.bus.create_node("mirror"))
        sent: list[int] = []

        def send() -> None:
            sent.append(client.send(Velocity(0.1 + 1e-6 * len(sent))))

        far.bus.nodes[0].create_timer(50_000_000, send)

        def both(until: Any, seconds: float = LONG_S) -> bool:
            def step() -> bool:
                far.spin_once(0.005)
                return bool(until())

            return robot.spin(step, seconds)

        assert both(lambda: told and told[-1] > 0.0)
        cable.whole.clear()
        assert both(lambda: told[-1] == 0.0), "the robot stops by itself"
        assert both(lambda: not client.is_present)
        assert not both(lambda: told[-1] != 0.0, 1.0)
        before, cut = len(told), len(sent)
        cable.whole.set()
        assert both(lambda: told[-1] > 0.0)
        assert both(lambda: len(sent) > cut and client.is_present and client.latest is not None)
        assert both(lambda: client.latest is not None and client.latest.sent_ns > sent[cut])
        verdicts = {}
        for message in said:
            (status,) = message.status
            if status.name == "autonomy":
                stamp_ns = ns(message.header.stamp)
                assert stamp_ns not in verdicts, "each command is judged once"
                verdicts[stamp_ns] = status.message
        accepted = [stamp_ns for stamp_ns, word in verdicts.items() if word == "accepted"]
        assert accepted == sorted(accepted)
        assert list(verdicts.values()).count("old") >= 2
        numbers = {round((speed - 0.1) * 1e6) for speed in told[before:] if speed}
        refused = {sent.index(stamp_ns) for stamp_ns in verdicts.keys() - {*accepted}}
        assert not numbers & refused, "none that was refused moves it"
