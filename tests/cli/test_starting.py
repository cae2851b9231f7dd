"""Commands about a graph that is not yet, or not yet whole."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Generator
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest

from tests.processes import wait_for
from twin.bridge.action_types import Fibonacci
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.srvs import AddTwoInts


def execute(goal: GoalHandle) -> Generator[None, None, Any]:
    yield
    return Fibonacci.Result(np.array([0, 1], np.int32))


def test_calls_that_come_before_their_server_are_answered(endpoint: str) -> None:
    calls = {
        "sum=3": ("service", "call", "/add", "example_interfaces/srv/AddTwoInts", "{a: 1, b: 2}"),
        "SUCCEEDED": ("action", "send_goal", "/count", "example_interfaces/action/Fibonacci", "{order: 2}"),
    }
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with ExitStack() as running:
        waiting = {}
        for answer, words in calls.items():
            command = [sys.executable, "-m", "twin.cli", *words, "--connect", endpoint]
            waiting[answer] = running.enter_context(subprocess.Popen(command, **pipes))
            running.callback(waiting[answer].kill)
        for call in waiting.values():
            assert call.stderr.readline().startswith(f"waiting: nobody answers at {endpoint}; start ")
        bus = running.enter_context(Bus.open(Clock(), listen=[endpoint]))
        bus.starting()
        node = bus.create_node("late")
        node.create_service(AddTwoInts, "add", lambda r: AddTwoInts.Response(r.a + r.b))
        ActionServer(node, Fibonacci, "count", execute)
        bus.started()

        def answered() -> bool:
            bus.external.wait(0.05)
            bus.admit()
            bus.spin()
            return all(call.poll() is not None for call in waiting.values())

        wait_for(answered, 120)
        for answer, call in waiting.items():
            output, errors = call.communicate()
            assert (call.returncode, errors) == (0, "")
            assert answer in output


def test_lists_of_a_graph_that_is_not_whole_say_so(
    endpoint: str, invoke: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("twin.bridge.graph.Graph.whole.__func__.__defaults__", (0.0,))
    said = "WARNING: what is shown may be incomplete: somebody has been making nodes for more than 0 s\n"
    with Bus.open(Clock(), listen=[endpoint]) as bus:
        bus.starting()
        bus.create_node("first")
        for words in (("node", "list"), ("topic", "list"), ("service", "list"), ("action", "list")):
            assert invoke(*words, "--connect", endpoint)[::2] == (0, said)
        bus.started()
        assert invoke("node", "list", "--connect", endpoint) == (0, "/first\n", "")
